//! Casting of one sweep: every column of every sensor at its own time, from the moving vehicle,
//! into the scene as it is at that time.

use crate::clutter::{Air, Clutter};
use crate::object::Surface;
use crate::rig::{Firing, SensorRig, stamp_s};
use crate::rng::Rng;
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::static_scene::StaticScene;
use crate::target::{Fan, Hit, Ray, Target};
use crate::truth::{Motions, Truth};
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

/// Returns with their truth.
pub(crate) type Returns = (Vec<Point>, Vec<Truth>);

/// A scene and a rig, prepared for casting.
pub(crate) struct Caster<'a> {
    scene: &'a Scene,
    static_scene: &'a StaticScene,
    rig: &'a SensorRig,
    clutter: Clutter,
    /// Moving objects: index and radius.
    movers: Vec<(usize, f64)>,
    /// Directions of every sensor's beams at azimuth 0, and its [`Sensor::spread`].
    beams: Vec<(Vec<DVec3>, f64)>,
}

/// The beams' directions in the sensor's frame for a column at azimuth 0.
fn directions(sensor: &Sensor) -> Vec<DVec3> {
    let beams = sensor.beams.iter().map(|b| {
        let ((se, ce), (sa, ca)) = (b.elevation.sin_cos(), b.azimuth.sin_cos());
        DVec3::new(ce * ca, ce * sa, se)
    });
    beams.collect()
}

impl<'a> Caster<'a> {
    pub(crate) fn new(
        scene: &'a Scene,
        static_scene: &'a StaticScene,
        rig: &'a SensorRig,
        clutter: Clutter,
    ) -> Caster<'a> {
        let objects = scene.objects.iter().enumerate();
        let movers = objects.filter(|(_, o)| !o.is_static()).map(|(i, o)| (i, o.reach())).collect();
        let beams = rig.mounts.iter().map(|m| (directions(&m.sensor), m.sensor.spread())).collect();
        Caster { scene, static_scene, rig, clutter, movers, beams }
    }

    /// Casts sweep `index` on `threads` threads, whose number does not affect the result; `ego` is
    /// `street_from_vehicle` over time.
    pub(crate) fn sweep(
        &self,
        ego: &(dyn Fn(f64) -> Pose + Sync),
        index: usize,
        seed: u64,
        threads: usize,
    ) -> Returns {
        let firings = self.rig.firings(index);
        let share = firings.len().div_ceil(threads.max(1)).max(1);
        let cast = |first: usize| {
            let mut returns = Returns::default();
            let last = (first + share).min(firings.len());
            for (number, firing) in (first..).zip(&firings[first.min(last)..last]) {
                let t = stamp_s(index) + firing.offset_s;
                self.column(firing, t, ego(t), Rng::split(seed, number as u64), &mut returns);
            }
            returns
        };
        let cast = &cast;
        std::thread::scope(|scope| {
            let starts = (share..firings.len()).step_by(share);
            let rest: Vec<_> = starts.map(|first| scope.spawn(move || cast(first))).collect();
            let (mut points, mut truth) = cast(0);
            for handle in rest {
                let (p, t) = handle.join().expect("a casting thread panicked");
                points.extend(p);
                truth.extend(t);
            }
            (points, truth)
        })
    }

    /// Casts all beams of one column, fired at time `t` from a vehicle at `ego`.
    fn column(&self, firing: &Firing, t: f64, ego: Pose, mut rng: Rng, returns: &mut Returns) {
        let mount = &self.rig.mounts[firing.mount];
        let sensor = &mount.sensor;
        let street_from_sensor = ego * mount.vehicle_from_sensor;
        let turn = street_from_sensor.matrix();
        let fan = self.fan(firing, street_from_sensor);
        let moving = self.moving_targets(&fan, t);
        let air = Air::about(self.clutter, self.scene, &fan, t);
        let mut motions = Motions::at(self.scene, t);
        for nominal in self.rays(firing) {
            let ray = Ray {
                origin: fan.origin,
                direction: turn * disturbed(sensor, nominal, &mut rng),
                seed: rng.bits(),
            };
            let hit = self.nearest(&ray, sensor, &moving);
            if let Some(range) = air.echo(&ray, hit.map_or(sensor.range[1], |hit| hit.range)) {
                let (range, intensity) = diffuse(sensor, range, &mut rng);
                if (sensor.range[0]..sensor.range[1]).contains(&range) {
                    returns.0.push(mount.point(firing, nominal * range, intensity));
                    returns.1.push(Truth::CLUTTER);
                }
                continue;
            }
            let Some(hit) = hit else {
                continue;
            };
            let transmittance = air.transmittance(hit.range);
            let Some((range, intensity)) = measured(sensor, &hit, transmittance, &mut rng) else {
                continue;
            };
            returns.0.push(mount.point(firing, nominal * range, intensity));
            returns.1.push(motions.truth(&hit, ray.origin + ray.direction * hit.range));
        }
    }

    /// Nominal directions of a column's rays in the sensor's frame.
    fn rays(&self, firing: &Firing) -> impl Iterator<Item = DVec3> {
        let (s, c) = firing.azimuth.sin_cos();
        let turned = move |b: &DVec3| DVec3::new(b.x * c - b.y * s, b.x * s + b.y * c, b.z);
        self.beams[firing.mount].0.iter().map(turned)
    }

    fn fan(&self, firing: &Firing, street_from_sensor: Pose) -> Fan {
        let (s, c) = firing.azimuth.sin_cos();
        let turn = street_from_sensor.matrix();
        Fan {
            origin: street_from_sensor.translation,
            forward: turn * DVec3::new(c, s, 0.0),
            across: turn * DVec3::new(-s, c, 0.0),
            spread: self.beams[firing.mount].1,
            range: self.rig.mounts[firing.mount].sensor.range[1],
        }
    }

    /// The parts of moving objects that a column can hit.
    fn moving_targets(&self, fan: &Fan, t: f64) -> Vec<Target> {
        let mut targets = Vec::new();
        for &(index, reach) in &self.movers {
            let object = &self.scene.objects[index];
            let place = object.path.at(t);
            // A cheap test first: the centre is at most its height from the road below it.
            let foot = DVec3::new(place.x, place.y, self.scene.ground.height(place.x, place.y));
            if !fan.meets(foot, 2.0 * reach + 0.5) {
                continue;
            }
            let pose = object.pose(&self.scene.ground, t);
            for (p, part) in object.parts.iter().enumerate() {
                let target = Target::of_part(index, object, p, pose * part.pose(t), true);
                if fan.meets(target.centre, target.reach) {
                    targets.push(target);
                }
            }
        }
        targets
    }

    fn nearest<'t>(&'t self, ray: &Ray, sensor: &Sensor, moving: &'t [Target]) -> Option<Hit<'t>> {
        let farthest = sensor.range[1];
        let mut best = Hit { range: farthest, cosine: 0.0, target: None };
        if let Some(c) = self.scene.ground.contact(ray.origin, ray.direction) {
            best = Hit { range: c.range, cosine: c.cosine, target: None };
        }
        for target in moving {
            best.consider(ray, target);
        }
        self.static_scene.nearest(ray, &mut best);
        (best.cosine > 0.0 && best.range < farthest).then_some(best)
    }
}

