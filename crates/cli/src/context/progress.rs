use std::cell::Cell;
use std::io::Write;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle as BarStyle};

use crate::args::ProgressStyle;

/// Shows the stages of the work on standard error, one line each.
#[derive(Debug)]
pub(crate) struct Progress {
    style: ProgressStyle,
    bars: MultiProgress,
}

/// One stage of the work; dropping it ends it.
#[derive(Debug)]
pub(crate) struct Stage<'a> {
    progress: &'a Progress,
    name: String,
    total: u64,
    /// Whether its steps are bytes.
    bytes: bool,
    bar: Option<ProgressBar>,
    tenths: Cell<u64>,
    started: Instant,
    finished: Cell<bool>,
}

impl Progress {
    pub(crate) fn new(style: ProgressStyle) -> Self {
        Self { style, bars: MultiProgress::new() }
    }

    /// Starts the stage `name` of `total` steps; 0 where their number is not known.
    pub(crate) fn stage(&self, name: &str, total: u64) -> Stage<'_> {
        let bar = (self.style == ProgressStyle::Auto).then(|| self.bar(name, total));
        let (tenths, started, finished) = (Cell::new(0), Instant::now(), Cell::new(false));
        Stage { progress: self, name: name.to_owned(), total, bytes: false, bar, tenths, started, finished }
    }

    /// Starts the stage `name`, whose steps are bytes of a file; `None` where their number is not known.
    pub(crate) fn reading(&self, name: &str, size: Option<u64>) -> Stage<'_> {
        let mut stage = self.stage(name, size.unwrap_or(0));
        if let (Some(bar), Some(_)) = (&stage.bar, size) {
            bar.set_style(style(
                "  {prefix:<10} {bar:20} {decimal_bytes} of {decimal_total_bytes} · {wide_msg} {eta} left",
            ));
        }
        stage.bytes = size.is_some();
        stage
    }

    /// Writes a line of its own, above any bar.
    pub(crate) fn line(&self, text: &str) {
        self.bars.suspend(|| {
            // Nobody is left to be told when standard error is gone.
            let _ = writeln!(std::io::stderr(), "{text}");
        });
    }

    fn bar(&self, name: &str, total: u64) -> ProgressBar {
        let template = if total > 0 {
            "  {prefix:<10} {bar:24} {msg} {elapsed}"
        } else {
            "  {prefix:<10} {spinner} {msg} {elapsed}"
        };
        let bar = self.bars.add(ProgressBar::new(total).with_style(style(template)).with_prefix(name.to_owned()));
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}

fn style(template: &str) -> BarStyle {
    BarStyle::with_template(template).unwrap_or_else(|_| BarStyle::default_bar()).progress_chars("━╸ ")
}

impl Stage<'_> {
    /// So many steps are done; `message` says what that means, and is made only when it is shown.
    pub(crate) fn at(&self, done: u64, message: impl FnOnce() -> String) {
        if let Some(bar) = &self.bar {
            bar.set_position(done);
            bar.set_message(message());
            return;
        }
        let tenth = (10 * done).checked_div(self.total).unwrap_or(0);
        if tenth > self.tenths.replace(tenth) && !self.finished.get() {
            self.tell(10 * tenth, &message(), Some(done).filter(|_| self.bytes));
        }
    }

    /// The stage is over; its line stays, with the time it took.
    pub(crate) fn finish(self, message: &str) {
        self.finished.set(true);
        match &self.bar {
            Some(bar) => {
                bar.finish_and_clear();
                let seconds = self.started.elapsed().as_secs_f64();
                self.progress.line(&format!("  {:<10} {message:<60} {seconds:>6.1} s", self.name));
            }
            None => self.tell(100, message, Some(self.total).filter(|_| self.bytes)),
        }
    }

    fn tell(&self, percent: u64, message: &str, bytes: Option<u64>) {
        match self.progress.style {
            ProgressStyle::Plain => {
                let bytes = bytes.map_or_else(String::new, |bytes| self.megabytes(bytes));
                self.progress.line(&format!("{}: {percent} % {bytes}{message}", self.name));
            }
            ProgressStyle::Json => {
                let mut document = serde_json::json!({ "stage": self.name, "percent": percent, "message": message });
                if let Some(bytes) = bytes {
                    document["bytes"] = bytes.into();
                    document["of_bytes"] = self.total.into();
                    document["eta_s"] = self.seconds_left(bytes).into();
                }
                self.progress.line(&document.to_string());
            }
            ProgressStyle::Auto | ProgressStyle::None => {}
        }
    }
}

impl Stage<'_> {
    /// How long the rest takes if it goes on like this, in seconds rounded to tenths.
    fn seconds_left(&self, done: u64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a share of a file")]
        let left = self.total.saturating_sub(done) as f64 / done.max(1) as f64;
        (self.started.elapsed().as_secs_f64() * left * 10.0).round() / 10.0
    }

    /// How much is done of how much, and how long the rest takes.
    fn megabytes(&self, done: u64) -> String {
        #[expect(clippy::cast_precision_loss, reason = "megabytes with one digit")]
        let [done_mb, all] = [done, self.total].map(|bytes| bytes as f64 / 1e6);
        let left = self.seconds_left(done);
        let eta = if left > 0.0 { format!(", {left:.0} s left") } else { String::new() };
        format!("{done_mb:.1} of {all:.1} MB{eta} · ")
    }
}

impl Drop for Stage<'_> {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.as_ref().filter(|_| !self.finished.get()) {
            bar.finish_and_clear();
        }
    }
}
