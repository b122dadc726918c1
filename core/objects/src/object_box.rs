//! The box of an object: its position, direction and size.
//!
//! A moving object is long in the direction of its motion. The box of a stationary one is aligned
//! with its sides, by the closeness criterion of Zhang, Xu, Dong and Dolan (Efficient L-shape
//! fitting for vehicle detection using laser scanners, IV 2017): of all directions, the one in
//! which returns lie near the box's edges.
//!
//! A box ends where the returns do: if an object was seen only from behind, its length is unknown,
//! and the box is as short as the part that was seen.

use core::f32::consts::FRAC_PI_2;

use crate::front_end::Thinned;

/// Maximum number of points a box is fitted to; of more, every second one is used, and so on.
const PLACES_MAX: usize = 1024;

raywake_core::params! {
    /// Boxes of objects.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct BoxParams {
        /// Share of the returns at each end of each axis that a box need not contain.
        pub box_trim: f32 = 0.01, "", (0 to 0.2);
        /// Distance moved from which an object is long in the direction of its motion.
        pub box_along_motion_m: f64 = 1.0, "m", (above 0),
            "Parked tracks of `kitti_raw_0005` move up to 0.16 m over 60 sweeps of it.";
        /// Step between the directions tried for a stationary object.
        pub box_step_rad: f32 = 0.035, "rad", (0.001 to 0.5);
        /// Distance from an edge below which closer does not count more.
        pub box_edge_m: f32 = 0.05, "m", (above 0), "Noise of a return.";
    }
}

/// An upright box in the frame of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectBox {
    /// Its centre, m.
    pub centre: [f32; 3],
    /// Direction of its length about +z from the object's x axis, rad, from 0 to half a turn.
    pub turn: f32,
    /// Length, width and height, m.
    pub size: [f32; 3],
}

impl ObjectBox {
    /// Fits a box to points in the frame of an object, m. If `moved_m` is large enough, the box is
    /// long in the direction of motion, its x axis; otherwise its longer side counts as its length,
    /// and which end is the front is unknown. None without a finite point.
    pub fn around(
        params: &BoxParams,
        places: impl Iterator<Item = [f32; 3]>,
        moved_m: f64,
    ) -> Option<ObjectBox> {
        let mut kept = Thinned::<[f32; 3], PLACES_MAX>::new();
        places.filter(|p| p.iter().all(|v| v.is_finite())).for_each(|p| kept.push(p));
        let mut ends = TrimmedRange { trim: params.box_trim, values: heapless::Vec::new() };
        let [low, high] = ends.of(kept.kept().iter().map(|p| p[2]))?;
        let along_motion = moved_m >= params.box_along_motion_m;
        let mut turn = if along_motion { 0.0 } else { direction(params, kept.kept(), &mut ends)? };
        let mut sides = sides(kept.kept(), turn, &mut ends)?;
        if !along_motion && sides[0][1] - sides[0][0] < sides[1][1] - sides[1][0] {
            let [[x0, x1], y] = sides;
            (turn, sides) = (turn + FRAC_PI_2, [y, [-x1, -x0]]);
        }
        let [x, y, z] = [sides[0], sides[1], [low, high]].map(|[a, b]| 0.5 * (a + b));
        let (sin, cos) = libm::sincosf(turn);
        Some(ObjectBox {
            centre: [cos * x - sin * y, sin * x + cos * y, z],
            turn,
            size: [sides[0], sides[1], [low, high]].map(|[a, b]| b - a),
        })
    }
}

/// Minimum and maximum of values, ignoring a share of them at either end.
struct TrimmedRange {
    trim: f32,
    values: heapless::Vec<f32, PLACES_MAX>,
}

impl TrimmedRange {
    fn of(&mut self, values: impl Iterator<Item = f32>) -> Option<[f32; 2]> {
        self.values.clear();
        // There is room for as many points as are kept.
        self.values.extend(values.take(PLACES_MAX));
        self.values.sort_unstable_by(f32::total_cmp);
        let cut = (self.trim * self.values.len() as f32) as usize;
        let low = *self.values.get(cut)?;
        Some([low, *self.values.get(self.values.len() - 1 - cut)?])
    }
}

/// Coordinates of a point along a direction and to its left.
fn turned([x, y, _]: &[f32; 3], (sin, cos): (f32, f32)) -> [f32; 2] {
    [cos * x + sin * y, cos * y - sin * x]
}

/// Ends along a direction and to its left, m.
fn sides(places: &[[f32; 3]], turn: f32, ends: &mut TrimmedRange) -> Option<[[f32; 2]; 2]> {
    let by = libm::sincosf(turn);
    let mut side = |axis: usize| ends.of(places.iter().map(|p| turned(p, by)[axis]));
    Some([side(0)?, side(1)?])
}

