//! The program and synthetic recordings for it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};

use raywake_core::digest::Digest;

/// A folder that is removed when dropped.
pub struct Temp(PathBuf);

impl Temp {
    pub fn new() -> Temp {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("raywake-cli-{}-{n}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Temp(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file and its parent folders.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, content).unwrap();
        path
    }

    /// Writes `drive`, a drive of some sweeps in KITTI's layout: half a metre forward every 0.1 s,
    /// between walls, with an object driving ahead.
    pub fn drive(&self, sweeps: usize) {
        for n in 0..sweeps {
            self.write(&format!("drive/velodyne_points/data/{n:010}.bin"), cloud(n % 100));
        }
        let lines = |line: &dyn Fn(usize) -> String| (0..sweeps).map(line).collect::<String>();
        self.write("drive/poses.txt", lines(&|n| row((n % 100) as f64 * 0.5)));
        self.write("drive/times.txt", lines(&|n| format!("{}\n", n as f64 * 0.1)));
    }
}

impl Drop for Temp {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The row of a pose `x` metres along the x axis.
pub fn row(x: f64) -> String {
    format!("1 0 0 {x} 0 1 0 0 0 0 1 0\n")
}

fn cloud(n: usize) -> Vec<u8> {
    let mut points: Vec<[f32; 4]> = Vec::new();
    for i in 0..40 {
        let x = i as f32 * 0.4 - 8.0 - (n as f32 * 0.5) % 0.4;
        points.extend([-0.2, 0.4].map(|z| [x, 6.0, z, 0.5]));
        points.extend([-0.2, 0.4].map(|z| [x, -6.0, z, 0.5]));
    }
    for i in 0..10 {
        points.extend([-0.8, -0.2].map(|z| [5.0 + n as f32 * 0.3 % 2.0, i as f32 * 0.2, z, 0.1]));
    }
    points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

/// A weights file of the given values, with a correct checksum.
pub fn weights(kind: &str, shape: &[usize], value: impl Fn(usize) -> &'static str) -> String {
    let sizes: Vec<_> = shape.iter().map(usize::to_string).collect();
    let values: Vec<_> = (0..shape.iter().product::<usize>() + 1).map(value).collect();
    let (sizes, values) = (sizes.join(" "), values.join("\n"));
    let body = format!("kind {kind}\nshape {sizes}\nscale 10\nprovenance made up\n{values}\n");
    format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
}

/// The layer that makes Vulkan calls fail, where cargo puts it: next to the test.
#[allow(dead_code)]
pub fn faulty_layer() -> PathBuf {
    let folder = std::env::current_exe().unwrap().parent().unwrap().to_path_buf();
    let name = format!(
        "{}raywake_faulty_layer{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    folder.join(name)
}

/// What a process left behind.
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    pub fn of(output: Output) -> Outcome {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Outcome {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    #[track_caller]
    pub fn succeeded(&self) {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
    }

    /// Asserts that it ended with this code, and a message with these words.
    #[track_caller]
    pub fn failed(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "`{word}` in {}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }

    pub fn summary(&self, path: &Path) -> serde_json::Value {
        serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
    }
}

pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raywake"));
    command.args(arguments);
    command
}

pub fn raywake(arguments: &[&str]) -> Outcome {
    Outcome::of(command(arguments).output().unwrap())
}

/// Parameters of a small window.
pub const SMALL: &str = "name = \"small\"\nside = 61\nem_rounds = 3\n";
pub const BACKEND: [&str; 2] = ["--backend", "scalar"];

/// `raywake run DRIVE` with more arguments, on a small window.
pub fn run(t: &Temp, more: &[&str]) -> Outcome {
    let config = t.write("small.toml", SMALL);
    let data = t.path().join("drive");
    let head = ["run", data.to_str().unwrap(), "--config", config.to_str().unwrap()];
    raywake(&[&head, &BACKEND[..], more].concat())
}

/// A packet of a VLP-16 in the middle of a room, 16 m by 24 m; `n` counts packets, 75 per
/// revolution.
pub fn vlp16(n: u32) -> Vec<u8> {
    let block = |block: u32| {
        let azimuth = ((n * 12 + block) * 40 % 36_000) as u16;
        let (sin, cos) = (f64::from(azimuth) * 0.01).to_radians().sin_cos();
        let distance = (12.0 / cos.abs()).min(8.0 / sin.abs());
        let [low, high] = ((distance / 0.002) as u16).to_le_bytes();
        let seen = [low, high, 51].repeat(32);
        [&[0xff, 0xee][..], &azimuth.to_le_bytes(), &seen].concat()
    };
    let blocks: Vec<u8> = (0..12).flat_map(block).collect();
    [&blocks[..], &(n * 1327).to_le_bytes(), &[0x37, 0x22]].concat()
}
