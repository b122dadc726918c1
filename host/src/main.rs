#![forbid(unsafe_code)]
//! The command line program; see `raywake --help`.

use std::alloc::System;
use std::io::{Write, stderr};
use std::process::ExitCode;
use std::thread;

use clap::Parser;
use raywake::args::Args;
use raywake::{execute, team};
use raywake_alloc_guard::Guard;

/// Exit code of a process ended by SIGINT, as shells have it.
const INTERRUPTED: u8 = 130;

#[global_allocator]
static ALLOCATOR: Guard<System> = Guard(System);

/// The pipeline is made on the stack before it moves to the heap, and is larger than the main
/// thread's on most systems.
const STACK: usize = 64 << 20;

fn main() -> ExitCode {
    let command = Args::parse().command;
    let work = || match team::lead(team::available(), || execute(command)) {
        Ok(true) => 0,
        Ok(false) => INTERRUPTED,
        Err(e) => {
            // Nobody is left to tell where standard error is closed.
            let _ = writeln!(stderr(), "raywake: {e}");
            e.exit_code()
        }
    };
    let worker = thread::Builder::new().stack_size(STACK).spawn(work);
    let code = worker.expect("the system has threads").join();
    // A panic has said what it had to say; 101 is what Rust ends with.
    ExitCode::from(code.unwrap_or(101))
}
