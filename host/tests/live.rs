//! Live packets: from a capture, or from a synthetic sensor.

#![cfg(unix)]

#[allow(dead_code)]
mod common;

use std::fs::{self, File};
use std::io::BufWriter;
use std::net::UdpSocket;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use common::{BACKEND, Outcome, SMALL, Temp};
use raywake_sim::packets::OusterPackets;
use raywake_sim::{Drive, Options, Sensor, SensorRig};
use serde_json::Value;

/// Revolutions of a capture, which begins within the first one.
const TURNS: usize = 24;
/// Those that are complete, as shown by a packet after them.
const WHOLE: u64 = TURNS as u64 - 2;

/// A capture from a small sensor in a street.
fn recorded(t: &Temp) -> PathBuf {
    let mut sensor = Sensor { columns: 512, ..Sensor::os1_128() };
    let beams = sensor.beams.iter().step_by(4).copied().collect();
    sensor.beams = beams;
    let rig = SensorRig::single(sensor.clone(), 1.9);
    let drive = Drive::new(3, Options { sweeps: TURNS, rig, ..Options::default() });
    let packets = OusterPackets::of(&sensor);
    t.write("street.json", packets.metadata());
    let path = t.path().join("street.pcap");
    let mut out = BufWriter::new(File::create(&path).unwrap());
    packets.capture(&mut out, drive).unwrap();
    out.into_inner().unwrap();
    path
}

/// `raywake live` on a small window, with its figures in `s.json`.
fn live(t: &Temp, more: &[&str]) -> Command {
    let (config, json) = (t.write("small.toml", SMALL), t.path().join("s.json"));
    let mut command = common::command(&["live", "--config", config.to_str().unwrap()]);
    command.args(["--summary", json.to_str().unwrap()]).args(more);
    command
}

/// The outcome of a replay.
fn replayed(t: &Temp, more: &[&str]) -> (Outcome, Value) {
    let path = t.path().join("street.pcap");
    let mut command = live(t, &["--replay", path.to_str().unwrap()]);
    let o = Outcome::of(command.args(more).output().unwrap());
    o.succeeded();
    let summary = o.summary(&t.path().join("s.json"));
    (o, summary)
}

fn count(summary: &Value, group: &str, name: &str) -> u64 {
    summary[group][name].as_u64().unwrap_or_else(|| panic!("{group}.{name} of {summary}"))
}

/// Asserts that every packet and every sweep is accounted for, and nothing was allocated.
fn assert_accounted(summary: &Value) {
    assert_eq!(count(summary, "sweeps", "allocating"), 0, "{summary}");
    // A busy system that allows only small buffers drops some, and reports them.
    let lost = summary["overflowed"].as_u64().unwrap_or(0);
    let packets = count(summary, "packets", "packets") + lost;
    assert_eq!(packets, (TURNS * 32 - 16) as u64, "{summary}");
    let all = ["done", "left_out", "before_start"].map(|name| count(summary, "sweeps", name));
    // The first sweep is used up for learning the rig.
    let all = all.iter().sum::<u64>();
    assert!(all == WHOLE - 1 || all < WHOLE - 1 && lost > 0, "{summary}");
}

fn socket() -> (UdpSocket, String) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let address = socket.local_addr().unwrap().to_string();
    (socket, address)
}

/// Numbers of records received by kind, until no more datagrams arrive.
fn received(socket: &UdpSocket) -> [u64; 4] {
    let (mut records, mut datagram) = ([0; 4], [0; 2000]);
    while let Ok(length) = socket.recv(&mut datagram) {
        assert!(datagram.starts_with(b"RWF2") && length > 24);
        records[datagram[4] as usize] += u64::from(datagram[6]);
    }
    records
}

