//! Many recordings, one after another, each with its own results: `--list`.
//!
//! Results of a recording are stored at its path below the output folder. A file [`DONE`] next to
//! them records what they were made with: settings, weights and algorithms, the contents of files
//! that options name, and names and sizes of the recording's files. Later runs, on any machine,
//! leave finished results as they are. A recording that was interrupted is resumed, as without a
//! list; if two processes work on the same one, the later reports an error.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::io::Write;
use std::path::{Component, Path, PathBuf};

use raywake_core::digest::Digest;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_io::source::whole::{self, read_text};

use crate::args::{BackendChoice, FlowChoice, Recording, Recordings, Shard, inputs};
use crate::config;
use crate::console::{interrupted, say, warn};
use crate::error::RunError;
use crate::inventory::inventory;
use crate::settings_file::DONE;
use crate::weight_files::WeightFiles;

/// The digest that `raywake demo` prints. It changes whenever results do, so that earlier results
/// no longer count as done.
pub const DEMO_DIGEST: u64 = 0xb6ec_5050_d30f_6688;

/// Arguments of every command that works on a recording.
pub struct SharedArgs<'a> {
    /// Which recordings.
    pub recordings: &'a mut Recordings,
    /// How they are read.
    pub recording: &'a Recording,
    /// Profile, weights and backend the flow is computed with.
    pub flow: &'a mut FlowChoice,
    /// Whether only errors are printed.
    pub quiet: &'a mut bool,
}

/// Implements `shared` for a struct with fields of these names.
macro_rules! shared_args {
    () => {
        fn shared(&mut self) -> crate::batch::SharedArgs<'_> {
            let Self { recordings, recording, flow, quiet, .. } = self;
            crate::batch::SharedArgs { recordings, recording, flow, quiet }
        }
    };
}
pub(crate) use shared_args;

/// A command that works on a recording.
pub trait RecordingCommand: Clone + Debug {
    /// The command's name.
    const NAME: &'static str;

    /// The arguments that every such command has.
    fn shared(&mut self) -> SharedArgs<'_>;

    /// Where results go, if anywhere.
    fn out(&self) -> Option<&Path>;

    /// Redirects the results.
    fn set_output(&mut self, out: PathBuf);

    /// The option given, if any, that names a single file, which several recordings cannot share.
    fn single_file(&self) -> Option<&'static str>;

    /// A file that the command reads besides recording, poses, settings and weights.
    fn other_input(&self) -> Option<&Path> {
        None
    }

    /// Runs the command on one recording. Returns whether it ran to completion.
    fn execute(&self) -> Result<bool, RunError>;
}

/// A recording, and where its results go below the output folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListedRecording {
    /// The path as listed.
    pub data: PathBuf,
    /// The path without its root: unique in the list even if letter case is ignored.
    pub place: PathBuf,
}

/// Outcomes of the recordings.
#[derive(Default)]
struct Tally {
    done: usize,
    before: usize,
    failures: Vec<RunError>,
}

/// Runs the command on the recording, or on each of the list. Returns whether it ran to completion.
///
/// # Errors
/// The first failure, after all others were tried.
pub fn each<C: RecordingCommand>(command: &C) -> Result<bool, RunError> {
    let mut own = command.clone();
    let SharedArgs { recordings: Recordings { list, shard, .. }, quiet, .. } = own.shared();
    let (shard, quiet) = (*shard, *quiet);
    let Some(list) = list else { return command.execute() };
    if let Some(option) = command.single_file() {
        let what = format!("--{option} is for a single recording and cannot be used with --list");
        return Err(Error::Usage(what).into());
    }
    let shard = shard.map_or_else(Shard::of_environment, Ok)?;
    let all = listed(list)?;
    if let Some(out) = command.out() {
        all.iter().try_for_each(|recording| inputs::outside("out", out, &recording.data))?;
    }
    let (mine, line) = shared(all, shard);
    let seal = seal(command)?;
    say(quiet, &line)?;
    let mut tally = Tally::default();
    for (n, recording) in mine.iter().enumerate() {
        if interrupted() {
            break;
        }
        let line = format!("\n{} of {}: {}\n", n + 1, mine.len(), recording.data.display());
        say(quiet, &line)?;
        if let Some(line) = tally.one(command, recording, &seal) {
            say(quiet, line)?;
        }
    }
    say(quiet, &tally.line())?;
    let whole = tally.done + tally.before + tally.failures.len() == mine.len();
    tally.end().map(|()| whole)
}

/// Returns the recordings of one part of a list, and a line about them.
///
/// # Errors
/// A path in the list does not exist, or the results of two recordings would collide.
pub fn part(list: &Path, shard: Shard) -> Result<(Vec<ListedRecording>, String), Error> {
    Ok(shared(listed(list)?, shard))
}

fn shared(all: Vec<ListedRecording>, shard: Shard) -> (Vec<ListedRecording>, String) {
    let (Shard { index, of }, count) = (shard, all.len());
    let mine: Vec<_> = all.into_iter().skip(index).step_by(of).collect();
    let line = format!("part {index} of {of}: {} of {count} recordings\n", mine.len());
    (mine, line)
}

