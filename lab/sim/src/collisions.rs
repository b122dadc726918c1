//! For tests: checks that nothing in a scene overlaps anything else.

use crate::object::Fixture;
use crate::path::Path;
use crate::scene::Scene;
use glam::DVec3;
use raywake_core::pose::Pose;

/// Points of a box standing at a pose, low, at half its height and high, at most 0.3 m apart and
/// well inside it.
fn points(pose: &Pose, size: [f64; 3]) -> Vec<DVec3> {
    let [count_x, count_y] = [size[0], size[1]].map(|length| (length / 0.3).ceil() as u32);
    let along =
        |n: u32, count: u32, length: f64| 0.95 * length * (f64::from(n) / f64::from(count) - 0.5);
    let mut points = Vec::new();
    for i in 0..=count_x {
        for j in 0..=count_y {
            for up in [0.3, 0.5 * size[2], 0.9 * size[2]] {
                let at = DVec3::new(along(i, count_x, size[0]), along(j, count_y, size[1]), up);
                points.push(pose.transform(at));
            }
        }
    }
    points
}

fn holds(fixture: &Fixture, point: DVec3) -> bool {
    let at = fixture.pose.inverse().transform(point).abs();
    (fixture.shape.half() - at).min_element() > 0.0
}

/// Panics if an object, or the vehicle of this size on its path, overlaps a fixture or another of
/// them within six seconds.
pub(crate) fn check_clear(
    name: &str,
    scene: &Scene,
    fixtures: &[Fixture],
    vehicle: Option<(&Path, [f64; 3])>,
) {
    let others = scene.objects.iter().map(|o| (&o.path, o.size));
    let all: Vec<_> = others.chain(vehicle).collect();
    for step in 0..=12 {
        let t = 0.5 * f64::from(step);
        let place = |(path, size): &(&Path, [f64; 3])| {
            let at = path.at(t);
            let pose = Pose::planar(at.x, at.y, scene.ground.height(at.x, at.y), at.yaw);
            (pose, *size, 0.5 * DVec3::from_array(*size).length())
        };
        let boxes: Vec<_> = all.iter().map(place).collect();
        for (n, (pose, size, reach)) in boxes.iter().enumerate() {
            if step > 0 && all[n].0.is_static() {
                continue;
            }
            let apart = |other: DVec3| (other - pose.translation).length() - reach;
            let near = |f: &&Fixture| apart(f.pose.translation) < f.shape.reach() + 1.0;
            let close: Vec<_> = fixtures.iter().filter(near).collect();
            let mut others: Vec<_> = boxes.iter().enumerate().filter(|(m, _)| *m != n).collect();
            others.retain(|(_, (other, _, reach))| apart(other.translation) < *reach);
            for point in points(pose, *size) {
                let hit = close.iter().find(|f| holds(f, point));
                assert!(hit.is_none(), "{name}, {t} s: {n} of {size:?} at {point} in {hit:?}");
                for (m, (other, size, _)) in &others {
                    let at = other.inverse().transform(point).abs();
                    let inside = at.x < 0.5 * size[0] && at.y < 0.5 * size[1];
                    assert!(!inside, "{name}, {t} s: {n} and {m} at {point}");
                }
            }
        }
    }
}
