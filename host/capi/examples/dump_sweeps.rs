//! Writes sweeps of a recording, or of the demo's simulated drive, to one flat file for `replay.c`.
//!
//! Little-endian, without padding. The rig: timing (u32), distorted (u32), from_s, span_s (f64),
//! ground (f64), own vehicle (4 x f32), number of sensors (u64), the pose of each. Then sweeps
//! until the end: stamp (f64), pose, twist (6 x f64), number of returns (u64), and for each x, y,
//! z, time (f32) and sensor (u32). A pose is a translation and a quaternion x, y, z, w (7 x f64).

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use raywake_core::pose::Pose;
use raywake_core::sweep::{Rig, Timing};
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, Source, SweepData, open};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [data, out, most] = args.as_slice() else {
        return Err("dump_sweeps RECORDING|demo OUT SWEEPS".into());
    };
    let mut source: Box<dyn Source> = match data.as_str() {
        "demo" => Box::new(Simulated::demo()),
        path => open(Path::new(path), &OpenOptions::default())?,
    };
    let mut to = BufWriter::new(File::create(out)?);
    rig(&mut to, source.rig())?;
    let mut now = SweepData::default();
    for index in 0..source.len().min(most.parse()?) {
        source.read(index, &mut now)?;
        sweep(&mut to, &now)?;
    }
    Ok(to.flush()?)
}

fn doubles(to: &mut impl Write, numbers: &[f64]) -> std::io::Result<()> {
    numbers.iter().try_for_each(|v| to.write_all(&v.to_le_bytes()))
}

fn pose(to: &mut impl Write, pose: &Pose) -> std::io::Result<()> {
    doubles(to, &pose.translation.to_array())?;
    doubles(to, &pose.rotation.to_array())
}

fn rig(to: &mut impl Write, rig: &Rig) -> std::io::Result<()> {
    let (timing, from_s, span_s) = match rig.timing {
        Timing::AtStamp => (0u32, 0.0, 0.0),
        Timing::Offset { from_s, span_s } => (1, from_s, span_s),
        Timing::Azimuth { span_s } => (2, 0.0, span_s),
    };
    to.write_all(&timing.to_le_bytes())?;
    to.write_all(&u32::from(rig.distorted).to_le_bytes())?;
    doubles(to, &[from_s, span_s, rig.ground_m])?;
    let own = rig.own_vehicle.unwrap_or_default();
    own.as_flattened().iter().try_for_each(|c| to.write_all(&c.to_le_bytes()))?;
    to.write_all(&(rig.sensors.len() as u64).to_le_bytes())?;
    rig.sensors.iter().try_for_each(|sensor| pose(to, sensor))
}

fn sweep(to: &mut impl Write, sweep: &SweepData) -> std::io::Result<()> {
    doubles(to, &[sweep.stamp_s])?;
    pose(to, &sweep.world_from_vehicle)?;
    doubles(to, &sweep.twist.linear.to_array())?;
    doubles(to, &sweep.twist.angular.to_array())?;
    to.write_all(&(sweep.points.len() as u64).to_le_bytes())?;
    for point in &sweep.points {
        let [x, y, z] = point.position;
        for number in [x, y, z, point.offset_s] {
            to.write_all(&number.to_le_bytes())?;
        }
        to.write_all(&point.sensor.to_le_bytes())?;
    }
    Ok(())
}
