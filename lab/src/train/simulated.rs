//! Simulated drives, each with its own sensor and street.

use super::drives::{Labelled, LabelledSweep, Seen};
use crate::labels::Kind;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_core::record::NONE;
use raywake_core::sweep::Rig;
use raywake_io::Error;
use raywake_io::source::{SourceGaps, SweepData};
use raywake_sim::{Class, Drive, Options, Rng, Scenery, SensorRig};

pub struct Simulated {
    drive: Drive,
    rig: Rig,
    tilt: Pose,
}

impl Simulated {
    /// Drive `index` of a seed.
    pub fn drawn(seed: u64, index: u64, sweeps: usize, scenery: Scenery) -> Simulated {
        let mut rng = Rng::split(seed, index);
        let options = Options {
            sweeps,
            density: rng.range(0.3, 1.3),
            rig: rig(index, &mut rng),
            scenery,
            threads: 1,
            ..Options::default()
        };
        let drive = Drive::new(rng.bits(), options);
        Simulated { tilt: tilt(&mut rng), ..Simulated::new(drive) }
    }

    /// Wraps a drive built elsewhere.
    pub fn new(drive: Drive) -> Simulated {
        Simulated { rig: drive.rig(), drive, tilt: Pose::IDENTITY }
    }
}

/// Rigs in rotation: every second drive has KITTI's, since the shipped numbers are for similar
/// levels and ranges.
const RIGS: [fn() -> SensorRig; 6] = [
    SensorRig::hdl64,
    SensorRig::vlp32x2,
    SensorRig::hdl64,
    SensorRig::hdl32x4,
    SensorRig::hdl64,
    SensorRig::beam128,
];

/// Varied streets, in rotation.
const SCENERIES: [Scenery; 6] = [
    Scenery::Street,
    Scenery::StreetCluttered,
    Scenery::Street,
    Scenery::StreetNarrow,
    Scenery::Street,
    Scenery::StreetBroad,
];

/// A drive's scenery. The [`RIGS`] rotate as well: every one drives everywhere.
pub fn varied(drive: u64) -> Scenery {
    let turns = drive / RIGS.len() as u64;
    SCENERIES[((drive + turns) % SCENERIES.len() as u64) as usize]
}

/// A rig whose sensors vary a little in noise, strength, pitch and height, so that training does
/// not come to rely on one particular unit.
fn rig(index: u64, rng: &mut Rng) -> SensorRig {
    let mut rig = RIGS[(index % RIGS.len() as u64) as usize]();
    let higher = rng.range(-0.12, 0.2);
    let noise = [rng.range(0.5, 2.5), rng.range(0.7, 3.0)];
    let (dropout, signal) = (rng.range(0.0, 0.15), rng.range(0.4, 1.2));
    for mount in &mut rig.mounts {
        let sensor = &mut mount.sensor;
        let pitch = rng.range(-0.005, 0.005);
        sensor.beams.iter_mut().for_each(|b| b.elevation += pitch);
        sensor.range_noise *= noise[0];
        sensor.angle_noise *= noise[1];
        sensor.dropout = dropout;
        sensor.signal *= signal;
    }
    rig.origin.z += higher;
    rig
}

/// How far a street is tilted along either axis of the world, as a slope: hills, and poses whose
/// vertical is not exact.
const SLOPE: f64 = 0.02;

fn tilt(rng: &mut Rng) -> Pose {
    let [roll, pitch] = [0; 2].map(|_| rng.range(-SLOPE, SLOPE));
    let turn = DQuat::from_rotation_x(roll) * DQuat::from_rotation_y(pitch);
    Pose::new(turn, DVec3::ZERO)
}

fn kind(class: Class) -> Kind {
    match class {
        Class::Car => Kind::Car,
        Class::Van => Kind::Van,
        Class::Truck => Kind::Truck,
        Class::Bus => Kind::Bus,
        Class::Tram => Kind::Tram,
        Class::Motorcycle => Kind::Motorcycle,
        Class::Cyclist => Kind::Cyclist,
        Class::Pedestrian => Kind::Pedestrian,
        _ => Kind::Other,
    }
}

impl Labelled for Simulated {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn len(&self) -> usize {
        self.drive.sweeps()
    }

    fn read(&mut self, index: usize, into: &mut LabelledSweep) -> Result<(), Error> {
        let sweep = self.drive.sweep(index);
        let vehicle_from_world = sweep.world_from_vehicle.inverse();
        let states = self.drive.objects(sweep.stamp_s);
        let place = |id: u32| states.binary_search_by_key(&id, |s| s.id).ok();
        into.object_of_point.clear();
        into.object_of_point
            .extend(sweep.truth.iter().map(|t| place(t.object).map_or(NONE, |at| at as u32)));
        into.class_of_point.clear();
        into.class_of_point.extend(sweep.truth.iter().map(|t| t.class));
        into.objects.clear();
        into.objects.extend(states.iter().map(|s| Seen {
            id: s.id as usize,
            kind: kind(s.class),
            vehicle_from_box: vehicle_from_world * s.world_from_object,
            size: s.size,
        }));
        into.data = SweepData {
            frame: index as u64,
            stamp_s: sweep.stamp_s,
            points: sweep.points,
            world_from_vehicle: self.tilt * sweep.world_from_vehicle,
            twist: sweep.twist,
            dropped: SourceGaps::default(),
        };
        Ok(())
    }

    fn sees(&self, _: DVec3) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn every_rig_drives_through_every_scenery_and_half_of_the_streets_are_plain() {
        let mut drives: BTreeMap<_, usize> = BTreeMap::new();
        for n in 0..(RIGS.len() * SCENERIES.len()) as u64 {
            *drives.entry((n % RIGS.len() as u64, varied(n).name())).or_default() += 1;
        }
        for rig in 0..RIGS.len() as u64 {
            let of = |scenery: Scenery| drives.get(&(rig, scenery.name())).copied();
            assert_eq!(of(Scenery::Street), Some(SCENERIES.len() / 2), "{drives:?}");
            let others = [Scenery::StreetCluttered, Scenery::StreetNarrow, Scenery::StreetBroad];
            assert_eq!(others.map(of), [Some(1); 3], "{drives:?}");
        }
    }
}
