//! Recordings of every format, damaged at random: an error or other numbers, never a panic, and
//! never longer than a second.
//!
//! `RAYWAKE_FUZZ` is the number of damaged recordings per format; what breaks a reader is kept next
//! to the temporary files, and named.

use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;
use std::time::{Duration, Instant};

use super::super::Unlocated;
use super::*;

#[path = "../../../fuzz/src/bundle.rs"]
mod bundle;
use bundle::Bundle;

/// Damaged recordings per format, unless specified.
const USUAL: usize = 200;
/// Longest time that a recording may take.
const LONGEST: Duration = Duration::from_secs(1);
/// A folder of recordings for each format.
const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus/recording");
/// Maximum number of sweeps read from each recording.
const SWEEPS: usize = 3;
/// Numbers that readers have stumbled over.
const NUMBERS: [&str; 12] = [
    "0",
    "-1",
    "nan",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "0x10",
    "",
];

/// A recording in a folder.
struct Seed {
    folder: Temp,
    options: OpenOptions,
    files: Vec<(PathBuf, Vec<u8>)>,
    /// Path of the recording below the folder.
    root: String,
}

impl Seed {
    fn new(folder: Temp, root: &str, options: OpenOptions) -> Seed {
        let (mut files, mut folders) = (Vec::new(), vec![folder.path().to_path_buf()]);
        while let Some(next) = folders.pop() {
            for entry in fs::read_dir(next).unwrap() {
                let path = entry.unwrap().path();
                match path.is_dir() {
                    true => folders.push(path),
                    false => files.push((path.clone(), fs::read(path).unwrap())),
                }
            }
        }
        files.sort();
        Seed { folder, options, files, root: root.into() }
    }

    /// The recording that a fuzzer starts from.
    fn bundle(&self) -> Bundle {
        let place = |path: &Path| {
            path.strip_prefix(self.folder.path()).unwrap().to_str().unwrap().to_string()
        };
        let files = self.files.iter().map(|(path, content)| (place(path), content.clone()));
        let (root, topics) = (self.root.clone(), self.options.topics.clone());
        Bundle { root, topics, files: files.collect() }
    }

    /// Opens the recording and reads some of it. Returns whether that worked.
    fn read(&self) -> bool {
        let Ok(mut source) = open(&self.folder.path().join(&self.root), &self.options) else {
            return false;
        };
        let mut sweep = SweepData::default();
        (0..source.len().min(SWEEPS)).all(|index| {
            let read = source.read(index, &mut sweep);
            assert!(read.is_ok() || sweep.points.is_empty(), "returns of a sweep that failed");
            let pose = &sweep.world_from_vehicle;
            assert!(pose.rotation.is_finite() && pose.translation.is_finite(), "{pose:?}");
            let twist = &sweep.twist;
            assert!(twist.linear.is_finite() && twist.angular.is_finite(), "{twist:?}");
            read.is_ok()
        })
    }

    /// Reads it, again if that took too long: a machine pauses now and then, but a reader that
    /// hangs will hang again. Returns whether it could be read, or panicked, and the time.
    fn timed(&self) -> (thread::Result<bool>, Duration) {
        let timed = || {
            let since = Instant::now();
            (catch_unwind(AssertUnwindSafe(|| self.read())), since.elapsed())
        };
        let first = timed();
        if first.1 > LONGEST { timed() } else { first }
    }

    /// Damages files of the recording `times` times. Returns how often it could still be read.
    fn damage(&self, times: usize, random: &mut Random) -> usize {
        let once = |random: &mut Random| {
            let (path, whole) = &self.files[random.below(self.files.len())];
            let bytes = damaged(whole, random);
            fs::write(path, &bytes).unwrap();
            let (read, took) = self.timed();
            fs::write(path, whole).unwrap();
            if read.is_err() || took > LONGEST {
                let kept = std::env::temp_dir().join(format!("raywake-{}", bytes.len()));
                let _ = fs::File::create(&kept).and_then(|mut file| file.write_all(&bytes));
                panic!("{} in place of {}: {took:?}", kept.display(), path.display());
            }
            read.is_ok_and(|read| read)
        };
        (0..times).filter(|_| once(random)).count()
    }
}

/// Numbers that look random but are always the same.
pub(crate) struct Random(pub u64);

impl Random {
    pub fn below(&mut self, limit: usize) -> usize {
        // Knuth's MMIX generator, its upper half.
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (((self.0 >> 32) * limit as u64) >> 32) as usize
    }
}