/// A live replay gives the same bits as the capture. Messages are recorded, datagrams sent.
#[test]
fn replay_and_capture_have_the_same_digest() {
    let t = Temp::new();
    let (path, mcap) = (recorded(&t), t.path().join("street.mcap"));
    let (socket, address) = socket();
    let listening = thread::spawn(move || {
        socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut datagram = [0; 2000];
        socket.peek(&mut datagram).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
        received(&socket)
    });
    let to = ["--objects", "--mcap", mcap.to_str().unwrap(), "--send", &address];
    let (o, s) = replayed(&t, &[&BACKEND[..], &to].concat());
    assert_accounted(&s);
    assert!(o.stdout.contains("simulated OS1-128 at 127.0.0.1:"), "{}", o.stdout);
    let [sweeps, columns, tracklets, objects] = listening.join().unwrap();
    let (done, pairs) = (count(&s, "sweeps", "done"), count(&s, "sweeps", "pairs"));
    assert_eq!((sweeps, columns), (done, count(&s, "sweeps", "moving_columns")));
    assert!(columns > 100 && tracklets > 0, "{columns} {tracklets}");
    let moving = count(&s, "sweeps", "moving_objects");
    assert!(moving > 0 && objects >= moving, "{moving} of {objects}");
    let known = ["updated", "waiting"].map(|name| count(&s, "tracking", name));
    assert!(known.iter().sum::<u64>() >= objects, "{s}");
    let kept = ["recorded", "unrecorded"].map(|name| count(&s, "sweeps", name));
    assert_eq!(kept.iter().sum::<u64>(), pairs);
    assert!(s["latency_ms"]["median"].as_f64() > Some(0.0) && s["turn_ms"] == 100.0);
    let read = common::raywake(&["run", mcap.to_str().unwrap(), "-n", "2", "--backend", "scalar"]);
    read.succeeded();
    // On a busy machine some may have been dropped: then there is nothing to compare.
    let frames = [0, 1].map(|n| s["frames"][n].as_u64().unwrap());
    if count(&s, "sweeps", "left_out") + s["overflowed"].as_u64().unwrap_or(0) > 0 {
        eprintln!("not compared: sweeps or packets were left out");
        return;
    }
    let (config, json) = (t.path().join("small.toml"), t.path().join("run.json"));
    let sweeps = format!("{}..{}", frames[0], frames[1] + 1);
    let run = ["run", path.to_str().unwrap(), "--config", config.to_str().unwrap()];
    let part = ["--sweeps", &sweeps, "--summary", json.to_str().unwrap()];
    let o = common::raywake(&[&run[..], &BACKEND, &part].concat());
    o.succeeded();
    assert_eq!(o.summary(&json)["digest"], s["digest"]);
}

/// With all cores busy, and at ten times the speed, the queue stays bounded and everything is
/// counted.
#[test]
fn overload() {
    let t = Temp::new();
    recorded(&t);
    let busy: Vec<Child> = (0..thread::available_parallelism().map_or(1, usize::from))
        .map(|_| Command::new("sh").args(["-c", "while :; do :; done"]).spawn().unwrap())
        .collect();
    let (_, s) = replayed(&t, &[&BACKEND[..], &["--speed", "10", "--deadline", "5"]].concat());
    for mut child in busy {
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert_accounted(&s);
    assert!(count(&s, "sweeps", "left_out") + count(&s, "sweeps", "before_start") > 0, "{s}");
    assert!(count(&s, "sweeps", "done") > 0 && s["deadline_ms"] == 5.0);
}

/// The summary of a replay with poses received as datagrams, before the sweeps of their times: at
/// 2 m/s, and this far to the left and to the right by turns, m.
fn with_poses(jitter_m: f64, more: &[&str]) -> Value {
    let t = Temp::new();
    recorded(&t);
    let place = move |n: u64| {
        let aside_m = if (n / 10).is_multiple_of(2) { jitter_m } else { -jitter_m };
        [0.02 * n as f64, aside_m, 0.0, 0.0, 0.0, 0.0, 1.0]
    };
    // A port that was free a moment ago.
    let (free, address) = socket();
    let to = free.local_addr().unwrap();
    drop(free);
    let sending = thread::spawn(move || {
        thread::sleep(Duration::from_millis(100));
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        for n in 0..300_u64 {
            let stamp = 1_700_000_000_000_000_000 + n * 10_000_000;
            let numbers = place(n).into_iter().flat_map(f64::to_le_bytes);
            let bytes = b"RWP1\0\0\0\0".iter().copied().chain(stamp.to_le_bytes()).chain(numbers);
            socket.send_to(&bytes.collect::<Vec<u8>>(), to).unwrap();
            thread::sleep(Duration::from_millis(1));
        }
        socket.send_to(b"no pose", to).unwrap();
    });
    let (_, s) = replayed(&t, &[&BACKEND[..], &["--poses-from", &address], more].concat());
    sending.join().unwrap();
    assert_accounted(&s);
    assert_eq!((count(&s, "poses", "poses"), count(&s, "poses", "foreign")), (300, 1));
    assert_eq!(count(&s, "located", "with_pose"), count(&s, "sweeps", "done"));
    s
}

#[test]
fn received_poses_are_checked_against_registration() {
    let poses = |jitter_m, more: &'static [&str]| {
        thread::spawn(move || with_poses(jitter_m, more)["located"]["registration"]["poses"].take())
    };
    let runs = [poses(0.0, &[]), poses(0.1, &[]), poses(0.1, &["--trust-poses"])];
    let found = runs.map(|run| run.join().unwrap());
    assert_eq!(found, ["keep".into(), "replace".into(), Value::Null]);
}

