//! Casting one turn of the sensor: every column at its own time, from the moving vehicle, at the
//! scene as it is at that time.

use crate::object::{Class, Surface};
use crate::rng::Rng;
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::target::{Fan, Target};
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

/// What a return really comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Id of the object, 0 for the static background.
    pub object: u32,
    /// What it is.
    pub class: Class,
    /// Velocity over ground of the very point that was hit, at the ray's time, along world axes,
    /// m/s: a turning car's corners differ, a walker's leg is faster than the walker.
    pub velocity_world: [f32; 3],
}

/// Half the step of the central difference that gives velocities, s.
const STEP_S: f64 = 5e-4;
/// A scene and a sensor, prepared.
pub(crate) struct Caster<'a> {
    scene: &'a Scene,
    sensor: &'a Sensor,
    /// All that never moves.
    still: Vec<Target>,
    /// Objects that move: index and radius.
    movers: Vec<(usize, f64)>,
    /// Directions of the beams at azimuth 0.
    beams: Vec<DVec3>,
}

/// The nearest surface on a ray.
struct Hit<'t> {
    range: f64,
    cosine: f64,
    target: Option<&'t Target>,
}

impl<'a> Caster<'a> {
    pub(crate) fn new(scene: &'a Scene, sensor: &'a Sensor) -> Caster<'a> {
        let mut still: Vec<Target> = scene
            .fixtures
            .iter()
            .map(|f| Target::solid(f.shape, f.pose, f.surface, f.class))
            .collect();
        let mut movers = Vec::new();
        for (index, object) in scene.objects.iter().enumerate() {
            if object.is_still() {
                let poses =
                    (0..object.parts.len()).map(|p| object.part_pose(p, &scene.ground, 0.0));
                still.extend(
                    poses
                        .enumerate()
                        .map(|(p, pose)| Target::of_part(index, object, p, pose, false)),
                );
            } else {
                movers.push((index, object.reach()));
            }
        }
        let beams = sensor.beams.iter().map(|b| {
            let ((se, ce), (sa, ca)) = (b.elevation.sin_cos(), b.azimuth.sin_cos());
            DVec3::new(ce * ca, ce * sa, se)
        });
        Caster { scene, sensor, still, movers, beams: beams.collect() }
    }

    /// The sweep stamped `stamp_s`, `ego` being `street_from_sensor` over time; cast by `threads`
    /// threads, the number of which does not show in the result.
    pub(crate) fn sweep(
        &self,
        ego: &(dyn Fn(f64) -> Pose + Sync),
        stamp_s: f64,
        seed: u64,
        threads: usize,
    ) -> (Vec<Point>, Vec<Truth>) {
        let here = ego(stamp_s).translation;
        // The vehicle moves a few metres at most in half a turn.
        let range = self.sensor.range[1] + 5.0;
        let near: Vec<&Target> =
            self.still.iter().filter(|t| (t.centre - here).length() < range + t.reach).collect();
        let columns = self.sensor.columns;
        let share = columns.div_ceil(threads.max(1)).max(1);
        let cast = |first: usize| {
            let (mut points, mut truth) = (Vec::new(), Vec::new());
            for column in first..(first + share).min(columns) {
                let t = stamp_s + self.sensor.offset_s(column);
                let rng = Rng::split(seed, column as u64);
                self.column(column, t, ego(t), &near, rng, &mut points, &mut truth);
            }
            (points, truth)
        };
        let cast = &cast;
        std::thread::scope(|scope| {
            let rest: Vec<_> = (share..columns)
                .step_by(share)
                .map(|first| scope.spawn(move || cast(first)))
                .collect();
            let (mut points, mut truth) = cast(0);
            for handle in rest {
                let (p, t) = handle.join().expect("a casting thread panicked");
                points.extend(p);
                truth.extend(t);
            }
            (points, truth)
        })
    }

    /// Appends the returns of one column, top beam first.
    fn column(
        &self,
        column: usize,
        t: f64,
        ego: Pose,
        near: &[&Target],
        mut rng: Rng,
        points: &mut Vec<Point>,
        truth: &mut Vec<Truth>,
    ) {
        let (s, c) = self.sensor.azimuth(column).sin_cos();
        let turn = ego.matrix();
        let across = turn * DVec3::new(-s, c, 0.0);
        let fan = Fan { origin: ego.translation, forward: turn * DVec3::new(c, s, 0.0), across };
        let range = self.sensor.range[1];
        let moving = self.moving_targets(&fan, t);
        let still = near.iter().copied().filter(|x| fan.meets(x.centre, x.reach, range));
        let targets: Vec<&Target> = still.chain(&moving).collect();
        for beam in &self.beams {
            let nominal = DVec3::new(beam.x * c - beam.y * s, beam.x * s + beam.y * c, beam.z);
            let ray = turn * self.disturbed(nominal, &mut rng);
            let Some(hit) = self.nearest(fan.origin, ray, &targets, &mut rng) else {
                continue;
            };
            let Some((range, intensity)) = self.measured(&hit, &mut rng) else {
                continue;
            };
            points.push(Point {
                position: (nominal * range).as_vec3().to_array(),
                intensity: intensity as f32,
                offset_s: self.sensor.offset_s(column) as f32,
                sensor: 0,
            });
            truth.push(self.truth(&hit, fan.origin + ray * hit.range, t));
        }
    }

    /// The parts of moving objects that a column can meet.
    fn moving_targets(&self, fan: &Fan, t: f64) -> Vec<Target> {
        let range = self.sensor.range[1];
        let mut targets = Vec::new();
        for &(index, reach) in &self.movers {
            let object = &self.scene.objects[index];
            let place = object.path.at(t);
            // A cheap look first: the centre is at most its height off the road below it.
            let foot = DVec3::new(place.x, place.y, self.scene.ground.height(place.x, place.y));
            if !fan.meets(foot, 2.0 * reach + 0.5, range) {
                continue;
            }
            let pose = object.pose(&self.scene.ground, t);
            for (p, part) in object.parts.iter().enumerate() {
                let target = Target::of_part(index, object, p, pose * part.pose(t), true);
                if fan.meets(target.centre, target.reach, range) {
                    targets.push(target);
                }
            }
        }
        targets
    }

    /// The direction a ray really takes: off its nominal one by the angular noise.
    fn disturbed(&self, u: DVec3, rng: &mut Rng) -> DVec3 {
        let noise = self.sensor.angle_noise;
        if noise == 0.0 {
            return u;
        }
        let (a, b) = (noise * rng.bell(), noise * rng.bell());
        let v = u + DVec3::new(-a * u.y, a * u.x, b);
        v / v.dot(v).sqrt()
    }

    fn nearest<'t>(
        &self,
        o: DVec3,
        d: DVec3,
        targets: &[&'t Target],
        rng: &mut Rng,
    ) -> Option<Hit<'t>> {
        let mut best = Hit { range: self.sensor.range[1], cosine: 0.0, target: None };
        if let Some(c) = self.scene.ground.contact(o, d) {
            best = Hit { range: c.range, cosine: c.cosine, target: None };
        }
        for &target in targets {
            let Some(c) = target.shape.cross(target.turn * (o - target.centre), target.turn * d)
            else {
                continue;
            };
            let mut range = c.near;
            if target.surface.porosity > 0.0 && range < best.range {
                if rng.chance(target.surface.porosity) {
                    continue;
                }
                // Leaves return from within, mostly from the outer ones.
                let u = rng.unit();
                range += 0.6 * u * u * (c.far - c.near);
            }
            if range < best.range {
                best = Hit { range, cosine: c.cosine, target: Some(target) };
            }
        }
        (best.cosine > 0.0 && best.range < self.sensor.range[1]).then_some(best)
    }

    /// Range and intensity as measured, where there is a return.
    fn measured(&self, hit: &Hit, rng: &mut Rng) -> Option<(f64, f64)> {
        let asphalt = Surface::matt(0.2);
        let surface = hit.target.map_or(asphalt, |t| t.surface);
        let signal =
            self.sensor.signal * surface.reflectivity * hit.cosine / (hit.range * hit.range);
        let kept = (1.0 - surface.loss) * (1.0 - self.sensor.dropout) * (1.0 - (-signal).exp());
        let (lost, noise) = (!rng.chance(kept), rng.bell());
        let range = hit.range + self.sensor.range_noise * noise;
        if lost || range < self.sensor.range[0] || range >= self.sensor.range[1] {
            return None;
        }
        let intensity = surface.reflectivity * (0.4 + 0.6 * hit.cosine) + 0.02 * rng.bell();
        Some((range, intensity.clamp(0.0, 1.0)))
    }

    fn truth(&self, hit: &Hit, at: DVec3, t: f64) -> Truth {
        let Some(target) = hit.target else {
            return Truth::default();
        };
        let velocity = target.mover.map_or(DVec3::ZERO, |(index, part)| {
            let object = &self.scene.objects[index];
            let pose = |t: f64| object.part_pose(part, &self.scene.ground, t);
            let fixed = pose(t).inverse().transform(at);
            let moved = pose(t + STEP_S).transform(fixed) - pose(t - STEP_S).transform(fixed);
            self.scene.world_from_street.rotation * (moved / (2.0 * STEP_S))
        });
        let velocity_world = velocity.as_vec3().to_array();
        Truth { object: target.object, class: target.class, velocity_world }
    }
}
