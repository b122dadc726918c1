//! A profile: the parameters of one run of the flow pipeline.

use super::{
    COST_UNKNOWN, GroundParams, Kind, LEVELS_MAX, MovesParams, POINTS_MAX, Parameters,
    ProfileError, RANGE_STEPS_MAX, RefinementParams, SIDE_MAX, TrackletParams, Value,
};
use crate::continuity::ContinuityLimits;
use heapless::String;

/// The frame the grid lies in (B.2.2 leaves it open).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frame {
    /// Axes and cell borders fixed in the world; the window follows the vehicle by whole cells.
    #[default]
    Lattice,
    /// The vehicle frame of each sweep, as in the dissertation.
    Sensor,
}

impl Kind for Frame {
    const REQUIREMENT: &'static str = "lattice or sensor";

    fn value(self) -> Value<'static> {
        Value::Word(if self == Frame::Lattice { "lattice" } else { "sensor" })
    }

    fn of(value: Value) -> Option<Frame> {
        match value {
            Value::Word("lattice") => Some(Frame::Lattice),
            Value::Word("sensor") => Some(Frame::Sensor),
            _ => None,
        }
    }
}

crate::params! {
    /// Everything that distinguishes one run of the flow pipeline from another.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Profile {
        /// Columns of the square window along one axis; odd, so that one is the centre.
        pub side: u32 = 167, "columns", (31 to 337),
            "±25 m at 0.30 m: dissertation, section 3.8.1.";
        /// Levels of a column.
        pub levels: u32 = 14, "voxels", (2 to 16),
            "The author's program; the shipped weights are for 14.";
        /// Edge of a voxel.
        pub voxel_m: f64 = 0.30, "m", (0.05 to 2.0),
            "Dissertation, section 3.8.1 and table B.1 (r). Cells of 0.20 m in a window of 38 m: \
             3.3 cm mean error of movers against 4.0 cm (`raywake-lab ablate`).";
        /// Maximum number of returns taken from a sweep; one with more is thinned evenly to this
        /// many.
        pub returns_max: u32 = POINTS_MAX as u32, "returns", (1 to 262144),
            "Four HDL-32E at their full rate, or an OS1-128 at 2048 x 10.";
        /// Maximum range of a return, counted in voxels along the ray's longest axis, as in the
        /// update list of B.2.1; at most 2,000 voxels.
        pub range_m: f64 = 100.0, "m", (above 0), "Dissertation, table B.1 (m_r).";
        /// Frame of the grid.
        pub frame: Frame = Frame::Lattice, "", (any),
            "Static structure then has exactly zero displacement.";
        /// Whether returns of a distorted source are moved to the stamp.
        pub deskew: bool = true, "", (any),
            "Without it: 4.8 cm mean error of movers against 4.4 cm (`raywake-lab ablate`).";
        /// Rounds of expectation and maximisation (n_em).
        pub em_rounds: u32 = 6, "", (1 to 100),
            "20 rounds gain half a point within 30 cm: the refinement gains little from more \
             (`raywake-lab ablate`). Dissertation, section 3.8.1: 20.";
        /// Weight of the smoothing term w_p.
        pub smoothing: u32 = 1000, "millinats per cell²", (0 to 10000),
            "Dissertation, section 3.8.1. 0 / 0.1 / 3 nats: 8.1 / 4.1 / 4.5 cm mean error of \
             movers against 4.4 cm (`raywake-lab ablate`).";
        /// Cost of displacement.
        pub displacement_cost: u32 = 1, "millinats per cell²", (0 to 1000),
            "The author's program: 0.001.";
        /// Cost of a window neighbour outside the grid.
        pub outside_cost: u32 = COST_UNKNOWN, "millinats", (0 to 100000),
            "As for an uninformative one: -log 0.5.";
        /// Sweeps whose returns are remembered to refine the flow below the cell's size. Clusters
        /// are compared with three of them: the pair's second, the one before the pair and the
        /// oldest. 0 leaves whole cells.
        pub refinement_sweeps: u32 = 7, "sweeps", (0 or 2 to 7),
            "2 sweeps: 5.8 cm mean error of movers against 4.4 cm with 3, whole cells 38.8 cm \
             (`raywake-lab ablate`). Precision and recall of columns reported as moving \
             (`raywake-lab sim --sweeps 25`, `vlp32x2` and `hdl64`), with 5 and here, both by \
             weights of P(moves) fitted without airborne clutter, from 0.25 on: slow streets \
             (`--drives 4 --seed 9001`) 96.6 and 95.7 %, 97.1 and 95.7; crowded ones 98.1 and \
             95.1, 98.2 and 95.2; outskirts (`--drives 6 --seed 7171`) 96.5 and 94.8, 97.1 and \
             94.6; residential ones (`--seed 8181`) 93.7 and 94.5, 94.1 and 94.4.";
    } and {
        /// Name shown in reports.
        pub name: String<24> = String::new();
        /// Ground.
        pub ground: GroundParams = GroundParams::DEFAULT;
        /// Refinement.
        pub refinement: RefinementParams = RefinementParams::DEFAULT;
        /// Whether a column moves.
        pub moves: MovesParams = MovesParams::DEFAULT;
        /// Tracklet filter.
        pub tracklet: TrackletParams = TrackletParams::DEFAULT;
        /// Beyond these, two sweeps form no pair and tracklets are dropped.
        pub limits: ContinuityLimits = ContinuityLimits::DEFAULT;
    }
}

impl Profile {
    /// ±25 m around a car.
    pub fn hdl64() -> Profile {
        Profile { name: short("hdl64"), ..Profile::DEFAULT }
    }