impl Tally {
    /// Processes one recording. Returns a message about it, if any.
    fn one(
        &mut self,
        command: &impl RecordingCommand,
        at: &ListedRecording,
        seal: &str,
    ) -> Option<&'static str> {
        match finish(&command_for(command, at), &at.data, seal) {
            Ok(Some(true)) => self.done += 1,
            Ok(Some(false)) => {}
            Ok(None) => {
                self.before += 1;
                return Some("already done\n");
            }
            Err(e) => {
                let (text, path) = (e.to_string(), at.data.display().to_string());
                // Most messages name the recording.
                warn(&if text.contains(&path) { text } else { format!("{path}: {text}") });
                self.failures.push(e);
            }
        }
        None
    }

    fn line(&self) -> String {
        let Tally { done, before, failures } = self;
        format!("\n{done} done, {before} already done, {} failed\n", failures.len())
    }

    fn end(self) -> Result<(), RunError> {
        self.failures.into_iter().next().map_or(Ok(()), Err)
    }
}

/// The command for one recording of the list.
fn command_for<C: RecordingCommand>(command: &C, at: &ListedRecording) -> C {
    let mut one = command.clone();
    let out = command.out().map(|out| out.join(&at.place));
    out.into_iter().for_each(|out| one.set_output(out));
    *one.shared().recordings = Recordings::one(at.data.clone());
    one
}

/// Runs the command unless that was done before (`None`). Returns whether it ran to completion.
fn finish(
    command: &impl RecordingCommand,
    data: &Path,
    seal: &str,
) -> Result<Option<bool>, RunError> {
    let Some(out) = command.out() else { return command.execute().map(Some) };
    let done = out.join(DONE);
    let seal = format!("{seal}, {}\n", inventory(data)?);
    if std::fs::read(&done).is_ok_and(|there| there == seal.as_bytes()) {
        return Ok(None);
    }
    let whole =
        inputs::spare("out", out, data).map_err(RunError::from).and_then(|()| command.execute())?;
    if whole {
        atomic::write(&done, |to| to.write_all(seal.as_bytes()))?;
    }
    Ok(Some(whole))
}

/// Identifies what results are made with, apart from the recording: part of a line. Fails if the
/// settings or weights are invalid.
fn seal<C: RecordingCommand>(command: &C) -> Result<String, Error> {
    let mut plain = command.clone();
    plain.set_output(PathBuf::new());
    let SharedArgs { recordings, recording, flow, quiet } = plain.shared();
    let files = [recording.poses.as_deref(), recording.kind.extrinsics.as_deref()];
    let files = files.into_iter().chain([command.other_input()]).flatten().map(content);
    let files: Vec<_> = files.collect::<Result<_, _>>()?;
    // Results are the same on each backend.
    (*recordings, flow.backend, *quiet) = (Recordings::default(), BackendChoice::default(), true);
    let settings = config::settings(&flow.profile)?;
    let weights = WeightFiles::read(&flow.learned, &settings.profile)?.digest();
    let made_with = (&settings.profile, &settings.objects);
    let all = format!("{plain:?} {files:x?} {made_with:?} {weights} {DEMO_DIGEST:016x}");
    let (digest, version) = (Digest::of(all.as_bytes()), env!("CARGO_PKG_VERSION"));
    Ok(format!("raywake {version} {} {digest:016x}", C::NAME))
}

/// Digest of a file's content. `None` if it is no file: `register` instead of poses.
fn content(path: &Path) -> Result<Option<u64>, Error> {
    path.is_file().then(|| whole::read(path).map(|bytes| Digest::of(&bytes))).transpose()
}

/// Recordings of a list: one path per line; empty lines and those that begin with `#` are skipped.
fn listed(list: &Path) -> Result<Vec<ListedRecording>, Error> {
    let text = read_text(list)?;
    let mut places = BTreeMap::new();
    let mut found = Vec::new();
    // Some editors begin a file with a byte order mark.
    for (n, line) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = |what: &str| Error::input(list, format!("line {n}"), format!("{line}: {what}"));
        let data = PathBuf::from(line);
        let place = place(&data).ok_or_else(|| wrong("`..` leads out of the output folder"))?;
        if let Err(e) = data.metadata() {
            return Err(wrong(&e.to_string()));
        }
        // Some file systems ignore case.
        let key = place.display().to_string().to_lowercase();
        if let Some(other) = places.insert(key, n) {
            let what = format!("its results would replace those of line {other}");
            return Err(wrong(&what));
        }
        found.push(ListedRecording { data, place });
    }
    apart(list, &places)?;
    Ok(found)
}

/// Fails if results of one recording would lie within those of another.
fn apart(list: &Path, places: &BTreeMap<String, usize>) -> Result<(), Error> {
    for (place, line) in places {
        for above in Path::new(place).ancestors().skip(1) {
            if let Some(other) = places.get(&above.display().to_string()) {
                let what = format!("its results would lie within those of line {other}");
                return Err(Error::input(list, format!("line {line}"), what));
            }
        }
    }
    Ok(())
}

/// Where results of a recording go: its path without the root. `None` if that leads upwards.
fn place(data: &Path) -> Option<PathBuf> {
    let mut place = PathBuf::new();
    for part in data.components() {
        match part {
            Component::Normal(name) => place.push(name),
            Component::ParentDir => return None,
            Component::CurDir | Component::RootDir | Component::Prefix(_) => {}
        }
    }
    Some(place).filter(|place| place.components().next().is_some())
}

#[cfg(test)]
mod tests;
