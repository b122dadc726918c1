//! `raywake completions` and `raywake man`, generated from the declaration of the command line.

use clap::CommandFactory;
use clap_complete::Shell;

use crate::args::Args;
use crate::console::say;
use crate::error::RunError;
use raywake_io::Error;

/// Prints the completion script of a shell.
pub fn completions(shell: Shell) -> Result<(), RunError> {
    let (mut command, mut script) = (Args::command(), Vec::new());
    let name = command.get_name().to_owned();
    clap_complete::generate(shell, &mut command, name, &mut script);
    Ok(say(false, &String::from_utf8_lossy(&script))?)
}

/// Prints the manual page of a command, or of the program. Fails if there is no such command.
pub fn man(of: Option<&str>) -> Result<(), RunError> {
    let mut program = Args::command();
    program.build();
    let command = match of {
        None => program,
        Some(name) => program.find_subcommand(name).cloned().ok_or_else(|| {
            Error::Usage(format!("no command `{name}`; `raywake --help` lists them"))
        })?,
    };
    let mut page = Vec::new();
    // Writing to memory does not fail.
    let _ = clap_mangen::Man::new(command).render(&mut page);
    Ok(say(false, &String::from_utf8_lossy(&page))?)
}
