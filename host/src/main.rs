#![forbid(unsafe_code)]
//! The command line program; see `raywake --help`.

use std::alloc::System;
use std::io::{Write, stderr};
use std::process::ExitCode;

use clap::Parser;
use raywake::args::{Args, Command};
use raywake::error::Error;
use raywake::summary::Summary;
use raywake::{budget, choose, engine, flow, map, run};
use raywake_gpu::guard::Guard;

/// Exit code of a process ended by SIGINT, as shells have it.
const INTERRUPTED: u8 = 130;

#[global_allocator]
static ALLOCATOR: Guard<System> = Guard(System);

fn main() -> ExitCode {
    let code = match execute(Args::parse().command) {
        Ok(code) => code,
        Err(e) => {
            // Nobody is left to tell where standard error is closed.
            let _ = writeln!(stderr(), "raywake: {e}");
            e.exit_code()
        }
    };
    ExitCode::from(code)
}

fn execute(command: Command) -> Result<u8, Error> {
    match command {
        Command::Run(args) => run::run(&args).map(code),
        Command::Flow(args) => flow::flow(&args).map(|()| 0),
        Command::Map(args) => {
            map::command::map(&args).map(|whole| if whole { 0 } else { INTERRUPTED })
        }
        #[cfg(feature = "demo")]
        Command::Demo(args) => raywake::demo::demo(&args).map(code),
        Command::Budget(args) => budget::budget(&args).map(|()| 0),
        Command::Devices => engine::say(false, &choose::list_devices()?).map(|()| 0),
    }
}

fn code(summary: Summary) -> u8 {
    if summary.interrupted { INTERRUPTED } else { 0 }
}
