//! Captures of the packets that a sensor sends: `.pcap` and `.pcapng` files of one Ouster or
//! Velodyne sensor, or of several of which one is read.
//!
//! An Ouster's metadata is the `.json` file with the capture's name, or with the beginning of that
//! name; an HDL-64E's calibration, an `.xml` file, is found in the same way. The vehicle frame is
//! the sensor's; a sweep begins at the rear and is stamped there, by the sensor's clock.
//!
//! Opening walks through the file once and records where each sweep begins; a sweep is read on
//! demand. Packets of others are left out, and so are, with a note, packets with a wrong checksum,
//! late firings and incomplete revolutions at the ends.

pub mod assembly;
mod datagrams;
mod firing;
mod hdl64;
pub mod live;
mod ouster;
pub mod replay;
mod sensor;
mod streams;
#[cfg(test)]
pub(crate) mod tests;
mod velodyne;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::median::median;
use super::{
    OpenOptions, Overview, PosesFrame, Source, SourceGaps, SweepData, Unlocated, first_sweep,
    folder_name, pose_files,
};
use crate::Error;
use datagrams::{Datagram, Datagrams, Sender};
use firing::TURN;
use sensor::{Order, Sensor};
use streams::{Cut, Stream};

/// Longest accepted time between two sweeps, ns: an hour.
const STEP_MAX_NS: i64 = 3_600_000_000_000;

/// An open capture.
pub(super) struct Capture {
    overview: Overview,
    path: PathBuf,
    datagrams: Datagrams,
    sender: Sender,
    sensor: Sensor,
    /// Where each sweep begins, and where the next one does.
    sweeps: Vec<[Cut; 2]>,
    poses_from: String,
}

impl Capture {
    /// Opens a file.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Capture, Error> {
        let datagrams = Datagrams::open(path)?;
        let (all, counts) = streams::streams(path, &datagrams)?;
        let mut stream = streams::choose(path, all, &options.topics)?;
        let mut notes = streams::notes(&stream, &counts);
        let sweeps = stream.sweeps(&mut notes);
        let Stream { sender, sensor, .. } = stream;
        let sensors = core::iter::once(Pose::IDENTITY).collect();
        let mut capture = Capture {
            overview: first_sweep::before(name(path), sensors, notes, options),
            path: path.to_path_buf(),
            datagrams,
            sender,
            sensor,
            sweeps,
            poses_from: "registration".into(),
        };
        capture.set_stamps();
        capture.locate(options)?;
        let mut first = Vec::new();
        capture.read_points(0, &mut first)?;
        let sensor = capture.sensor.clone();
        first_sweep::learn(&mut capture.overview, (&first, true), &[sensor.name()], options)
            .map_err(|what| Error::input(path, "", what))?;
        Ok(capture)
    }

    /// Sets the stamps of the sweeps and their numbers, with a gap for each missing revolution.
    fn set_stamps(&mut self) {
        let cuts: Vec<Cut> = self.sweeps.iter().map(|sweep| sweep[0]).collect();
        let step = |pair: &[Cut]| self.sensor.since(pair[1].clock_ns, pair[0].clock_ns);
        let mut steps: Vec<i64> = cuts.windows(2).map(step).collect();
        let usual = median(steps.clone(), i64::cmp).unwrap_or(1);
        let set = steps.iter_mut().filter(|step| !(1..=STEP_MAX_NS).contains(*step));
        let set = set.map(|step| *step = usual.clamp(1, STEP_MAX_NS)).count();
        if set > 0 {
            let note =
                format!("the sensor's clock was set, one revolution is assumed there: {set} times");
            self.overview.notes.push(note);
        }
        let usual = usual as f64;
        let Overview { frames, track, epoch_ns, .. } = &mut self.overview;
        (*frames, track.stamps_s) = (vec![0], vec![0.0]);
        let mut since_ns = 0;
        for (step, pair) in steps.into_iter().zip(cuts.windows(2)) {
            since_ns += step;
            track.stamps_s.push(since_ns as f64 * 1e-9);
            // A sweep may begin within a revolution if packets are missing.
            let within = (f64::from(pair[1].angle) - f64::from(pair[0].angle)) / TURN as f64;
            let turns = libm::round(step as f64 / usual - within).max(1.0);
            frames.push(frames[frames.len() - 1] + turns as u64);
        }
        *epoch_ns = self.sensor.epoch_ns(cuts[0].clock_ns, cuts[0].time_ns);
    }

    fn locate(&mut self, options: &OpenOptions) -> Result<(), Error> {
        match &options.poses {
            _ if options.unlocated == Unlocated::Always => Ok(()),
            None => options.proceed_without_poses(&self.path, "sensor packets only"),
            Some(_) if options.poses_frame == Some(PosesFrame::Camera) => {
                Err(Error::Usage("a capture has no camera frame".into()))
            }
            Some(path) => {
                let Overview { frames, track, epoch_ns, notes, .. } = &mut self.overview;
                let ns = |s: &f64| *epoch_ns as i64 + (s * 1e9).round() as i64;
                let stamps_ns: Vec<i64> = track.stamps_s.iter().map(ns).collect();
                let poses = pose_files::read(path, &stamps_ns)?;
                self.poses_from = folder_name(path);
                pose_files::note_missing(&poses, &self.poses_from, notes);
                pose_files::keep(&mut self.sweeps, &poses);
                pose_files::keep(frames, &poses);
                pose_files::keep(&mut track.stamps_s, &poses);
                track.poses = poses.into_iter().flatten().collect();
                Ok(())
            }
        }
    }

    /// Replaces the points with those of a sweep.
    fn read_points(&self, index: usize, points: &mut Vec<Point>) -> Result<(), Error> {
        points.clear();
        let [cut, next] = &self.sweeps[index];
        let mut last = None;
        self.datagrams.each(cut.from, |datagram| {
            let Datagram { sender, payload, place, .. } = datagram;
            if place > next.place {
                return ControlFlow::Break(());
            }
            let mine = sender == self.sender && self.sensor.recognises(payload);
            if place < cut.place || !mine || !self.sensor.has_valid_checksum(payload) {
                return ControlFlow::Continue(());
            }
            for (number, firing) in self.sensor.firings(payload) {
                let before = place == cut.place && number < cut.firing;
                let after = place == next.place && number >= next.firing;
                let late = || self.sensor.order(&firing, last.as_ref()) == Order::Late;
                if before || after || late() {
                    continue;
                }
                let offset_ns = self.sensor.since(firing.clock_ns, cut.clock_ns);
                self.sensor.returns(payload, number, offset_ns, points);
                last = Some(firing);
            }
            ControlFlow::Continue(())
        })?;
        Ok(())
    }
}

impl Source for Capture {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        format!(
            "capture {}: {} of {} {}, poses from {}",
            self.path.display(),
            self.overview.length(),
            self.sensor.name(),
            self.sender,
            self.poses_from
        )
    }

    fn extension(&self) -> Option<&str> {
        None
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.overview.begin(index, into);
        let sweeps_before = self.overview.missing_before(index);
        into.dropped = SourceGaps { sweeps_before, null_rows: 0 };
        self.read_points(index, &mut into.points)
    }
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
