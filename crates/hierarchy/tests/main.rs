//! Behaviour of the facade on logs: made ones, and real ones where they are at hand.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up must fail")]
#![expect(clippy::print_stdout, reason = "a skipped test says so")]
#![expect(clippy::cast_precision_loss, reason = "cells and metres are few")]

mod agreement;
mod beside;
#[path = "../examples/blind_robot/drive.rs"]
mod blind_robot;
mod carried;
mod doors;
mod edits;
mod explain;
mod exploration;
mod live_map;
mod locate;
mod logs;
mod office_loop;
mod plans;
mod real_logs;
mod recognitions;
mod rooms;
mod sessions;