/// The direction, from 0 to a quarter turn, in which points are closest to the edges.
fn direction(params: &BoxParams, places: &[[f32; 3]], ends: &mut TrimmedRange) -> Option<f32> {
    let mut best = (f32::NEG_INFINITY, 0.0);
    let steps = (FRAC_PI_2 / params.box_step_rad) as u32;
    for step in 0..=steps {
        let turn = step as f32 * params.box_step_rad;
        let score = closeness(params, places, turn, sides(places, turn, ends)?);
        if turn < FRAC_PI_2 && score > best.0 {
            best = (score, turn);
        }
    }
    Some(best.1)
}

/// Sum of the points' inverse distances from their nearest edges, 1/m.
fn closeness(params: &BoxParams, places: &[[f32; 3]], turn: f32, sides: [[f32; 2]; 2]) -> f32 {
    let by = libm::sincosf(turn);
    let one = |place: &[f32; 3]| {
        let at = turned(place, by);
        let from = [0, 1].map(|a| (at[a] - sides[a][0]).abs().min((sides[a][1] - at[a]).abs()));
        1.0 / from[0].min(from[1]).max(params.box_edge_m)
    };
    places.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const PARAMS: BoxParams = BoxParams::DEFAULT;

    /// Points on two sides of a car of 4.2 m x 1.8 m x 1.5 m around a centre, turned, with noise.
    fn car(turn: f32, [x, y]: [f32; 2], random: &mut Random) -> Vec<[f32; 3]> {
        let (sin, cos) = turn.sin_cos();
        let mut place = |along: f32, left: f32| {
            let [a, b] = [along, left].map(|v| v + random.between(-0.02, 0.02));
            [x + cos * a - sin * b, y + sin * a + cos * b, random.between(0.0, 1.5)]
        };
        let flank: Vec<_> = (0..300).map(|n| place(n as f32 * 0.014 - 2.1, 0.9)).collect();
        let rear = (0..120).map(|n| place(-2.1, n as f32 * 0.015 - 0.9));
        flank.into_iter().chain(rear).collect()
    }

    #[test]
    fn two_sides_of_a_parked_car_determine_its_box() {
        let mut random = Random(3);
        for step in 0..18 {
            let turn = step as f32 * 0.17;
            let found =
                ObjectBox::around(&PARAMS, car(turn, [5.0, -3.0], &mut random).into_iter(), 0.1);
            let found = found.unwrap();
            let off = (found.turn - turn).rem_euclid(core::f32::consts::PI);
            let off = off.min(core::f32::consts::PI - off);
            assert!(off < 0.06, "{turn}: {found:?}");
            for (is, of) in found.size.iter().zip([4.2, 1.8, 1.5]) {
                assert!((is - of).abs() < 0.2, "{turn}: {found:?}");
            }
            for (is, of) in found.centre.iter().zip([5.0, -3.0, 0.75]) {
                assert!((is - of).abs() < 0.12, "{turn}: {found:?}");
            }
        }
    }

    #[test]
    fn movers_are_longest_along_their_motion() {
        // A bus seen from behind: the visible part is wider than long.
        let places = (0..200).map(|n| [0.02 * (n % 10) as f32, 0.0125 * n as f32, 1.0]);
        let moving = ObjectBox::around(&PARAMS, places.clone(), 5.0).unwrap();
        assert_eq!(moving.turn, 0.0);
        assert!(moving.size[0] < 0.2 && moving.size[1] > 2.3, "{moving:?}");
        let standing = ObjectBox::around(&PARAMS, places, 0.5).unwrap();
        assert!((standing.turn - FRAC_PI_2).abs() < 0.1 && standing.size[0] > 2.3, "{standing:?}");
    }

    #[test]
    fn odd_places() {
        assert_eq!(ObjectBox::around(&PARAMS, core::iter::empty(), 0.0), None);
        assert_eq!(ObjectBox::around(&PARAMS, [[f32::NAN; 3]].into_iter(), 0.0), None);
        let one = ObjectBox::around(&PARAMS, [[1.0, 2.0, 3.0]; 2].into_iter(), 0.0).unwrap();
        assert_eq!(one.size, [0.0; 3]);
        assert!(one.centre.iter().zip([1.0, 2.0, 3.0]).all(|(is, of)| (is - of).abs() < 1e-5));
        // One stray return of five hundred is left out.
        let many = (0..500).map(|n| [if n == 250 { 90.0 } else { 0.004 * n as f32 }, 0.0, 0.0]);
        let found = ObjectBox::around(&PARAMS, many, 9.0).unwrap();
        assert!(found.size[0] < 2.1, "{found:?}");
    }
}
