//! Lists of recordings.

use super::*;
use std::fs;

fn list_of(lines: &[&str]) -> Result<Vec<PathBuf>, String> {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a", "A", "a/b", "c"] {
        fs::create_dir_all(folder.path().join(name)).unwrap();
    }
    let root = folder.path().display().to_string();
    let text: Vec<String> = lines.iter().map(|line| line.replace("ROOT", &root)).collect();
    let list = folder.path().join("list");
    fs::write(&list, text.join("\n")).unwrap();
    let relative = root.trim_start_matches('/').to_string();
    let listed = listed(&list).map_err(|e| e.to_string())?;
    let place = |r: ListedRecording| r.place.strip_prefix(&relative).map(Path::to_path_buf);
    Ok(listed.into_iter().map(|r| place(r).unwrap()).collect())
}

#[test]
fn lists() {
    let found = list_of(&["\u{feff}# both", "ROOT/a", "", "  ROOT/./c/\r"]).unwrap();
    assert_eq!(found, [PathBuf::from("a"), PathBuf::from("c")]);
    assert_eq!(list_of(&["# none"]), Ok(Vec::new()));
    for (lines, words) in [
        (&["ROOT/a", "ROOT/missing"][..], "line 2: "),
        (&["ROOT/a", "ROOT/a/"][..], "replace those of line 1"),
        (&["ROOT/a", "ROOT/A"][..], "replace those of line 1"),
        (&["ROOT/a/b", "ROOT/a"][..], "within those of line 2"),
        (&["ROOT/a/../c"][..], "leads out"),
        (&["/"][..], "leads out"),
    ] {
        let e = list_of(lines).unwrap_err();
        assert!(e.contains(words), "{e}");
    }
}

/// Records each call; fails if the recording is called `c`.
#[derive(Clone, Debug)]
struct Noted {
    recordings: Recordings,
    recording: Recording,
    flow: FlowChoice,
    out: Option<PathBuf>,
    quiet: bool,
}

impl RecordingCommand for Noted {
    const NAME: &'static str = "note";

    shared_args!();

    fn out(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn set_output(&mut self, out: PathBuf) {
        self.out = Some(out);
    }

    fn single_file(&self) -> Option<&'static str> {
        None
    }

    fn execute(&self) -> Result<bool, RunError> {
        let out = self.out.clone().unwrap();
        fs::create_dir_all(&out).unwrap();
        fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(out.join("times"))
            .and_then(|mut file| file.write_all(b"x"))
            .unwrap();
        match self.recordings.path().ends_with("c") {
            true => Err(Error::input(self.recordings.path(), "", "is no recording").into()),
            false => Ok(true),
        }
    }
}

#[test]
fn each_is_tried_exactly_once() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["a", "b", "c", "d", "e"].map(|name| folder.path().join(name));
    names.iter().for_each(|name| fs::create_dir(name).unwrap());
    let list = folder.path().join("list");
    let text: Vec<String> = names.iter().map(|name| name.display().to_string()).collect();
    fs::write(&list, text.join("\n")).unwrap();
    let mut command = Noted {
        recordings: Recordings { list: Some(list), ..Recordings::default() },
        recording: Recording::default(),
        flow: FlowChoice::default(),
        out: Some(folder.path().join("out")),
        quiet: true,
    };
    let times = |name: &Path| {
        let below = folder.path().join("out").join(place(name).unwrap());
        fs::read(below.join("times")).map_or(0, |text| text.len())
    };
    for index in [0, 1, 1] {
        command.recordings.shard = Some(Shard { index, of: 2 });
        let ended = each(&command);
        assert_eq!(ended.is_err(), index == 0, "{ended:?}");
    }
    assert_eq!(names.clone().map(|name| times(&name)), [1, 1, 1, 1, 1]);
    command.recordings.shard = Some(Shard { index: 900, of: 1000 });
    assert!(matches!(each(&command), Ok(true)));
    // Other settings are new work; failures are tried again.
    command.recordings.shard = None;
    command.flow.profile.moving = Some(0.4);
    assert_eq!(each(&command).unwrap_err().exit_code(), 3);
    command.flow.backend.simd = Some(raywake_simd::Simd::BASELINE);
    assert!(each(&command).is_err());
    assert_eq!(names.clone().map(|name| times(&name)), [2, 2, 3, 2, 2]);
    // So is a recording that has changed,
    fs::write(names[0].join("more"), "x").unwrap();
    assert!(each(&command).is_err());
    assert_eq!(names.clone().map(|name| times(&name)), [3, 2, 4, 2, 2]);
    // and a file that an option names.
    let poses = folder.path().join("poses.txt");
    command.recording.poses = Some(poses.clone());
    for (content, expected) in
        [("1", [4, 3, 5, 3, 3]), ("1", [4, 3, 6, 3, 3]), ("2", [5, 4, 7, 4, 4])]
    {
        fs::write(&poses, content).unwrap();
        assert!(each(&command).is_err());
        assert_eq!(names.clone().map(|name| times(&name)), expected);
    }
}
