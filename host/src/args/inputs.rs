//! Protection of inputs from being overwritten by outputs.

use std::any::TypeId;
use std::path::{Component, Path, PathBuf};

use clap::{ArgMatches, Command, CommandFactory};
use raywake_io::Error;

use super::Args;
use crate::settings_file;

/// Arguments for files and folders that are written; all other path arguments are read.
const OUTPUTS: [&str; 6] = ["out", "summary", "film", "page", "mcap", "png"];

/// Fails if an output of a command is one of its inputs, or would replace a file of a recording.
pub fn protect(matches: &ArgMatches) -> Result<(), Error> {
    let Some((name, matches)) = matches.subcommand() else { return Ok(()) };
    let program = Args::command();
    let command = program.find_subcommand(name);
    let given = |id| matches.get_raw(id).into_iter().flatten().map(Path::new);
    let given =
        command.into_iter().flat_map(paths).flat_map(|id| given(id).map(move |at| (id, at)));
    let (outputs, inputs): (Vec<_>, Vec<_>) = given.partition(|(id, _)| OUTPUTS.contains(id));
    for (n, (id, output)) in outputs.iter().enumerate() {
        inputs.iter().try_for_each(|(_, input)| spare(id, output, input))?;
        outputs[..n].iter().try_for_each(|other| apart(other, (id, output)))?;
    }
    Ok(())
}

/// Fails if two outputs are the same.
fn apart((first, place): &(&str, &Path), (second, other): (&str, &Path)) -> Result<(), Error> {
    match resolved(place) == resolved(other) {
        true => Err(Error::Usage(format!("--{first} and --{second} are both {}", other.display()))),
        false => Ok(()),
    }
}

/// Fails if the output of an option is the input, or would replace a file of it.
pub fn spare(option: &str, output: &Path, input: &Path) -> Result<(), Error> {
    let input = input.canonicalize().ok();
    let harm = input.and_then(|input| harm(&resolved(output), &input));
    harm.map_or(Ok(()), |what| {
        let place = output.display();
        Err(Error::Usage(format!("--{option} {place} {what}: choose another path")))
    })
}

/// Fails if the output is inside the input: results would count as files of the recording, which
/// would never be done.
pub fn outside(option: &str, output: &Path, input: &Path) -> Result<(), Error> {
    if input.canonicalize().is_ok_and(|input| resolved(output).starts_with(input)) {
        let (output, input) = (output.display(), input.display());
        let what = format!("--{option} {output} is inside {input}: choose another path");
        return Err(Error::Usage(what));
    }
    Ok(())
}

/// Names of a command's arguments that are paths.
fn paths(command: &Command) -> impl Iterator<Item = &str> {
    let is_path = |arg: &&clap::Arg| arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
    command.get_arguments().filter(is_path).map(|arg| arg.get_id().as_str())
}

/// The path an output would have, with links resolved as far as it exists.
fn resolved(output: &Path) -> PathBuf {
    let known = output.ancestors().find_map(|part| {
        let here = if part.as_os_str().is_empty() { Path::new(".") } else { part };
        let mut path = here.canonicalize().ok()?;
        // Not joined at once: joining an empty path would append a slash.
        for name in output.strip_prefix(part).ok()?.components() {
            match name {
                Component::ParentDir => drop(path.pop()),
                name => path.push(name),
            }
        }
        Some(path)
    });
    known.unwrap_or_else(|| output.to_path_buf())
}

/// What an output does to an input, if it does harm. Results may be written inside a recording, to
/// a folder that is new, empty or already holds results.
fn harm(output: &Path, input: &Path) -> Option<&'static str> {
    if output == input {
        return Some("is an input, which would be overwritten");
    }
    if !output.starts_with(input) {
        return None;
    }
    let is_empty = |folder: &Path| folder.read_dir().is_ok_and(|mut list| list.next().is_none());
    let of_results = |folder: &Path| is_empty(folder) || folder.join(settings_file::NAME).is_file();
    match output {
        output if output.is_file() => Some("is already in the recording"),
        output if output.is_dir() && !of_results(output) => Some("is a folder of the recording"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn outputs_that_do_not_exist_yet() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("drive");
        std::fs::create_dir(&input).unwrap();
        let place = |path: &str| folder.path().join(path);
        for inside in ["drive", "drive/a/b", "new/../drive/a", "new/a/../../drive/./a"] {
            assert!(outside("out", &place(inside), &input).is_err(), "{inside}");
        }
        for apart in ["", "new", "drives/a", "drive/../a", "new/../a/drive"] {
            assert!(outside("out", &place(apart), &input).is_ok(), "{apart}");
        }
    }

    #[test]
    fn every_path_is_known_as_read_or_written() {
        let program = Args::command();
        let all: BTreeSet<&str> = program.get_subcommands().flat_map(paths).collect();
        let read: BTreeSet<&str> = [
            "config",
            "constancy",
            "data",
            "encoder",
            "extrinsics",
            "filter",
            "first",
            "ground_map",
            "list",
            #[cfg(feature = "pcap")]
            "metadata",
            "moves",
            "pose",
            "poses",
            #[cfg(feature = "pcap")]
            "replay",
            "second",
        ]
        .into();
        assert_eq!(all, read.union(&OUTPUTS.into()).copied().collect());
    }
}
