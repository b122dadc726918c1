//! The position of each sensor over a sweep, as the vehicle carries it along.

use crate::frame::central;
use crate::params::SENSORS_MAX;
use crate::prepare::Placement;
use crate::thinning::TakenPoints;
use core::array::from_fn;

/// The position of each sensor over a sweep: on a straight line, from which a sensor 2 m from the
/// vehicle's centre strays by less than a millimetre if the vehicle turns by 0.05 rad in the time.
#[derive(Clone, Copy)]
pub(crate) struct SensorPaths {
    /// Number of sensors.
    pub sensors: usize,
    /// Position of each as the sweep begins, voxels from the window's corner.
    from: [[f32; 3]; SENSORS_MAX],
    /// Displacement of each until the sweep ends, voxels.
    by: [[f32; 3]; SENSORS_MAX],
    /// Start of the sweep relative to its stamp, s.
    from_s: f32,
    /// Sweeps per second, 0 if a sweep takes no time.
    per_s: f32,
}

impl SensorPaths {
    /// No sensors.
    pub const NOWHERE: SensorPaths = SensorPaths {
        sensors: 0,
        from: [[0.0; 3]; SENSORS_MAX],
        by: [[0.0; 3]; SENSORS_MAX],
        from_s: 0.0,
        per_s: 0.0,
    };

    /// The paths of a sweep.
    pub fn new(placement: &Placement) -> SensorPaths {
        let Placement { profile, rig, .. } = *placement;
        let [from_s, to_s] = [0.0, 1.0].map(|turn| rig.timing.at(turn));
        let mut paths = SensorPaths {
            sensors: rig.sensors.len(),
            from_s: from_s as f32,
            ..SensorPaths::NOWHERE
        };
        if to_s > from_s {
            paths.per_s = (1.0 / (to_s - from_s)) as f32;
        }
        let middle = central(profile);
        for (sensor, mounted) in rig.sensors.iter().enumerate() {
            let at = |offset_s: f64| {
                let at = placement.sensor(mounted, offset_s).to_array();
                from_fn(|a| (at[a] + 0.5) as f32 + middle[a] as f32)
            };
            let (from, to): ([f32; 3], [f32; 3]) = (at(from_s), at(to_s));
            (paths.from[sensor], paths.by[sensor]) = (from, from_fn(|a| to[a] - from[a]));
        }
        paths
    }

    /// Two sensors at rest.
    #[cfg(test)]
    pub const fn at_rest([first, second]: [[f32; 3]; 2]) -> SensorPaths {
        let mut paths = SensorPaths { sensors: 2, ..SensorPaths::NOWHERE };
        (paths.from[0], paths.from[1]) = (first, second);
        paths
    }

    /// The sensor of a return that is placed. If there is only one, nothing is looked up.
    #[inline(always)]
    pub fn sensor_of(&self, points: TakenPoints, n: usize) -> u32 {
        if self.sensors == 1 { 0 } else { points.get(n).sensor }
    }

    /// The fraction of the sweep that has passed at an offset from its stamp, s: 0 to 1.
    #[inline(always)]
    pub fn part(&self, offset_s: f32) -> f32 {
        ((offset_s - self.from_s) * self.per_s).clamp(0.0, 1.0)
    }

    /// Position of a sensor as the sweep begins, voxels from the window's corner, and its
    /// displacement until the sweep ends.
    #[inline(always)]
    pub fn line(&self, sensor: usize) -> [[f32; 3]; 2] {
        [self.from[sensor], self.by[sensor]]
    }

    /// Position of a sensor at a fraction of the sweep, voxels from the window's corner.
    pub fn at(&self, sensor: usize, part: f32) -> [f32; 3] {
        let [from, by] = self.line(sensor);
        from_fn(|a| from[a] + part * by[a])
    }
}
