//! `raywake-lab packets`: the packets of a simulated sensor, for `raywake live --replay` and `run`.

use super::sceneries;
use raywake::progress::Progress;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_sim::packets::OusterPackets;
use raywake_sim::{Drive, Options, Scenery, Sensor, SensorRig};
use std::io::Write;
use std::path::PathBuf;

/// Height of the sensor above the ground, m.
const HEIGHT_M: f64 = 1.9;

/// Options of `packets`.
#[derive(clap::Args)]
pub struct PacketsArgs {
    /// Capture to write, `.pcap`; the sensor's metadata goes next to it, as `.json`.
    out: PathBuf,
    /// Revolutions, 10 a second.
    #[arg(long, default_value_t = 100)]
    sweeps: usize,
    /// Columns of a revolution, of 128 beams each.
    #[arg(long, default_value_t = 1024, value_parser = columns)]
    columns: usize,
    /// Seed of the drive.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Scene that is driven through.
    #[arg(long, default_value = "street", value_parser = sceneries())]
    scenery: Scenery,
}

fn columns(text: &str) -> Result<usize, String> {
    let of_sensors = ["512", "1024", "2048"].contains(&text);
    of_sensors.then(|| text.parse().ok()).flatten().ok_or("512, 1024 or 2048".into())
}

/// Writes the capture and the metadata.
pub fn packets(args: &PacketsArgs) -> Result<(), Error> {
    let sensor = Sensor { columns: args.columns, ..Sensor::os1_128() };
    let rig = SensorRig::single(sensor.clone(), HEIGHT_M);
    let (scenery, sweeps) = (args.scenery, args.sweeps);
    let drive = Drive::new(args.seed, Options { sweeps, rig, scenery, ..Options::default() });
    let packets = OusterPackets::of(&sensor);
    let metadata = packets.metadata();
    let json = args.out.with_extension("json");
    atomic::write(&json, |out| out.write_all(metadata.as_bytes()))?;
    let mut progress = Progress::new("sweep", sweeps, false);
    let told = drive.enumerate().map(|(number, sweep)| {
        progress.update(number + 1);
        sweep
    });
    atomic::write(&args.out, |out| packets.capture(out, told))
}
