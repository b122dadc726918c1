//! What goes wrong in a stretch of sweeps.

use clap::ValueEnum;
use glam::{DQuat, DVec3};
use raywake_core::params::{Profile, SENSORS_MAX};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;
use raywake_io::source::SweepData;
use raywake_sim::Rng;

/// One in this many returns is corrupted.
const CORRUPTED_EVERY: usize = 7;
/// Extent of noise, m.
const NOISE_M: f64 = 100.0;
/// Sweeps in a gap: one second.
pub const GAP: usize = 10;
/// A sweep over capacity has this many times the returns that the profile takes.
pub const OVER: usize = 2;

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Fault {
    /// One sweep is lost; tracking continues.
    LostSweep,
    /// More sweeps are lost than tracking can bridge.
    Gap,
    /// Coordinates, times and intensities that are not finite; sensors that do not exist.
    NotFinite,
    /// Poses continue a kilometre away.
    Jump,
    /// Poses continue facing the other way.
    Spin,
    /// The clock is set back by an hour.
    ClockBack,
    /// The clock is set forward by an hour.
    ClockForward,
    /// A sweep without returns.
    Empty,
    /// Twice as many returns as the profile takes.
    OverCapacity,
    /// All returns at the same place.
    Coincident,
    /// Returns anywhere.
    Noise,
    /// The disk that results go to is full.
    FullDisk,
}

impl Fault {
    /// Its name.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Corrupts the sweep that comes `after` sweeps after the middle one of its stretch. Returns
    /// whether there is a sweep at all.
    pub fn corrupt(
        self,
        after: usize,
        sweep: &mut SweepData,
        profile: &Profile,
        rng: &mut Rng,
    ) -> bool {
        let first = after == 0;
        match self {
            Fault::LostSweep => return !first,
            Fault::Gap => return after >= GAP,
            Fault::ClockBack => sweep.stamp_s -= 3600.0,
            Fault::ClockForward => sweep.stamp_s += 3600.0,
            Fault::Jump => sweep.world_from_vehicle.translation += DVec3::new(1e3, -1e3, 10.0),
            Fault::Spin => {
                let turned = Pose::new(DQuat::from_rotation_z(3.0), DVec3::ZERO);
                sweep.world_from_vehicle = sweep.world_from_vehicle * turned;
            }
            _ if first => self.corrupt_returns(&mut sweep.points, profile, rng),
            _ => {}
        }
        true
    }

    fn corrupt_returns(self, points: &mut Vec<Point>, profile: &Profile, rng: &mut Rng) {
        match self {
            Fault::NotFinite => corrupt_some(points, rng),
            Fault::Empty => points.clear(),
            Fault::OverCapacity => {
                let (there, wanted) = (points.len(), OVER * profile.returns());
                points.reserve(wanted.saturating_sub(there));
                (there..wanted).for_each(|n| points.push(points[n - there]));
            }
            Fault::Coincident => {
                let at = points.first().copied().unwrap_or_default();
                points.fill(at);
            }
            Fault::Noise => points.iter_mut().for_each(|point| {
                let mut place = || rng.range(-NOISE_M, NOISE_M) as f32;
                point.position = [place(), place(), place()];
            }),
            _ => {}
        }
    }
}

/// Fills some of the returns with invalid values.
fn corrupt_some(points: &mut [Point], rng: &mut Rng) {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0];
    for point in points.iter_mut().step_by(CORRUPTED_EVERY) {
        let mut draw = || odd[(rng.bits() % odd.len() as u64) as usize];
        point.position = [draw(), draw(), draw()];
        (point.intensity, point.offset_s) = (draw(), draw());
        point.sensor += SENSORS_MAX as u32;
    }
}