/// A file with up to four kinds of damage.
pub(crate) fn damaged(whole: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        match random.below(7) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
            2 => bytes.truncate(at),
            3 => word(&mut bytes, at, random),
            4 => number(&mut bytes, at, random),
            5 => {
                let copied = bytes[at..(at + 1 + random.below(64)).min(bytes.len())].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copied);
            }
            _ => {
                let end = (at + 1 + random.below(64)).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
    bytes
}

/// Replaces a word of four or eight bytes by an extreme one.
fn word(bytes: &mut [u8], at: usize, random: &mut Random) {
    let extreme = [0, 1, u64::MAX, 1 << 31, (1 << 31) - 1, 1 << 63, 1 << 40][random.below(7)];
    let word = extreme.to_le_bytes();
    let length = [4, 8][random.below(2)].min(bytes.len() - at);
    bytes[at..at + length].copy_from_slice(&word[..length]);
}

/// Replaces the next number in a text after a place.
fn number(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let digit = |byte: &u8| byte.is_ascii_digit() || b"+-.e".contains(byte);
    let Some(from) = bytes[at..].iter().position(digit).map(|n| at + n) else { return };
    let length = bytes[from..].iter().take_while(|byte| digit(byte)).count();
    let other = NUMBERS[random.below(NUMBERS.len())].bytes();
    bytes.splice(from..from + length, other);
}

/// Number of damaged recordings per format.
fn times() -> usize {
    let times = std::env::var("RAYWAKE_FUZZ").ok().and_then(|n| n.parse().ok());
    times.unwrap_or(USUAL)
}

/// Damages a seed recording of fuzzers, after checking it.
fn fuzz(name: &str, seed: Seed) {
    start(name, &seed);
    damage(name, seed);
}

/// Damages a recording of a format.
fn damage(name: &str, seed: Seed) {
    let times = times();
    // A separate random stream for each format, and another one for another number of recordings.
    let number = name.bytes().fold(times as u64, |n, byte| n.wrapping_mul(31) + u64::from(byte));
    let read = seed.damage(times, &mut Random(number));
    println!("{name}: {times} damaged, {read} of them read");
    // Most damage is to numbers of returns, which may have any value.
    assert!(times < 50 || (1..times).contains(&read), "{name}: {read} of {times} were read");
}

/// Checks the seed of coverage-guided fuzzers; written with `UPDATE=1`.
fn start(name: &str, seed: &Seed) {
    assert!(seed.read(), "{name}: the recording itself");
    let path = Path::new(CORPUS).join(name).join("0");
    if std::env::var_os("UPDATE").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, seed.bundle().bytes()).unwrap();
    }
    assert!(path.exists(), "UPDATE=1 writes {}", path.display());
}

/// Without poses, for recordings that have none.
fn unlocated() -> OpenOptions {
    OpenOptions { unlocated: Unlocated::Accept, ground_m: Some(-1.7), ..OpenOptions::default() }
}

#[test]
fn kitti() {
    fuzz("poses.txt", Seed::new(drive(), "", OpenOptions::default()));
    let t = Temp::new();
    formats::oxts_drive(&t, "day/drive");
    t.write("day/calib_imu_to_velo.txt", "R: 1 0 0 0 1 0 0 0 1\nT: 0.8 -0.3 0.8\n");
    fuzz("oxts", Seed::new(t, "day/drive", OpenOptions::default()));
    fuzz("sensors.txt", Seed::new(sidecars::with_sidecars(), "", OpenOptions::default()));
    let t = Temp::new();
    t.write("velodyne/000000.bin", bin(&[[1.0, -2.0, 0.5, 0.25]; 3]));
    t.write("velodyne/000001.bin", bin(&[[2.0, -2.0, 0.5, 0.25]; 3]));
    t.write("poses.txt", row(0.0, 0.0, 0.0) + &row(1.0, 0.0, 0.0));
    t.write("times.txt", "0\n0.1\n");
    t.write("calib.txt", "P0: 1 2 3\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
    fuzz("odometry", Seed::new(t, "", OpenOptions::default()));
}

#[test]
fn folders_of_clouds() {
    let two = |name: &str, content: &[u8]| {
        let t = Temp::new();
        t.write(&format!("0.{name}"), content);
        t.write(&format!("1.{name}"), content);
        t.write("times.txt", "0\n0.1\n");
        Seed::new(t, "", unlocated())
    };
    fuzz("pcd", two("pcd", &files::binary()));
    fuzz("pcd-compressed", two("pcd", &files::compressed_file()));
    fuzz("ply", two("ply", &files::ply("binary_little_endian", &files::vertices(false))));
    let header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 4), }\n";
    let length = (header.len() as u16).to_le_bytes();
    let numbers: Vec<u8> = (0..8).flat_map(|n| (n as f32 * 0.5).to_le_bytes()).collect();
    let npy = [&b"\x93NUMPY\x01\x00"[..], &length, header, &numbers].concat();
    fuzz("npy", two("npy", &npy));
}

