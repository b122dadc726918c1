//! The user's terminal: what a command says, and the signals that interrupt it.

use std::io::{self, Write};
#[cfg(unix)]
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{process, thread};

use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use serde::Serialize;

/// How often it is asked whether a viewer is there.
const VIEWER_POLL: Duration = Duration::from_millis(20);

/// Exit code of a process ended by SIGINT, as shells have it.
pub const INTERRUPTED_CODE: u8 = 130;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Whether a signal came.
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// From now on SIGINT and SIGTERM end a command after the sweep in hand, and a second one at once:
/// a disk that does not answer may hold up the sweep for ever.
pub fn listen() {
    // Fails where a handler is there already: another run's, which sets the same flag.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            process::exit(INTERRUPTED_CODE.into());
        }
    });
}

/// From now on a file that would grow beyond what the process may write is an error in writing it,
/// not the end of the process.
#[cfg(unix)]
pub fn survive_file_limits() {
    // A signal that cannot be caught ends it as before.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Prints to standard output unless quiet. A reader that has gone away is not an error.
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

/// Tells of what went wrong.
pub fn warn(text: &str) {
    // Nobody is left to tell where standard error is closed.
    let _ = writeln!(io::stderr(), "raywake: {text}");
}

/// Prints what the user should know, a line each.
pub fn note<'a>(quiet: bool, notes: impl IntoIterator<Item = &'a String>) -> Result<(), Error> {
    notes.into_iter().try_for_each(|note| say(quiet, &format!("note: {note}\n")))
}

/// Waits until a viewer sees what is sent to viewers, or a signal comes.
pub fn await_viewer(quiet: bool, sink: Option<&BagSink>) -> Result<(), Error> {
    let is_watched = || sink.is_none_or(BagSink::is_watched);
    if !is_watched() {
        listen();
        say(quiet, "waiting for Foxglove to connect\n")?;
    }
    while !is_watched() && !interrupted() {
        thread::sleep(VIEWER_POLL);
    }
    Ok(())
}

/// Bytes in the unit that suits them.
pub fn bytes(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} B"),
        10_000..1_000_000 => format!("{:.1} kB", bytes as f64 * 1e-3),
        _ => format!("{:.1} MB", bytes as f64 * 1e-6),
    }
}

/// What is to be read by programs, as lines of JSON.
pub fn json(what: &impl Serialize) -> Result<String, Error> {
    let text = serde_json::to_string_pretty(what);
    Ok(text.map_err(|e| Error::Unsupported(format!("no JSON: {e}")))? + "\n")
}
