//! The ground: two gently sloped planes that meet in a valley or a crest, with sidewalks raised by
//! a kerb along two crossing roads. Alternatively, any other relief.
//!
//! Street frame: x along the main road, y left, z up.

use crate::dimensions::{CROSS_HALF, Section};
use crate::relief::Relief;
use crate::roughness::roughness;
use glam::{DMat3, DQuat, DVec3};
use raywake_core::pose::Pose;

/// Width over which feet and wheels climb the kerb, m.
const RAMP: f64 = 0.3;

/// The surface everything stands on.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// z = p.x x + p.y y + p.z of both planes.
    planes: [DVec3; 2],
    /// The higher plane applies (a valley) rather than the lower (a crest).
    valley: bool,
    /// x of the crossing road's centre line, m; `None`: no roads, no kerbs.
    crossing: Option<f64>,
    /// Cross-section of the main road.
    section: Section,
    /// Height of the sidewalks above the road, m.
    kerb: f64,
    /// Largest unevenness of the road, m.
    bumps: f64,
    /// Relief that replaces the planes and the roads.
    relief: Option<Relief>,
}

/// Where a ray meets the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Distance along the ray, m.
    pub range: f64,
    /// Cosine of the angle between ray and normal.
    pub cosine: f64,
}

impl Ground {
    /// The plane z = 0.
    pub fn flat() -> Ground {
        Ground {
            planes: [DVec3::ZERO; 2],
            valley: true,
            crossing: None,
            section: Section::WIDE,
            kerb: 0.0,
            bumps: 0.0,
            relief: None,
        }
    }

    /// Ground with another relief, without kerbs.
    pub(crate) fn of(relief: Relief) -> Ground {
        Ground { relief: Some(relief), ..Ground::flat() }
    }

    /// A street whose slope changes at `bend_m` from `slopes[0]` to `slopes[1]` (rise over run
    /// along x), with the slope `across` to the left; the roads cross at `crossing_m`.
    pub fn street(
        slopes: [f64; 2],
        across: f64,
        bend_m: f64,
        crossing_m: f64,
        kerb_m: f64,
    ) -> Ground {
        let after = (slopes[0] - slopes[1]) * bend_m;
        Ground {
            planes: [DVec3::new(slopes[0], across, 0.0), DVec3::new(slopes[1], across, after)],
            valley: slopes[1] >= slopes[0],
            crossing: Some(crossing_m),
            kerb: kerb_m,
            ..Ground::flat()
        }
    }

    /// The same ground with another main road.
    pub(crate) fn with_section(self, section: Section) -> Ground {
        Ground { section, ..self }
    }

    /// Cross-section of the main road.
    pub(crate) fn section(&self) -> Section {
        self.section
    }

    /// The same ground with bumps of this height on the road (m), half as much again on the
    /// sidewalks and several times as much beyond. Only the laser sees them; whatever stands on the
    /// ground ignores them.
    pub fn uneven(self, bumps: f64) -> Ground {
        Ground { bumps, ..self }
    }

    /// Distance into the sidewalk from its kerb, m; negative on the road.
    fn beyond_kerb(&self, x: f64, y: f64) -> f64 {
        match self.crossing {
            Some(c) => (y.abs() - self.section.road_half).min((x - c).abs() - CROSS_HALF),
            None => -1.0,
        }
    }