/// A device that is lost, or does not answer, in the fourth sweep.
#[test]
fn a_device_that_fails() {
    let t = Temp::new();
    recorded(&t);
    let library = common::faulty_layer();
    let path = t.path().join("street.pcap");
    for (result, reported) in
        [(-4, "device lost during"), (2, "`flow` did not finish within 500ms")]
    {
        let more = ["--backend", "vulkan", "--deadline", "50", "--replay"];
        let mut command = live(&t, &[&more[..], &[path.to_str().unwrap()]].concat());
        command.envs(raywake_faulty_layer::environment(t.path(), &library).unwrap());
        command.env(raywake_faulty_layer::FAULT, format!("vkWaitForFences 6 {result}"));
        let o = Outcome::of(command.output().unwrap());
        if o.code == Some(5) && o.stderr.contains("Vulkan") {
            eprintln!("skipped: {}", o.stderr);
            return;
        }
        o.succeeded();
        assert!(o.stderr.contains("continuing on the scalar backend"), "{}", o.stderr);
        let s = o.summary(&t.path().join("s.json"));
        assert!(s["device_failure"].as_str().unwrap().contains(reported), "{s}");
        assert_eq!(s["backend"], "vulkan");
        assert_accounted(&s);
    }
}

/// A full disk ends the recording, not the run.
#[test]
fn a_full_disk() {
    let t = Temp::new();
    let path = recorded(&t);
    let arguments = live(&t, &[&BACKEND[..], &["--replay", path.to_str().unwrap()]].concat());
    let arguments: Vec<_> = arguments.get_args().map(|a| a.to_str().unwrap().to_owned()).collect();
    let mcap = t.path().join("street.mcap");
    let line = format!(
        "ulimit -f 400; exec {} {} --mcap {}",
        env!("CARGO_BIN_EXE_raywake"),
        arguments.join(" "),
        mcap.display()
    );
    let o = Outcome::of(Command::new("sh").args(["-c", &line]).output().unwrap());
    o.failed(4, &["street.mcap", "too large", "recording stopped", "street.incomplete.mcap"]);
    let s = o.summary(&t.path().join("s.json"));
    assert_accounted(&s);
    assert!(s["recording_failure"].as_str().is_some() && !mcap.exists());
    let kept = fs::metadata(t.path().join("street.incomplete.mcap")).unwrap();
    assert!(kept.len() > 100_000, "{kept:?}");
    assert!(!fs::read_dir(t.path()).unwrap().any(|e| is_partial(&e.unwrap().path())));
}

fn is_partial(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "partial")
}

/// Foreign datagrams, and a signal: an orderly end, before and after the first sweep.
#[test]
fn a_signal_stops_it() {
    let t = Temp::new();
    let (free, address) = socket();
    drop(free);
    let notified = t.path().join("notify");
    let watcher = UnixDatagram::bind(&notified).unwrap();
    watcher.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let listen = ["--listen", &address, "--model", "vlp16", "--ground=-1.9"];
    for sweeps in [false, true] {
        let mut command = live(&t, &[&BACKEND[..], &listen].concat());
        command.env("NOTIFY_SOCKET", &notified).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = command.spawn().unwrap();
        let notified_state = || {
            let mut text = [0; 64];
            let length = watcher.recv(&mut text).unwrap();
            String::from_utf8_lossy(&text[..length]).trim().to_owned()
        };
        let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
        let since = Instant::now();
        if sweeps {
            let mut n = 0;
            watcher.set_nonblocking(true).unwrap();
            while watcher.recv(&mut [0; 64]).is_err() {
                let _ = sensor.send_to(&common::vlp16(n), &address);
                n += 1;
                thread::sleep(Duration::from_micros(300));
                assert!(since.elapsed() < Duration::from_secs(60));
            }
            watcher.set_nonblocking(false).unwrap();
        } else {
            for _ in 0..50 {
                let _ = sensor.send_to(b"something else", &address);
                thread::sleep(Duration::from_millis(10));
            }
        }
        let kill = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
        assert!(kill.unwrap().success());
        let o = Outcome::of(child.wait_with_output().unwrap());
        o.succeeded();
        if sweeps {
            assert_eq!(notified_state(), "STOPPING=1");
            let s = o.summary(&t.path().join("s.json"));
            assert!((s["turn_ms"].as_f64().unwrap() - 75.0 * 1.327).abs() < 0.1, "{s}");
            assert!(s["sender"] == "127.0.0.1" && count(&s, "packets", "foreign") == 0, "{s}");
        } else {
            assert!(o.stdout.contains("no complete sweep arrived"), "{}", o.stdout);
        }
    }
}

