#![forbid(unsafe_code)]
//! The command line program; see `raywake --help`.

use std::alloc::System;
use std::path::Path;
use std::process::ExitCode;

use clap::CommandFactory;
use clap::error::ErrorKind;
use raywake::args::Args;
use raywake::console::warn;
use raywake_alloc_guard::{Guard, OnRefusal};

/// Exits with clap's message or, if a recording was given without a command, with a suggested
/// command.
fn explain(e: &clap::Error) -> ! {
    let first = std::env::args_os().nth(1).filter(|first| Path::new(first).exists());
    if let Some(path) = first.filter(|_| e.kind() == ErrorKind::InvalidSubcommand) {
        let path = Path::new(&path).display();
        warn(&format!(
            "a command is missing; to see what moves in this recording:\n\n    \
             raywake run {path} --out results --png\n"
        ));
        std::process::exit(e.exit_code());
    }
    e.exit()
}

/// Reports a panic in a decoder as a damaged file, and exits if panics do not unwind.
#[cfg(any(feature = "arrow", feature = "mcap"))]
fn report_damaged_files() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| match raywake_io::source::decoder::damaged() {
        Some(e) if cfg!(panic = "abort") => {
            warn(&e.to_string());
            std::process::exit(e.exit_code().into());
        }
        Some(_) => {}
        None => usual(panic),
    }));
}

#[global_allocator]
static ALLOCATOR: Guard<OnRefusal<System>> = Guard(OnRefusal(System, raywake::memory::end));

fn main() -> ExitCode {
    #[cfg(any(feature = "arrow", feature = "mcap"))]
    report_damaged_files();
    #[cfg(unix)]
    raywake::console::survive_file_limits();
    let args = Args::command().try_get_matches().unwrap_or_else(|e| explain(&e));
    ExitCode::from(raywake::run_command_line(&args).unwrap_or_else(|e| explain(&e)))
}
