//! The map while it is made, in a browser: one page, one picture of the state, both read-only, on the loopback address.

mod state;

use std::io::{self, BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use hierarchy::Mapper;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use state::State;

/// The page; it asks for the state again and again.
const PAGE: &str = include_str!("live/live.html");
/// No more than five pictures a second...
const PERIOD: Duration = Duration::from_millis(200);
/// ...and less where the map is large: a picture may cost one part in so many of the run's time.
const SHARE: u32 = 25;
/// A page that has not asked for so long is closed, and nothing is drawn for it.
const PATIENCE: Duration = Duration::from_secs(3);
/// A browser that does not say what it wants is hung up on.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Whether the map can be looked at while it is made.
#[derive(Debug, Args)]
pub(crate) struct LiveArgs {
    /// Serve a page that shows the map while it is made, and print its address
    #[arg(long)]
    live: bool,
    /// Where to serve it; other machines can look where this is an address of this one in their network
    #[arg(long, value_name = "ADDRESS:PORT", requires = "live", default_value = "127.0.0.1:0")]
    listen: SocketAddr,
}

impl LiveArgs {
    /// Starts the page, if one is asked for.
    pub(crate) fn start(&self, context: &Context) -> Result<Option<Live>, Failure> {
        let live = self.live.then(|| Live::start(self.listen)).transpose()?;
        if let Some(live) = &live {
            context.say(&format!("live: {}", live.address()));
        }
        Ok(live)
    }
}

/// The page of a run that goes on.
#[derive(Debug)]
pub(crate) struct Live {
    shared: Arc<Shared>,
    address: SocketAddr,
    next: Instant,
}

/// What the run and the page's server both hold.
#[derive(Debug)]
struct Shared {
    state: Mutex<Arc<str>>,
    started: Instant,
    /// When the page last asked, in milliseconds since the start, and one; 0 where it never did.
    asked: AtomicU64,
    /// Whether only browsers of this machine may ask.
    loopback: bool,
}

impl Live {
    /// Serves the page at an address; port 0 takes a free one.
    pub(crate) fn start(address: SocketAddr) -> Result<Self, Failure> {
        let refused = |error: io::Error| {
            Failure::new(Exit::Failed, "live.listen", format!("could not listen at {address}: {error}"))
                .help("leave --listen out to take a free port")
        };
        let listener = TcpListener::bind(address).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        let shared = Arc::new(Shared {
            state: Mutex::new(Arc::from("{}")),
            started: Instant::now(),
            asked: AtomicU64::new(0),
            loopback: address.ip().is_loopback(),
        });
        let served = Arc::clone(&shared);
        // The thread ends with the program: it holds nothing that would have to be put away.
        std::thread::spawn(move || listener.incoming().flatten().for_each(|browser| served.answer(&browser)));
        Ok(Self { shared, address, next: Instant::now() })
    }

    /// Where the page is.
    pub(crate) fn address(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Shows the map as it is now, if somebody looks and the last picture is old enough.
    ///
    /// It reads the mapper and changes nothing of it, so a run that is watched has the same results.
    pub(crate) fn show(&mut self, mapper: &Mapper) {
        let begun = Instant::now();
        if begun < self.next || !self.shared.is_watched() {
            return;
        }
        if let Ok(state) = serde_json::to_string(&State::of(mapper)) {
            *self.shared.state.lock().unwrap_or_else(PoisonError::into_inner) = Arc::from(state);
        }
        let spent = begun.elapsed();
        self.next = begun + spent + PERIOD.max(spent * SHARE);
    }
}

impl Shared {
    fn is_watched(&self) -> bool {
        let asked = Duration::from_millis(self.asked.load(Ordering::Relaxed));
        !asked.is_zero() && self.started.elapsed() < asked + PATIENCE
    }

    /// Answers one request; a browser that goes away in the middle is no fault of ours.
    fn answer(&self, browser: &TcpStream) {
        let _ = browser.set_read_timeout(Some(TIMEOUT)).and_then(|()| browser.set_write_timeout(Some(TIMEOUT)));
        let _ = self.try_answer(browser);
    }

    fn try_answer(&self, mut browser: &TcpStream) -> io::Result<()> {
        let Some(request) = Request::read(&mut BufReader::new(io::Read::take(browser, 16 << 10)))? else {
            return Ok(());
        };
        let (status, kind, body): (_, _, Arc<str>) = if self.loopback && !request.is_to_loopback() {
            // Another site's name for this address would let its pages read the map.
            ("403 Forbidden", "text/plain", Arc::from("only for this machine\n"))
        } else if request.target == "/" {
            ("200 OK", "text/html; charset=utf-8", Arc::from(PAGE))
        } else if request.target == "/state" {
            let now = u64::try_from(self.started.elapsed().as_millis()).unwrap_or(u64::MAX);
            self.asked.store(now.saturating_add(1), Ordering::Relaxed);
            let state = Arc::clone(&self.state.lock().unwrap_or_else(PoisonError::into_inner));
            ("200 OK", "application/json", state)
        } else {
            ("404 Not Found", "text/plain", Arc::from("there is / and /state\n"))
        };
        write!(
            browser,
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n{body}",
            body.len()
        )
    }
}

/// What of a request matters here.
#[derive(Debug, PartialEq)]
struct Request {
    target: String,
    host: String,
}

impl Request {
    /// The head of a request; `None` for what is none.
    fn read(from: &mut impl BufRead) -> io::Result<Option<Self>> {
        let mut lines = from.lines();
        let Some(first) = lines.next().transpose()? else { return Ok(None) };
        let Some(target) = first.strip_prefix("GET ").and_then(|rest| rest.split(' ').next()) else { return Ok(None) };
        let mut request = Self { target: target.to_owned(), host: String::new() };
        for line in lines {
            let line = line?;
            if line.is_empty() {
                return Ok(Some(request));
            }
            if let Some((name, value)) = line.split_once(':')
                && name.eq_ignore_ascii_case("host")
            {
                value.trim().clone_into(&mut request.host);
            }
        }
        Ok(None) // the head never ended
    }

    fn is_to_loopback(&self) -> bool {
        let name = self.host.rsplit_once(':').map_or(self.host.as_str(), |(name, _)| name);
        ["127.0.0.1", "localhost", "[::1]"].contains(&name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<Request> {
        Request::read(&mut text.as_bytes()).unwrap()
    }

    #[test]
    fn requests_are_read_to_the_end_of_their_head() {
        let request = read("GET /state HTTP/1.1\r\nAccept: */*\r\nhost: 127.0.0.1:8000\r\n\r\nrest").unwrap();
        assert_eq!(request, Request { target: "/state".into(), host: "127.0.0.1:8000".into() });
        assert!(request.is_to_loopback());
        for nonsense in ["", "POST / HTTP/1.1\r\n\r\n", "GET / HTTP/1.1\r\nHost: a", "\u{1}\u{2}\r\n\r\n"] {
            assert_eq!(read(nonsense), None, "{nonsense:?}");
        }
    }

    #[test]
    fn other_names_for_this_machine_are_refused() {
        for host in ["evil.example", "evil.example:80", "127.0.0.1.evil.example:80", ""] {
            assert!(!Request { target: "/".into(), host: host.into() }.is_to_loopback(), "{host}");
        }
    }
}
