//! The solids a scene is made of, and where a ray enters and leaves them.

use glam::DVec3;

/// A solid centred on the origin of its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Half extents, m.
        half: DVec3,
    },
    /// A closed cylinder about the z axis.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half height, m.
        half: f64,
    },
    /// An ellipsoid aligned with the axes.
    Ellipsoid {
        /// Half axes, m.
        radii: DVec3,
    },
}

/// A ray that starts outside a solid and passes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the ray at which it enters, in multiples of its direction's length.
    pub near: f64,
    /// Distance at which it leaves.
    pub far: f64,
    /// Cosine of the angle between ray and surface normal where it enters, 0..1.
    pub cosine: f64,
}

impl Shape {
    /// A box of these full extents.
    pub fn cuboid(length: f64, width: f64, height: f64) -> Shape {
        Shape::Cuboid { half: DVec3::new(length, width, height) * 0.5 }
    }

    /// A cylinder of this radius and full height.
    pub fn cylinder(radius: f64, height: f64) -> Shape {
        Shape::Cylinder { radius, half: 0.5 * height }
    }

    /// An ellipsoid of these half axes.
    pub fn ellipsoid(x: f64, y: f64, z: f64) -> Shape {
        Shape::Ellipsoid { radii: DVec3::new(x, y, z) }
    }

    /// Radius of the sphere around the origin that contains the solid, m.
    pub fn reach(&self) -> f64 {
        match *self {
            Shape::Cuboid { half } => half.length(),
            Shape::Cylinder { radius, half } => (radius * radius + half * half).sqrt(),
            Shape::Ellipsoid { radii } => radii.max_element(),
        }
    }

    /// Half extents of the axis-aligned box that contains the solid, m.
    pub fn half(&self) -> DVec3 {
        match *self {
            Shape::Cuboid { half } => half,
            Shape::Cylinder { radius, half } => DVec3::new(radius, radius, half),
            Shape::Ellipsoid { radii } => radii,
        }
    }

    /// Where the ray from `origin` along the unit vector `direction` crosses the solid, if it
    /// starts outside and hits it.
    pub fn cross(&self, origin: DVec3, direction: DVec3) -> Option<Crossing> {
        let crossing = match *self {
            Shape::Cuboid { half } => cross_cuboid(half, origin, direction),
            Shape::Cylinder { radius, half } => cross_cylinder(radius, half, origin, direction),
            Shape::Ellipsoid { radii } => cross_ellipsoid(radii, origin, direction),
        };
        crossing.filter(|c| c.near > 0.0)
    }
}

/// Interval of the ray within |x| <= half along one axis; everything or nothing if the ray is
/// parallel to the slab.
fn slab(half: f64, origin: f64, direction: f64) -> (f64, f64) {
    if direction.abs() < 1e-12 {
        let inside = origin.abs() <= half;
        return if inside {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            (f64::INFINITY, f64::NEG_INFINITY)
        };
    }
    let (a, b) = ((-half - origin) / direction, (half - origin) / direction);
    if a < b { (a, b) } else { (b, a) }
}

fn cross_cuboid(half: DVec3, o: DVec3, d: DVec3) -> Option<Crossing> {
    let (mut near, mut far, mut cosine) = (f64::NEG_INFINITY, f64::INFINITY, 0.0);
    for axis in 0..3 {
        let (a, b) = slab(half[axis], o[axis], d[axis]);
        if a > near {
            near = a;
            cosine = d[axis].abs();
        }
        far = far.min(b);
    }
    (near < far).then_some(Crossing { near, far, cosine })
}

fn cross_cylinder(radius: f64, half: f64, o: DVec3, d: DVec3) -> Option<Crossing> {
    let (mut near, mut far) = slab(half, o.z, d.z);
    let mut cosine = d.z.abs();
    let a = d.x * d.x + d.y * d.y;
    let c = o.x * o.x + o.y * o.y - radius * radius;
    if a < 1e-18 {
        return (c <= 0.0 && near < far).then_some(Crossing { near, far, cosine });
    }
    let b = o.x * d.x + o.y * d.y;
    let disc = b * b - a * c;
    if disc <= 0.0 {
        return None;
    }
    let root = disc.sqrt();
    let side = (-b - root) / a;
    if side > near {
        near = side;
        cosine = root / radius;
    }
    far = far.min((-b + root) / a);
    (near < far).then_some(Crossing { near, far, cosine })
}

