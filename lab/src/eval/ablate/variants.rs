//! The variants: one change at a time.

use raywake_core::params::{Frame, Profile};

/// Source of a variant's learned parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightSource {
    /// Those of the base.
    Base,
    /// Those of the base, without a background filter.
    NoFilter,
    /// Those of the base, without the encoder.
    NoEncoder,
    /// Those of the base, with the author's published occupancy constancy.
    Author,
    /// Those shipped for the dissertation's profile, trained by its recipes.
    AsPrinted,
    /// The same with the author's published occupancy constancy.
    AsPrintedAuthor,
}

/// The author's published constants of the occupancy constancy.
pub const AUTHOR: &str = include_str!("../../../weights/author.txt");

/// A change to the base.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// Unique name: letters, digits, `-` and `.`.
    pub name: &'static str,
    /// What is changed.
    pub what: &'static str,
    change: fn(Profile) -> Profile,
    /// Its learned parameters.
    pub numbers: WeightSource,
}

/// Name of the variant without a change.
pub const BASE: &str = "base";

impl Variant {
    /// Its profile; it need not pass its check.
    pub fn profile(&self, base: &Profile) -> Profile {
        (self.change)(base.clone())
    }

    /// Whether nothing is changed: in every series one variant equals the base.
    pub fn is_base(&self, base: &Profile) -> bool {
        self.numbers == WeightSource::Base && self.profile(base) == *base
    }
}

const fn of(name: &'static str, what: &'static str, change: fn(Profile) -> Profile) -> Variant {
    Variant { name, what, change, numbers: WeightSource::Base }
}

fn cells(base: Profile, voxel_m: f64, side: u32) -> Profile {
    Profile { voxel_m, side, ..base }
}

