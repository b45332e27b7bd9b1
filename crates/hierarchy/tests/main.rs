//! Behaviour of the facade on logs: made ones, and real ones where they are at hand.

mod logs;
mod office_loop;
mod real_logs;
mod sessions;