fn cross_ellipsoid(radii: DVec3, o: DVec3, d: DVec3) -> Option<Crossing> {
    // In coordinates scaled by the half axes it is the unit sphere.
    let (p, q) = (o / radii, d / radii);
    let (a, b, c) = (q.dot(q), p.dot(q), p.dot(p) - 1.0);
    let disc = b * b - a * c;
    if disc <= 0.0 {
        return None;
    }
    let root = disc.sqrt();
    let near = (-b - root) / a;
    let normal = (p + q * near) / radii;
    let cosine = d.dot(normal).abs() / normal.dot(normal).sqrt();
    Some(Crossing { near, far: (-b + root) / a, cosine })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn cuboid_in_closed_form() {
        let s = Shape::cuboid(4.0, 2.0, 1.0);
        let c = s.cross(DVec3::new(-10.0, 0.5, 0.0), DVec3::X).unwrap();
        assert!(close(c.near, 8.0) && close(c.far, 12.0) && close(c.cosine, 1.0));
        // At 45 degrees from (-3.5, -5): enters y = -1 at 4 sqrt 2, leaves through x = 2 after
        // that.
        let d = DVec3::new(1.0, 1.0, 0.0) / 2f64.sqrt();
        let c = s.cross(DVec3::new(-3.5, -5.0, 0.0), d).unwrap();
        assert!(close(c.near, 4.0 * 2f64.sqrt()) && close(c.far, 5.5 * 2f64.sqrt()));
        assert!(close(c.cosine, 0.5f64.sqrt()));
        assert!(s.cross(DVec3::new(-10.0, 1.1, 0.0), DVec3::X).is_none());
        assert!(s.cross(DVec3::new(10.0, 0.0, 0.0), DVec3::X).is_none(), "behind");
        assert!(s.cross(DVec3::ZERO, DVec3::X).is_none(), "inside");
    }

    #[test]
    fn cylinder_in_closed_form() {
        let s = Shape::cylinder(0.5, 3.0);
        let c = s.cross(DVec3::new(-10.0, 0.3, 1.0), DVec3::X).unwrap();
        assert!(close(c.near, 9.6) && close(c.far, 10.4) && close(c.cosine, 0.8));
        let c = s.cross(DVec3::new(0.2, 0.1, 9.0), -DVec3::Z).unwrap();
        assert!(close(c.near, 7.5) && close(c.far, 10.5) && close(c.cosine, 1.0));
        // Through the lid: from (-1, 0, 2.5) down at 45 degrees the height 1.5 is met at x = 0.
        let d = DVec3::new(1.0, 0.0, -1.0) / 2f64.sqrt();
        let c = s.cross(DVec3::new(-1.0, 0.0, 2.5), d).unwrap();
        assert!(close(c.near, 2f64.sqrt()) && close(c.cosine, 0.5f64.sqrt()));
        assert!(s.cross(DVec3::new(-10.0, 0.6, 0.0), DVec3::X).is_none());
        assert!(s.cross(DVec3::new(-10.0, 0.0, 1.6), DVec3::X).is_none());
    }

    #[test]
    fn ellipsoid_in_closed_form() {
        let s = Shape::ellipsoid(2.0, 1.0, 0.5);
        let c = s.cross(DVec3::new(-10.0, 0.0, 0.0), DVec3::X).unwrap();
        assert!(close(c.near, 8.0) && close(c.far, 12.0) && close(c.cosine, 1.0));
        // At y = 0.6 the chord is 2 * 2 * 0.8 long.
        let c = s.cross(DVec3::new(-10.0, 0.6, 0.0), DVec3::X).unwrap();
        assert!(close(c.near, 8.4) && close(c.far, 11.6));
        // Normal there: (x/4, y/1) = (-0.4, 0.6).
        assert!(close(c.cosine, 0.4 / 0.52f64.sqrt()));
        assert!(s.cross(DVec3::new(-10.0, 0.0, 0.51), DVec3::X).is_none());
    }
}
