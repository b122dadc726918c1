//! `settings.toml` next to results: what they were made with, in the form `--config` takes (the
//! parameters of `raywake map` are fixed).
//!
//! It keeps results of different settings or recordings from being mixed: a folder that has one
//! accepts only results that would write an identical one.

use std::fmt::Write;
use std::fs;
use std::io::{ErrorKind, Write as _};
use std::path::Path;

use raywake_core::digest::Digest;
use raywake_core::params::{Parameters, Profile, Value};
use raywake_io::Error;
use raywake_io::sink::atomic::{self, FolderClaim};
use raywake_io::source::Overview;
use raywake_io::source::whole::read_settings;
use raywake_objects::params::TrackingParams;

/// Name of the file.
pub const NAME: &str = "settings.toml";
/// Name of the file next to complete results, see [`crate::batch`].
pub const DONE: &str = "done";
/// Maximum number of differences listed in an error.
const DIFFERENCES_LISTED_MAX: usize = 3;

/// What results are made with.
pub struct ResultSettings<'a> {
    /// The command that makes them.
    pub command: &'static str,
    /// The recording.
    pub recording: &'a Overview,
    /// Index of the first sweep, from which knowledge of movers accumulates.
    pub first: usize,
    /// Parameters of the flow or the map.
    pub profile: &'a Profile,
    /// Tracking parameters, if objects are tracked.
    pub objects: Option<&'a TrackingParams>,
    /// Digest of the model weights, or a placeholder.
    pub weights: &'a str,
    /// Whatever else the results depend on, in one line.
    pub others: &'a str,
}

impl ResultSettings<'_> {
    /// Writes the file into the output folder, if there is one, and keeps other processes from
    /// writing there while the returned value lives. From then on, what is there is not complete.
    ///
    /// # Errors
    /// If the folder has something that is no result, or results of another recording or other
    /// settings, if another process is writing to it, or if the file cannot be written.
    pub fn claim(&self, root: Option<&Path>) -> Result<Option<FolderClaim>, Error> {
        let Some(root) = root else { return Ok(None) };
        let claim = atomic::claim_folder(root)?;
        let (path, text) = (root.join(NAME), self.text());
        match path.is_file() {
            true => match read_settings(&path)? {
                there if there == text => begin_again(root)?,
                there => return Err(different(root, &there, &text)),
            },
            false => {
                unused(root)?;
                atomic::write(&path, |out| out.write_all(text.as_bytes()))?;
            }
        }
        Ok(Some(claim))
    }

    /// Identifies the sensors, stamps and poses of the recording.
    fn digest(&self) -> u64 {
        let Overview { rig, frames, track, trusted, .. } = self.recording;
        Digest::of(format!("{rig:?} {frames:?} {track:?} {trusted}").as_bytes())
    }

    fn text(&self) -> String {
        let ResultSettings { command, recording, first, profile, objects, weights, others } = self;
        let Overview { name, rig, frames, .. } = recording;
        let poses = if recording.track.poses.is_empty() { "none" } else { "of the recording" };
        let own = rig.own_vehicle.map_or("none".into(), |own| format!("{own:?} m"));
        let mut text = format!(
            "# raywake {} {command}, model weights {weights}\n\
             # {name:?}: {} sweeps from frame {}, from the sweep with index {first} on\n\
             # sensors, stamps and poses {:016x}; {others}\n\
             # poses: {poses}; ground at {:?} m; deskew {}; box of the own vehicle: {own}\n\
             base = \"hdl64\"\nname = {:?}\n",
            env!("CARGO_PKG_VERSION"),
            frames.len(),
            frames[0],
            self.digest(),
            rig.ground_m,
            rig.distorted,
            profile.name.as_str(),
        );
        for (group, parameters) in profile.groups() {
            add(&mut text, group, parameters);
        }
        if let Some(objects) = objects {
            let mut objects = **objects;
            objects.each(&mut |group, parameters| {
                add(&mut text, &format!("objects.{group}"), parameters);
            });
        }
        text
    }
}