/// All variants, in the order listed.
pub const VARIANTS: [Variant; 31] = [
    of(BASE, "as given", |p| p),
    of("refine-0", "whole cells", |p| Profile { refinement_sweeps: 0, ..p }),
    of("refine-2", "refined by 2 sweeps", |p| Profile { refinement_sweeps: 2, ..p }),
    of("refine-3", "refined by 3 sweeps", |p| Profile { refinement_sweeps: 3, ..p }),
    of("refine-5", "refined by 3 of 5 sweeps", |p| Profile { refinement_sweeps: 5, ..p }),
    of("refine-7", "refined by 3 of 7 sweeps", |p| Profile { refinement_sweeps: 7, ..p }),
    of("smoothing-0", "w_p = 0", |p| Profile { smoothing: 0, ..p }),
    of("smoothing-0.1", "w_p = 0.1", |p| Profile { smoothing: 100, ..p }),
    of("smoothing-0.3", "w_p = 0.3", |p| Profile { smoothing: 300, ..p }),
    of("smoothing-1", "w_p = 1", |p| Profile { smoothing: 1000, ..p }),
    of("smoothing-3", "w_p = 3", |p| Profile { smoothing: 3000, ..p }),
    of("rounds-4", "4 rounds", |p| Profile { em_rounds: 4, ..p }),
    of("rounds-6", "6 rounds", |p| Profile { em_rounds: 6, ..p }),
    of("rounds-20", "20 rounds", |p| Profile { em_rounds: 20, ..p }),
    of("rounds-40", "40 rounds", |p| Profile { em_rounds: 40, ..p }),
    Variant { numbers: WeightSource::NoFilter, ..of("filter-off", "every solid column", |p| p) },
    Variant { numbers: WeightSource::NoEncoder, ..of("encoder-off", "no encoder", |p| p) },
    of("encoder-no-veto", "the encoder drops no column by its score alone", |mut p| {
        p.refinement.could_move_min = -8.0;
        p
    }),
    of("encoder-no-passing", "nothing that is only passed is left behind", |mut p| {
        p.refinement.passed_worn_min = 1.0;
        p
    }),
    of("encoder-no-body", "the encoder completes no body", |mut p| {
        p.refinement.body_min = 8.0;
        p
    }),
    of("encoder-no-cue", "P(moves) without the class", |mut p| {
        p.refinement.could_move_max = 0.0;
        p
    }),
    Variant {
        numbers: WeightSource::Author,
        ..of("author-constancy", "the author's constants", |p| p)
    },
    of("sensor-frame", "sensor frame, our constants, whole cells", |p| Profile {
        frame: Frame::Sensor,
        refinement_sweeps: 0,
        ..p
    }),
    Variant {
        numbers: WeightSource::AsPrinted,
        ..of("dissertation", "chapter 3 as printed", |_| Profile::dissertation())
    },
    Variant {
        numbers: WeightSource::AsPrintedAuthor,
        ..of("dissertation-author", "as printed, the author's constants", |_| {
            Profile::dissertation()
        })
    },
    of("deskew-off", "lattice, returns as measured", |p| Profile { deskew: false, ..p }),
    of("cells-0.30-50m", "0.30 m, search 4.5 m, window 50 m", |p| cells(p, 0.30, 167)),
    of("cells-0.20-50m", "0.20 m, search 3.0 m, window 50 m", |p| cells(p, 0.20, 251)),
    of("cells-0.30-38m", "0.30 m, search 4.5 m, window 38 m", |p| cells(p, 0.30, 127)),
    of("cells-0.20-38m", "0.20 m, search 3.0 m, window 38 m", |p| cells(p, 0.20, 191)),
    of("cells-0.15-38m", "0.15 m, search 2.25 m, window 38 m", |p| cells(p, 0.15, 255)),
];

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::stages::occupancy_constancy::{SCORES_MAX, WEIGHT_WORDS, load};
    use std::collections::BTreeSet;

    #[test]
    fn every_variant_runs_on_every_base_and_has_a_name_of_its_own() {
        let names: BTreeSet<_> = VARIANTS.iter().map(|v| v.name).collect();
        assert_eq!(names.len(), VARIANTS.len());
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
        assert!(names.iter().all(|name| name.chars().all(plain)));
        for base in [Profile::hdl64(), Profile::wide()] {
            for refinement_sweeps in [0, 2] {
                let base = Profile { refinement_sweeps, ..base.clone() };
                for v in VARIANTS {
                    assert_eq!(v.profile(&base).check(), Ok(()), "{}", v.name);
                }
            }
        }
        // In the sensor's frame nothing may be refined; only those variants fail.
        let base = Profile::dissertation();
        let fails = |v: &&Variant| v.profile(&base).check().is_err();
        let failing: Vec<_> = VARIANTS.iter().filter(fails).map(|v| v.name).collect();
        assert_eq!(failing, ["refine-2", "refine-3", "refine-5", "refine-7"]);
    }

    #[test]
    fn the_authors_constants_are_in_his_range() {
        let (mut weights, mut costs) = (vec![0; WEIGHT_WORDS], vec![0; SCORES_MAX]);
        let scores = load(AUTHOR, 14, &mut weights, &mut costs).unwrap();
        // The range published with the constants: scores of -537 to 2052.
        assert_eq!((scores.min, scores.min + scores.count - 1), (-537, 2052));
    }

    #[test]
    fn every_series_has_one_base() {
        let base = Profile::hdl64();
        for series in [BASE, "refine-", "smoothing-", "rounds-", "cells-"] {
            let same = VARIANTS.iter().filter(|v| v.name.starts_with(series) && v.is_base(&base));
            assert_eq!(same.count(), 1, "{series}");
        }
        let other = [
            "filter-off",
            "encoder-off",
            "encoder-no-veto",
            "encoder-no-passing",
            "encoder-no-body",
            "encoder-no-cue",
            "author-constancy",
            "sensor-frame",
            "dissertation",
            "dissertation-author",
            "deskew-off",
        ];
        for v in VARIANTS.iter().filter(|v| other.contains(&v.name)) {
            assert!(!v.is_base(&base), "{}", v.name);
        }
    }

    #[test]
    fn windows_that_are_compared_reach_equally_far() {
        for metres in ["-50m", "-38m"] {
            let windows = VARIANTS.iter().filter(|v| v.name.ends_with(metres));
            let windows: Vec<f64> = windows
                .map(|v| v.profile(&Profile::hdl64()))
                .map(|p| f64::from(p.side) * p.voxel_m)
                .collect();
            assert!(windows.len() > 1 && windows.iter().all(|w| (w - windows[0]).abs() < 0.2));
        }
    }
}
