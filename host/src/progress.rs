//! The progress of a run, on standard error.

use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

/// Time between updates of the line on a terminal.
const ON_TERMINAL: Duration = Duration::from_millis(200);
/// Time between lines of a log.
const IN_LOG: Duration = Duration::from_secs(5);

/// A progress line, kept up to date on a terminal and repeated now and then in a log.
pub struct Progress {
    what: &'static str,
    total: usize,
    started: Instant,
    shown: Option<Instant>,
    terminal: bool,
    quiet: bool,
}

impl Progress {
    /// Starts the clock of a run over `total` items; `what` names one of them.
    pub fn new(what: &'static str, total: usize, quiet: bool) -> Progress {
        let started = Instant::now();
        Progress { what, total, started, shown: None, terminal: stderr().is_terminal(), quiet }
    }

    /// Reports the number done. Shown if the last update is old enough, or this is the last one.
    pub fn update(&mut self, done: usize) {
        let now = Instant::now();
        let pause = if self.terminal { ON_TERMINAL } else { IN_LOG };
        let due = now - self.shown.unwrap_or(self.started) >= pause;
        if self.quiet || !(due || done == self.total && self.terminal) {
            return;
        }
        self.shown = Some(now);
        let text = line(self.what, done, self.total, (now - self.started).as_secs_f64());
        // Failure to show progress does not affect the run.
        let _ = match self.terminal {
            true => write!(stderr(), "\r{text}\x1b[K"),
            false => writeln!(stderr(), "{text}"),
        };
        let _ = stderr().flush();
    }

    /// Clears the line.
    pub fn finish(&self) {
        if self.terminal && self.shown.is_some() {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

/// `sweep 12/154, 24.8 sweeps/s, 6 s left`.
fn line(what: &str, done: usize, total: usize, elapsed_s: f64) -> String {
    let rate = done as f64 / elapsed_s.max(1e-3);
    let left_s = (total - done.min(total)) as f64 / rate.max(1e-9);
    let left = match left_s.round() as u64 {
        s @ 0..100 => format!("{s} s"),
        s @ 100..6000 => format!("{} min", s.div_ceil(60)),
        s => format!("{} h", s.div_ceil(3600)),
    };
    format!("{what} {done}/{total}, {rate:.1} {what}s/s, {left} left")
}

#[cfg(test)]
mod tests {
    use super::line;

    #[test]
    fn lines() {
        assert_eq!(line("sweep", 10, 20, 2.0), "sweep 10/20, 5.0 sweeps/s, 2 s left");
        assert_eq!(line("track", 1, 1000, 1.0), "track 1/1000, 1.0 tracks/s, 17 min left");
        assert_eq!(line("sweep", 20, 20, 0.0), "sweep 20/20, 20000.0 sweeps/s, 0 s left");
    }
}
