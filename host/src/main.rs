#![forbid(unsafe_code)]
//! The command line program; see `raywake --help`.

use std::alloc::System;
use std::io::{Write, stderr};
use std::process::ExitCode;
use std::thread;

use clap::Parser;
use raywake::args::{Args, Command};
use raywake::error::RunError;
use raywake::summary::Summary;
use raywake::{budget, choose, engine, flow, map, run, team, track};
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
        Ok(code) => code,
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

fn execute(command: Command) -> Result<u8, RunError> {
    match command {
        Command::Run(args) => run::run(&args).map(code),
        Command::Flow(args) => flow::flow(&args).map(|()| 0),
        Command::Track(args) => {
            track::track(&args).map(|whole| if whole { 0 } else { INTERRUPTED })
        }
        Command::Map(args) => {
            map::command::map(&args).map(|whole| if whole { 0 } else { INTERRUPTED })
        }
        #[cfg(feature = "demo")]
        Command::Demo(args) => raywake::demo::demo(&args).map(code),
        Command::Budget(args) => budget::budget(&args).map(|()| 0),
        Command::Devices => Ok(engine::say(false, &choose::list_devices()?).map(|()| 0)?),
    }
}

fn code(summary: Summary) -> u8 {
    if summary.interrupted { INTERRUPTED } else { 0 }
}