/// The true direction of a ray: the nominal one plus the angular noise.
fn disturbed(sensor: &Sensor, u: DVec3, rng: &mut Rng) -> DVec3 {
    let noise = sensor.angle_noise;
    if noise == 0.0 {
        return u;
    }
    let (a, b) = (noise * rng.bell(), noise * rng.bell());
    let v = u + DVec3::new(-a * u.y, a * u.x, b);
    v / v.dot(v).sqrt()
}

/// Measured range and intensity of a return from something too fine to be a surface.
fn diffuse(sensor: &Sensor, range: f64, rng: &mut Rng) -> (f64, f64) {
    (range + sensor.range_noise * rng.bell(), 0.08 * rng.unit())
}

/// Measured range and intensity, if there is a return; `transmittance` is the share of the light
/// that the air lets through.
fn measured(sensor: &Sensor, hit: &Hit, transmittance: f64, rng: &mut Rng) -> Option<(f64, f64)> {
    let asphalt = Surface::matt(0.2);
    let surface = hit.target.map_or(asphalt, |t| t.surface);
    let signal = sensor.signal * surface.reflectivity * hit.cosine / (hit.range * hit.range);
    let signal = transmittance * signal;
    let kept = (1.0 - surface.loss) * (1.0 - sensor.dropout) * (1.0 - (-signal).exp());
    let (lost, noise) = (!rng.chance(kept), rng.bell());
    let range = hit.range + sensor.range_noise * noise;
    if lost || range < sensor.range[0] || range >= sensor.range[1] {
        return None;
    }
    let intensity = surface.reflectivity * (0.4 + 0.6 * hit.cosine) + 0.02 * rng.bell();
    Some((range, intensity.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_moving_part_is_overlooked() {
        let mut hits = 0;
        for (name, seed) in SensorRig::NAMES.into_iter().zip(0..) {
            let rig: SensorRig = name.parse().unwrap();
            let (scene, mut rng) = (Scene::street(seed), Rng::new(seed));
            let static_scene = StaticScene::new(&scene);
            let caster = Caster::new(&scene, &static_scene, &rig, Clutter::None);
            for firing in rig.firings(30).iter().step_by(31) {
                let t = stamp_s(30) + firing.offset_s;
                let mount = &rig.mounts[firing.mount];
                let ego = Pose::planar(0.0, -1.75, 0.4, 0.1) * mount.vehicle_from_sensor;
                let near = caster.moving_targets(&caster.fan(firing, ego), t);
                let objects = scene.objects.iter().enumerate().filter(|(_, o)| !o.is_static());
                let parts = objects.flat_map(|(i, o)| (0..o.parts.len()).map(move |p| (i, o, p)));
                let place = |(i, o, p): (usize, &crate::Object, usize)| {
                    Target::of_part(i, o, p, o.part_pose(p, &scene.ground, t), true)
                };
                let all: Vec<Target> = parts.map(place).collect();
                for nominal in caster.rays(firing) {
                    let direction = ego.matrix() * disturbed(&mount.sensor, nominal, &mut rng);
                    let ray = Ray { origin: ego.translation, direction, seed: rng.bits() };
                    let found = caster.nearest(&ray, &mount.sensor, &near);
                    assert_eq!(found, caster.nearest(&ray, &mount.sensor, &all), "{name}");
                    hits += usize::from(
                        found.is_some_and(|h| h.target.is_some_and(|t| t.mover.is_some())),
                    );
                }
            }
        }
        assert!(hits > 200, "{hits}");
    }
}