#[cfg(feature = "arrow")]
#[test]
fn argoverse_logs() {
    fuzz("argoverse", Seed::new(argoverse::log(), "", OpenOptions::default()));
}

#[cfg(feature = "nuscenes")]
#[test]
fn nuscenes_scenes() {
    fuzz("nuscenes", Seed::new(nuscenes::scenes(), "", nuscenes::asked("scene-0061")));
}

#[cfg(feature = "parquet")]
#[test]
fn waymo_segments() {
    fuzz("waymo", Seed::new(waymo::segment(4), "", OpenOptions::default()));
}

#[cfg(feature = "mcap")]
#[test]
fn bags() {
    use crate::source::bag::tests as bag;
    // Without checksums, which would detect all damage.
    let of = |sweeps| {
        let t = Temp::new();
        let options = bag::options().compression(None).use_chunks(false);
        // Images are skipped, and large.
        let mut messages = bag::rig(sweeps);
        messages.retain(|(topic, ..)| *topic != "/image");
        t.write("a.mcap", bag::file(&messages, options));
        Seed::new(t, "a.mcap", unlocated())
    };
    start("mcap", &of(1));
    damage("bags", of(3));
}

#[cfg(feature = "mcap")]
#[test]
fn chunks_that_unpack_to_too_much() {
    use crate::source::bag::tests as bag;
    use mcap::Compression;
    let temp = Temp::new();
    let zeros = |n| ("/image", "sensor_msgs/msg/Image", n, vec![0; 9 << 20]);
    let messages: Vec<_> = bag::rig(2).into_iter().chain((0..20).map(zeros)).collect();
    for compression in [Compression::Zstd, Compression::Lz4] {
        let bytes = bag::file(&messages, bag::options().compression(Some(compression)));
        let most = (16 << 20) + 64 * bytes.len();
        let path = temp.write("zeros.mcap", bytes);
        let error = open(&path, &unlocated()).map(|_| ()).unwrap_err().to_string();
        assert!(error.ends_with(&format!(": unpacks to more than {most} bytes")), "{error}");
    }
}

/// The seeds of coverage-guided fuzzers can be read, and what they once broke is an error. The
/// other tests here damage similar recordings.
#[cfg(all(feature = "mcap", feature = "nuscenes", feature = "parquet", feature = "pcap"))]
#[test]
fn corpus() {
    for kind in fs::read_dir(CORPUS).unwrap().map(|entry| entry.unwrap().path()) {
        for file in fs::read_dir(kind).unwrap().map(|entry| entry.unwrap().path()) {
            let bundle = Bundle::parse(&fs::read(&file).unwrap()).expect("a bundle");
            assert_eq!(Bundle::parse(&bundle.bytes()).as_ref(), Some(&bundle));
            let folder = Temp::new();
            for (place, content) in &bundle.files {
                folder.write(place, content);
            }
            let options = OpenOptions { topics: bundle.topics, ..unlocated() };
            let seed = Seed::new(folder, &bundle.root, options);
            let starts = file.file_name().is_some_and(|name| name == "0");
            let (read, took) = seed.timed();
            assert_eq!(read.ok(), Some(starts), "{}", file.display());
            assert!(took < LONGEST, "{} takes {took:?}", file.display());
        }
    }
}

#[cfg(feature = "pcap")]
#[test]
fn captures() {
    use crate::source::capture::tests as capture;
    let of = |packets: Vec<u8>, beside: &str, content: Vec<u8>| {
        let t = Temp::new();
        t.write("a.pcap", packets);
        t.write(&format!("a.{beside}"), content);
        Seed::new(t, "a.pcap", unlocated())
    };
    let vlp = |packets| of(capture::recording(packets), "txt", Vec::new());
    let hdl = |packets| {
        let [packets, calibration] = capture::calibrated(packets);
        of(packets, "xml", calibration)
    };
    let ouster = |packets| {
        let [packets, metadata] = capture::published(packets);
        of(packets, "json", metadata)
    };
    // Small seeds: a few packets of a revolution.
    [("pcap", vlp(4)), ("db.xml", hdl(4)), ("ouster", ouster(2))]
        .iter()
        .for_each(|(name, seed)| start(name, seed));
    damage("turns", vlp(230));
    damage("turns with db.xml", hdl(700));
    damage("turns of an ouster", ouster(34));
}
