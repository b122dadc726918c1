//! Everything that never moves, in a bounding volume hierarchy.

use crate::scene::Scene;
use crate::target::{Hit, Ray, Target};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray as BoxRay, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use std::fmt;
use std::time::Duration;

/// How much every box exceeds its solid, m. The hierarchy is in single precision, which is accurate
/// to 0.001 m within 8 km of the street's origin: with this margin boxes never lose a hit.
const MARGIN: f64 = 0.02;

/// Fixtures and parked objects.
#[derive(Clone)]
pub(crate) struct StaticScene {
    targets: Vec<Target>,
    boxes: Bvh2,
}

impl fmt::Debug for StaticScene {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Still({} targets)", self.targets.len())
    }
}

impl Boundable for Target {
    fn aabb(&self) -> Aabb {
        let half = self.half() + DVec3::splat(MARGIN);
        let corner = |v: DVec3| Vec3A::from(v.as_vec3());
        Aabb::new(corner(self.centre - half), corner(self.centre + half))
    }
}

impl StaticScene {
    pub(crate) fn new(scene: &Scene) -> StaticScene {
        let fixtures = (1..).zip(&scene.fixtures);
        let mut targets: Vec<Target> =
            fixtures.map(|(n, f)| Target::solid(f.shape, f.pose, f.surface, f.class, n)).collect();
        for (index, object) in scene.objects.iter().enumerate().filter(|(_, o)| o.is_static()) {
            let part = |p| {
                let pose = object.part_pose(p, &scene.ground, 0.0);
                Target::of_part(index, object, p, pose, false)
            };
            targets.extend((0..object.parts.len()).map(part));
        }
        let build = BvhBuildParams::medium_build();
        let boxes = build_bvh2(&targets, build, &mut Duration::default());
        StaticScene { targets, boxes }
    }

    /// Replaces the hit if the ray meets one of these targets nearer.
    pub(crate) fn nearest<'t>(&'t self, ray: &Ray, best: &mut Hit<'t>) {
        // Rounded away from the origin, so that the hit's own box and those just behind it are not
        // cut off.
        let beyond = |range: f64| (range + MARGIN) as f32;
        let [origin, direction] = [ray.origin, ray.direction].map(|v| Vec3A::from(v.as_vec3()));
        let through = BoxRay::new(origin, direction, 0.0, beyond(best.range));
        self.boxes.ray_traverse(through, &mut RayHit::none(), |_, entry| {
            let index = self.boxes.primitive_indices[entry] as usize;
            let taken = best.consider(ray, &self.targets[index]);
            if taken { beyond(best.range) } else { f32::INFINITY }
        });
    }

    /// The same by testing every target.
    #[cfg(test)]
    pub(crate) fn nearest_of_all<'t>(&'t self, ray: &Ray, best: &mut Hit<'t>) {
        for target in &self.targets {
            best.consider(ray, target);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn equals_brute_force_over_all_targets() {
        let mut hits = 0;
        for seed in 0..4 {
            let scene = Scene::street(seed);
            let still = StaticScene::new(&scene);
            let mut rng = Rng::new(seed);
            for n in 0..4000 {
                let mut any = || DVec3::new(rng.bell(), rng.bell(), 0.2 * rng.bell());
                let mut direction = any().normalize();
                if n % 8 == 0 {
                    // Along an axis, where the box test divides by zero.
                    direction = [DVec3::X, DVec3::Y, -DVec3::X, DVec3::Z][n / 8 % 4];
                }
                let origin = 10.0 * any() + DVec3::new(0.0, 0.0, 3.0);
                let ray = Ray { origin, direction, seed: rng.bits() };
                let nothing = Hit { range: 120.0, cosine: 0.0, target: None };
                let (mut fast, mut all) = (nothing, nothing);
                still.nearest(&ray, &mut fast);
                still.nearest_of_all(&ray, &mut all);
                assert_eq!(fast, all, "{ray:?}");
                hits += usize::from(fast.target.is_some());
            }
        }
        assert!(hits > 8000, "{hits}");
    }

    #[test]
    fn nothing_at_all() {
        let still = StaticScene::new(&Scene::empty());
        let mut hit = Hit { range: 9.0, cosine: 0.0, target: None };
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::X, seed: 1 };
        still.nearest(&ray, &mut hit);
        assert_eq!((hit.range, hit.target), (9.0, None));
    }
}
