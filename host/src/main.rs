#![forbid(unsafe_code)]
//! The command line program; see `raywake --help`.

use std::alloc::System;
use std::io::{Write, stderr};
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;
use raywake::args::Args;
use raywake::{execute, team};
use raywake_alloc_guard::Guard;

/// Ends with what clap says, or with the command for a recording that stands where one is missing.
fn explain(e: &clap::Error) -> ! {
    let first = std::env::args_os().nth(1).filter(|first| Path::new(first).exists());
    if let Some(path) = first.filter(|_| e.kind() == ErrorKind::InvalidSubcommand) {
        let path = Path::new(&path).display();
        // Nobody is left to tell where standard error is closed.
        let _ = writeln!(
            stderr(),
            "raywake: a command is missing; to see what moves in it:\n\n    \
             raywake run {path} --out results --png\n"
        );
        std::process::exit(e.exit_code());
    }
    e.exit()
}

/// A decoder that panics has met a damaged file, and that is what is told. Where panics do not
/// unwind, it is the end.
#[cfg(feature = "parquet")]
fn tell_of_damaged_files() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| match raywake_io::source::decoder::damaged() {
        Some(e) if cfg!(panic = "abort") => {
            let _ = writeln!(stderr(), "raywake: {e}");
            std::process::exit(e.exit_code().into());
        }
        Some(_) => {}
        None => usual(panic),
    }));
}

/// Exit code of a process ended by SIGINT, as shells have it.
const INTERRUPTED: u8 = 130;

#[global_allocator]
static ALLOCATOR: Guard<System> = Guard(System);

fn main() -> ExitCode {
    #[cfg(feature = "parquet")]
    tell_of_damaged_files();
    let command = Args::try_parse().unwrap_or_else(|e| explain(&e)).command;
    match team::lead(team::available(), || execute(command)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(INTERRUPTED),
        Err(e) => {
            // Nobody is left to tell where standard error is closed.
            let _ = writeln!(stderr(), "raywake: {e}");
            ExitCode::from(e.exit_code())
        }
    }
}
