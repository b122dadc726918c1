//! The user's terminal: what a command prints, and the signals that interrupt it.

use std::fmt;
use std::io::{self, Write};
#[cfg(unix)]
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{process, thread};

use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use serde::Serialize;

/// How often to check for a viewer.
const VIEWER_POLL: Duration = Duration::from_millis(20);

/// Exit code of a process ended by SIGINT, by shell convention.
pub const INTERRUPTED_CODE: u8 = 130;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Returns whether a signal has been received.
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// From now on SIGINT and SIGTERM end a command after the current sweep, and a second signal ends
/// it at once: a disk that does not respond may block the sweep forever.
pub fn listen() {
    // Fails if a handler is already installed: another run's, which sets the same flag.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            process::exit(INTERRUPTED_CODE.into());
        }
    });
}

/// From now on a file that would exceed the process's file size limit is a write error, not the end
/// of the process.
#[cfg(unix)]
pub fn survive_file_limits() {
    // If the signal cannot be caught, it ends the process as before.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Prints to standard output unless quiet. A closed pipe is not an error.
pub fn say(quiet: bool, text: &str) -> Result<(), Error> {
    if quiet {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: "standard output".into(), source: e })
        }
        _ => Ok(()),
    }
}

/// Reports a problem on standard error.
pub fn warn(text: &str) {
    // If standard error is closed, nobody is left to report to.
    let _ = writeln!(io::stderr(), "raywake: {text}");
}

/// Prints notes to the user, one per line.
pub fn note<'a>(quiet: bool, notes: impl IntoIterator<Item = &'a String>) -> Result<(), Error> {
    notes.into_iter().try_for_each(|note| say(quiet, &format!("note: {note}\n")))
}

/// Waits until a viewer has connected, or a signal is received.
pub fn await_viewer(quiet: bool, sink: Option<&BagSink>) -> Result<(), Error> {
    let has_viewer = || sink.is_none_or(BagSink::has_viewer);
    if !has_viewer() {
        listen();
        say(quiet, "waiting for Foxglove to connect\n")?;
    }
    while !has_viewer() && !interrupted() {
        thread::sleep(VIEWER_POLL);
    }
    Ok(())
}

/// Formats bytes in a suitable unit, without allocating.
pub fn bytes(bytes: u64) -> impl fmt::Display {
    fmt::from_fn(move |f| match bytes {
        0..10_000 => write!(f, "{bytes} B"),
        10_000..1_000_000 => write!(f, "{:.1} kB", bytes as f64 * 1e-3),
        _ => write!(f, "{:.1} MB", bytes as f64 * 1e-6),
    })
}

/// Formats output for programs as pretty-printed JSON.
pub fn json(what: &impl Serialize) -> Result<String, Error> {
    let text = serde_json::to_string_pretty(what);
    Ok(text
        .map_err(|e| Error::Unsupported(format!("the result cannot be written as JSON: {e}")))?
        + "\n")
}