    /// ±35 m: the area that the graders of Argoverse 2 score.
    pub fn wide() -> Profile {
        // Farther away the energy minimisation takes longer to converge.
        Profile { name: short("wide"), side: 235, em_rounds: 20, ..Profile::DEFAULT }
    }

    /// ±50 m, in 128 MiB: two VLP-32C fire 115,200 times per sweep.
    pub fn far() -> Profile {
        Profile { name: short("far"), side: 335, returns_max: 131_072, ..Profile::DEFAULT }
    }

    /// The author's choices where the text or his program differ from ours.
    pub fn dissertation() -> Profile {
        Profile {
            name: short("dissertation"),
            frame: Frame::Sensor,
            deskew: false,
            refinement_sweeps: 0,
            em_rounds: 20,
            // Table B.1 (n_max).
            returns_max: 150_000,
            // 14 log(p q + (1 - p)(1 - q)) with p, q at the clip bounds -1 and 3.
            outside_cost: 17_289,
            tracklet: TrackletParams::DISSERTATION,
            ..Profile::DEFAULT
        }
    }

    /// The sparse map: the sensor's whole range, in all directions.
    pub fn map() -> Profile {
        // 334 voxels either way: 100 m at 0.30 m; the keys of its voxels fit in 31 bits.
        Profile { name: short("map"), side: 669, levels: 669, ..Profile::DEFAULT }
    }

    /// The shipped profiles of the flow pipeline.
    pub fn shipped() -> [Profile; 4] {
        [Profile::hdl64(), Profile::wide(), Profile::far(), Profile::dissertation()]
    }

    /// The shipped profile with a name.
    pub fn named(name: &str) -> Option<Profile> {
        Profile::shipped().into_iter().find(|p| p.name == name)
    }

    /// The groups of parameters, each with its name; that of the first is empty.
    pub fn groups(&self) -> [(&'static str, &dyn Parameters); 6] {
        [
            ("", self),
            ("ground", &self.ground),
            ("refinement", &self.refinement),
            ("moves", &self.moves),
            ("tracklet", &self.tracklet),
            ("limits", &self.limits),
        ]
    }

    /// One of these groups, to change it. An unknown name selects the first.
    pub fn group_mut(&mut self, name: &str) -> &mut dyn Parameters {
        match name {
            "ground" => &mut self.ground,
            "refinement" => &mut self.refinement,
            "moves" => &mut self.moves,
            "tracklet" => &mut self.tracklet,
            "limits" => &mut self.limits,
            _ => self,
        }
    }

    /// Maximum number of returns taken from a sweep.
    pub fn returns(&self) -> usize {
        self.returns_max as usize
    }

    /// Number of columns of the window.
    pub fn columns(&self) -> usize {
        self.side as usize * self.side as usize
    }

    /// Number of voxels of the window.
    pub fn voxels(&self) -> usize {
        self.columns() * self.levels as usize
    }

    /// Maximum number of voxels for which a ray is traced, the slots per ray of B.2.1: m_r / r,
    /// rounded up.
    pub fn range_steps(&self) -> i32 {
        libm::ceil(self.range_m / self.voxel_m) as i32
    }

    /// Checks every parameter against its range, and the rules that concern more than one.
    pub fn check(&self) -> Result<(), ProfileError> {
        for (_, group) in self.groups() {
            group.within_bounds()?;
        }
        let refined = self.refinement_sweeps > 0;
        let rules = [
            (self.side % 2 == 1, "side", "odd"),
            (self.range_steps() <= RANGE_STEPS_MAX, "range_m", "at most 2,000 voxels"),
            (
                !refined || self.frame == Frame::Lattice,
                "refinement_sweeps",
                "0 if the frame is the sensor's",
            ),
            (!self.name.is_empty(), "name", "not empty"),
        ];
        match rules.iter().find(|r| !r.0) {
            Some(&(_, field, requirement)) => Err(ProfileError { field, requirement }),
            None => Ok(()),
        }
    }
}

const _: () = assert!(SIDE_MAX == 337 && LEVELS_MAX == 16 && POINTS_MAX == 262_144);

fn short(name: &str) -> String<24> {
    let mut s = String::new();
    // The literals in this file fit.
    let _ = s.push_str(name);
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_profiles_are_valid_and_named() {
        for name in ["hdl64", "wide", "far", "dissertation"] {
            let p = Profile::named(name).unwrap();
            assert_eq!(p.name, name);
            assert_eq!(p.check(), Ok(()));
        }
        assert_eq!(Profile::named("nosuch"), None);
        assert_eq!(Profile::hdl64().range_steps(), 334);
        assert_eq!(Profile::hdl64().voxels(), 390_446);
        assert!(Profile::map().voxels() < 1 << 31);
    }

    #[test]
    fn names_are_unique() {
        let p = Profile::hdl64();
        let names = || p.groups().into_iter().flat_map(|(_, g)| g.declared()).map(|p| p.name);
        for name in names() {
            assert_eq!(names().filter(|n| *n == name).count(), 1, "{name}");
        }
    }

    #[test]
    fn ceilings_are_named() {
        let p = Profile { side: 339, ..Profile::hdl64() };
        assert_eq!(p.check().unwrap_err().field, "side");
        let p = Profile { levels: 17, ..Profile::hdl64() };
        assert_eq!(p.check().unwrap_err().field, "levels");
        let p = Profile { voxel_m: f64::NAN, ..Profile::hdl64() };
        assert_eq!(p.check().unwrap_err().field, "voxel_m");
    }
}