/// A program stopped for half a second, while its sensor continues: a second later sweeps arrive
/// without gaps again.
#[test]
fn a_stall() {
    let t = Temp::new();
    let ((free, address), (results, to)) = (socket(), socket());
    drop(free);
    results.set_nonblocking(true).unwrap();
    let listen = ["--listen", &address, "--model", "vlp16", "--ground=-1.9", "--send", &to];
    let mut command = live(&t, &[&BACKEND[..], &listen].concat());
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let signal = |name: &str| {
        let kill = Command::new("kill").args([name, &child.id().to_string()]).status();
        assert!(kill.unwrap().success());
    };
    let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
    let (mut n, mut swept) = (0, Vec::new());
    let mut sends = |until: &dyn Fn(usize) -> bool| {
        while !until(swept.len()) {
            let _ = sensor.send_to(&common::vlp16(n), &address);
            n += 1;
            thread::sleep(Duration::from_micros(1327));
            let mut datagram = [0; 2000];
            while results.recv(&mut datagram).is_ok() {
                // For a sweep: the time since the one before, and the number dropped so far.
                if datagram[4] == 0 {
                    let dt_s = f32::from_le_bytes(datagram[80..84].try_into().unwrap());
                    let left_out = u64::from_le_bytes(datagram[88..96].try_into().unwrap());
                    swept.push((dt_s, left_out));
                }
            }
        }
        swept.len()
    };
    let began = Instant::now();
    let before = sends(&|sweeps| sweeps >= 5 || began.elapsed() > Duration::from_secs(60));
    assert!(before >= 5);
    signal("-STOP");
    let stopped = Instant::now();
    sends(&|_| stopped.elapsed() > Duration::from_millis(500));
    signal("-CONT");
    let went_on = Instant::now();
    let recovered = sends(&|_| went_on.elapsed() > Duration::from_secs(1));
    sends(&|sweeps| sweeps >= recovered + 5 || went_on.elapsed() > Duration::from_secs(60));
    signal("-TERM");
    Outcome::of(child.wait_with_output().unwrap()).succeeded();
    assert!(recovered > before, "{swept:?}");
    let last = &swept[recovered..];
    assert!(last.iter().all(|sweep| sweep.0 > 0.0 && sweep.1 == last[0].1), "{swept:?}");
}

#[test]
fn conflicting_arguments() {
    let t = Temp::new();
    let wrong = |more: &[&str], code: i32, words: &[&str]| {
        let mut command = live(&t, more);
        let mut child = command.stderr(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let since = Instant::now();
        // If accepted by mistake, it would listen forever.
        while child.try_wait().unwrap().is_none() {
            thread::sleep(Duration::from_millis(5));
            if since.elapsed() > Duration::from_secs(30) {
                child.kill().unwrap();
            }
        }
        Outcome::of(child.wait_with_output().unwrap()).failed(code, words);
    };
    wrong(&[], 2, &["--model"]);
    wrong(&["--model", "hdl99"], 2, &["vlp16", "ouster"]);
    wrong(&["--model", "ouster"], 2, &["--metadata"]);
    wrong(&["--model", "vlp16", "--metadata", "x.json"], 2, &["Ouster"]);
    wrong(&["--model", "vlp16", "--speed", "2"], 2, &["--replay"]);
    wrong(&["--model", "vlp16", "--listen", "here"], 2, &["ADDRESS:PORT"]);
    wrong(&["--model", "vlp16", "--listen", "203.0.113.1:9"], 2, &["--listen 203.0.113.1:9"]);
    wrong(&["--replay", "no.pcap"], 3, &["no.pcap"]);
    // At once, before any sweep arrives.
    let nowhere = ["--model", "vlp16", "--listen", "127.0.0.1:0", "--mcap", "/nowhere/x.mcap"];
    wrong(&nowhere, 4, &["/nowhere/x.mcap"]);
    let (_held, address) = socket();
    wrong(&["--model", "vlp16", "--listen", &address], 2, &["--listen", "in use"]);
    let capture = recorded(&t).display().to_string();
    let onto = ["--replay", &capture, "--mcap", &capture];
    wrong(&onto, 2, &["is an input"]);
    // Three packets of it.
    let bytes = fs::read(&capture).unwrap();
    let length = u32::from_le_bytes(bytes[32..36].try_into().unwrap()) as usize;
    let short = t.write("short.pcap", &bytes[..24 + 3 * (16 + length)]);
    fs::copy(t.path().join("street.json"), t.path().join("short.json")).unwrap();
    wrong(&["--replay", short.to_str().unwrap()], 3, &["short.pcap", "no complete sweep"]);
}
