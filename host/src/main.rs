#![forbid(unsafe_code)]
//! The command line program; see `raywake --help`.

use std::alloc::System;
use std::io::{Write, stderr};
use std::process::ExitCode;

use clap::Parser;
use raywake::args::Args;
use raywake::{execute, team};
use raywake_alloc_guard::Guard;

/// Exit code of a process ended by SIGINT, as shells have it.
const INTERRUPTED: u8 = 130;

#[global_allocator]
static ALLOCATOR: Guard<System> = Guard(System);

fn main() -> ExitCode {
    let command = Args::parse().command;
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