    /// Height for a foot or wheel, m: the road, or the sidewalk with its kerb smoothed to a ramp,
    /// so that whoever climbs it has a finite velocity.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        if let Some(relief) = &self.relief {
            return relief.height(x, y);
        }
        let [a, b] = self.planes.map(|p| p.x * x + p.y * y + p.z);
        let road = if self.valley { a.max(b) } else { a.min(b) };
        let u = (0.5 + self.beyond_kerb(x, y) / RAMP).clamp(0.0, 1.0);
        road + self.kerb * u * u * (3.0 - 2.0 * u)
    }

    /// Where a ray reaches the surface raised by `lift`; infinity if it never does.
    fn reach(&self, o: DVec3, d: DVec3, lift: f64) -> f64 {
        let [a, b] = self.planes.map(|p| {
            let above = o.z - (p.x * o.x + p.y * o.y + p.z + lift);
            let sink = d.z - (p.x * d.x + p.y * d.y);
            if sink < -1e-9 { (-above / sink).max(0.0) } else { f64::INFINITY }
        });
        // Being above a valley means above both planes; above a crest, above either.
        if self.valley { a.min(b) } else { a.max(b) }
    }

    /// Where the ray from `o` (above the ground) along the unit vector `d` meets the ground.
    pub fn contact(&self, o: DVec3, d: DVec3) -> Option<Contact> {
        if let Some(relief) = &self.relief {
            let range = relief.reach(o, d)?;
            let at = o + d * range;
            let contact = Contact { range, cosine: relief.cosine(at, d) };
            return Some(self.bumped(contact, at, relief.roughening(at.x, at.y)));
        }
        let level = |range: f64| {
            let met = range > 0.0 && range.is_finite();
            met.then(|| {
                let (contact, at) = (Contact { range, cosine: self.cosine(d) }, o + d * range);
                let beyond = self.beyond_kerb(at.x, at.y);
                let farther = (beyond - self.section.sidewalk).clamp(0.0, 2.5);
                let scale = 1.0 + 0.5 * beyond.clamp(0.0, 1.0) + farther;
                self.bumped(contact, at, scale)
            })
        };
        let low = self.reach(o, d, 0.0);
        if self.crossing.is_none() {
            return level(low);
        }
        let raised = |t: f64| self.beyond_kerb(o.x + t * d.x, o.y + t * d.y) > 0.0;
        let high = self.reach(o, d, self.kerb);
        if high.is_finite() && raised(high) {
            return level(high);
        }
        if !low.is_finite() || !raised(low) {
            return level(low);
        }
        // Above the road at the sidewalk's height, below the sidewalk at the road's: the kerb's
        // face lies between the two.
        let (mut before, mut after) = (high, low);
        for _ in 0..24 {
            let middle = 0.5 * (before + after);
            *(if raised(middle) { &mut after } else { &mut before }) = middle;
        }
        let at = o + d * after;
        let aside = (at.x - self.crossing.unwrap_or(0.0)).abs() - CROSS_HALF;
        let along_x = at.y.abs() - self.section.road_half < aside;
        Some(Contact { range: after, cosine: if along_x { d.y.abs() } else { d.x.abs() } })
    }

    /// The contact moved along the ray to where it meets the bump at its place; bumps are `scale`
    /// times as high as on the road.
    fn bumped(&self, contact: Contact, at: DVec3, scale: f64) -> Contact {
        if self.bumps == 0.0 {
            return contact;
        }
        let height = self.bumps * scale * roughness(at.x, at.y);
        // A grazing ray meets a bump long before it or passes over it: limited to the bump's width.
        let shift = (height / contact.cosine.max(1e-3)).clamp(-1.0, 1.0);
        Contact { range: (contact.range - shift).max(0.5 * contact.range), ..contact }
    }

    /// Cosine of incidence; the planes differ too little for it to matter which of them is met.
    fn cosine(&self, d: DVec3) -> f64 {
        let normal = DVec3::new(-self.planes[0].x, -self.planes[0].y, 1.0);
        d.dot(normal).abs() / normal.dot(normal).sqrt()
    }

    /// Pose of something standing at (x, y) facing `yaw` on four feet `base` apart (length, width,
    /// m); upright if `base` is zero.
    pub fn standing_pose(&self, x: f64, y: f64, yaw: f64, base: [f64; 2]) -> Pose {
        if base[0] == 0.0 {
            return Pose::planar(x, y, self.height(x, y), yaw);
        }
        let (s, c) = yaw.sin_cos();
        let (l, w) = (0.5 * base[0], 0.5 * base[1]);
        let [front, rear] = [l, -l].map(|u| self.height(x + u * c, y + u * s));
        let [left, right] = [w, -w].map(|u| self.height(x - u * s, y + u * c));
        let forward = DVec3::new(c * base[0], s * base[0], front - rear).normalize();
        let side = DVec3::new(-s * base[1], c * base[1], left - right);
        let up = forward.cross(side).normalize();
        let rotation = DMat3::from_cols(forward, up.cross(forward), up);
        Pose::new(DQuat::from_mat3(&rotation), DVec3::new(x, y, 0.5 * (front + rear)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn down(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z).normalize()
    }

    #[test]
    fn plane_in_closed_form() {
        let o = DVec3::new(0.0, 0.0, 1.73);
        let c = Ground::flat().contact(o, down(1.0, 0.0, -0.5)).unwrap();
        assert!((c.range - 1.73 * 5f64.sqrt()).abs() < 1e-12);
        assert!((c.cosine - 1.0 / 5f64.sqrt()).abs() < 1e-12);
        assert!(Ground::flat().contact(o, DVec3::X).is_none());
        // Uphill 2 %: the horizontal ray meets the ground after 1.73 / 0.02 m.
        let hill = Ground::street([0.02, 0.02], 0.0, 0.0, 1e6, 0.0);
        assert!((hill.contact(o, DVec3::X).unwrap().range - 86.5).abs() < 1e-9);
    }

    #[test]
    fn bends_both_ways() {
        let o = DVec3::new(0.0, 0.0, 2.0);
        let d = down(1.0, 0.0, -0.05);
        for after in [0.01, -0.01] {
            let g = Ground::street([0.0, after], 0.0, 20.0, 1e6, 0.0);
            let at = o + d * g.contact(o, d).unwrap().range;
            // 2 - 0.05 x = after (x - 20)
            assert!((at.x - (2.0 + 20.0 * after) / (0.05 + after)).abs() < 1e-9);
            assert!((g.height(at.x, at.y) - at.z).abs() < 1e-9);
        }
    }

    #[test]
    fn kerb_road_and_sidewalk() {
        let g = Ground::street([0.0, 0.0], 0.0, 0.0, 100.0, 0.15);
        let o = DVec3::new(0.0, 0.0, 1.5);
        let at = |d: DVec3| o + d * g.contact(o, d).unwrap().range;
        assert!(at(down(0.0, 3.0, -1.5)).z.abs() < 1e-9, "road");
        assert!((at(down(0.0, 8.0, -1.35)).z - 0.15).abs() < 1e-9, "sidewalk");
        let half = Section::WIDE.road_half;
        let face = at(down(0.0, half, -1.43));
        assert!((face.y - half).abs() < 1e-4 && (face.z - 0.07).abs() < 1e-4, "face");
        assert_eq!(g.height(0.0, 0.0), 0.0);
        assert_eq!(g.height(0.0, 7.0), 0.15);
    }

    #[test]
    fn bumps_stay_small() {
        let level = Ground::street([0.0, 0.0], 0.0, 0.0, 100.0, 0.15);
        let g = level.clone().uneven(0.01);
        let o = DVec3::new(0.0, 0.0, 1.5);
        let (mut lowest, mut highest) = (0.0f64, 0.0f64);
        for i in 0..500 {
            let d = down(4.0 + 0.03 * f64::from(i), 0.2, -1.5);
            let at = o + d * g.contact(o, d).unwrap().range;
            lowest = lowest.min(at.z);
            highest = highest.max(at.z);
        }
        assert!(lowest > -0.0101 && lowest < -0.003, "{lowest}");
        assert!(highest < 0.0101 && highest > 0.003, "{highest}");
        assert_eq!(level.height(3.0, 1.0), g.height(3.0, 1.0));
    }

    #[test]
    fn vehicles_lie_in_the_slope() {
        let g = Ground::street([0.03, 0.03], 0.01, 0.0, 100.0, 0.0);
        let p = g.standing_pose(1.0, 2.0, 0.7, [2.8, 1.6]);
        let up = p.rotation * DVec3::Z;
        let normal = DVec3::new(-0.03, -0.01, 1.0).normalize();
        assert!((up - normal).length() < 1e-9);
        let forward = p.rotation * DVec3::X;
        assert!((forward.y.atan2(forward.x) - 0.7).abs() < 1e-9);
        assert!((p.translation.z - 0.05).abs() < 1e-9);
    }
}