/// Fails if a folder has anything, other than hidden files: results would be mixed with it, or
/// replace it.
fn unused(root: &Path) -> Result<(), Error> {
    let entries = root.read_dir().map_err(Error::reading(root))?;
    let mut names = entries.filter_map(|entry| Some(entry.ok()?.file_name().display().to_string()));
    names.find(|name| !name.starts_with('.')).map_or(Ok(()), |name| {
        let what = format!("has `{name}`, but no results: choose a folder that is new or empty");
        Err(Error::Usage(format!("{} {what}", root.display())))
    })
}

/// Results that are continued are no longer complete.
fn begin_again(root: &Path) -> Result<(), Error> {
    match fs::remove_file(root.join(DONE)) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::writing(&root.join(DONE))(e)),
        _ => Ok(()),
    }
}

/// The error that a folder has other results, with the first differing lines.
fn different(root: &Path, there: &str, here: &str) -> Error {
    let lines = there.lines().zip(here.lines());
    let listed = lines.filter(|(a, b)| a != b).take(DIFFERENCES_LISTED_MAX);
    let listed: Vec<String> = listed.map(|(a, b)| format!("`{a}`, not `{b}`")).collect();
    Error::Usage(format!(
        "{} holds other results: its {NAME} has {}; choose another folder, or delete this one",
        root.display(),
        listed.join(", ")
    ))
}

/// Appends a group of parameters as a table with its name.
fn add(text: &mut String, group: &str, parameters: &dyn Parameters) {
    if !group.is_empty() {
        let _ = write!(text, "\n[{group}]\n");
    }
    for parameter in parameters.declared() {
        let value = match parameters.get(parameter.name) {
            Some(Value::Number(v)) => format!("{v:?}"),
            Some(Value::Single(v)) => format!("{v:?}"),
            Some(Value::Whole(v)) => v.to_string(),
            Some(Value::Flag(v)) => v.to_string(),
            Some(Value::Word(v)) => format!("\"{v}\""),
            None => continue,
        };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} = {value}", parameter.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::ProfileChoice;
    use crate::config;
    use raywake_core::pose::Pose;
    use raywake_core::sweep::{Rig, Timing};
    use raywake_io::source::PoseTrack;

    fn recording() -> Overview {
        Overview {
            name: "a drive".into(),
            rig: Rig {
                sensors: core::iter::once(Pose::IDENTITY).collect(),
                timing: Timing::AtStamp,
                distorted: true,
                ground_m: -1.73,
                own_vehicle: None,
            },
            frames: vec![3, 4],
            track: PoseTrack::default(),
            epoch_ns: 0,
            trusted: false,
            notes: Vec::new(),
        }
    }

    #[test]
    fn written_settings_round_trip() {
        let (folder, recording) = (tempfile::tempdir().unwrap(), recording());
        let mut objects = TrackingParams::DEFAULT;
        objects.front_end.link_m = 0.1 + 0.2;
        for profile in &Profile::shipped() {
            let root = folder.path().join(profile.name.as_str());
            let (objects, weights) = (Some(&objects), "0");
            let made = ResultSettings {
                command: "track",
                recording: &recording,
                first: 0,
                profile,
                objects,
                weights,
                others: "nothing else",
            };
            made.claim(Some(&root)).unwrap();
            let choice = ProfileChoice { config: Some(root.join(NAME)), ..Default::default() };
            let settings = config::settings(&choice).unwrap();
            assert_eq!((&settings.profile, Some(&settings.objects)), (profile, objects));
        }
    }

    #[test]
    fn results_are_not_mixed() {
        let (folder, recording) = (tempfile::tempdir().unwrap(), recording());
        let profile = &Profile::hdl64();
        let made = |first, weights| {
            let made = ResultSettings {
                command: "run",
                recording: &recording,
                first,
                profile,
                objects: None,
                weights,
                others: "nothing else",
            };
            made.claim(Some(folder.path())).map(|_| ()).map_err(|e| e.to_string())
        };
        assert_eq!((made(0, "0"), made(0, "0")), (Ok(()), Ok(())));
        let e = made(1, "0").unwrap_err();
        assert!(e.contains("with index 0 on`, not `") && e.contains("index 1"), "{e}");
        assert!(made(0, "1").unwrap_err().contains("holds other results"));
    }
}
