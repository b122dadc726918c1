//! Parameters of the refinement and of the ground estimate it relies on.

/// The source of the refinement's constants, unless stated otherwise.
const SIMULATED: &str = "Chosen on six simulated drives (`raywake-lab sim --drives 6 --sweeps 40 \
                         --seed 1100`), not measured in isolation.";
/// The source of those that set the spread of covariances.
const CALIBRATED: &str = "Chosen on sixty simulated drives so that the 68 % and 95 % ellipses hold \
                          75.5 % and 90.4 % of the true displacements.";
/// The source of those for climbing ground.
const CLIMBED: &str = "Columns true / false / missed on `kitti_raw_0005`: 6,069 / 1,454 / 365 with \
                       climbing, 5,972 / 1,401 / 462 without; simulated streets unchanged. With \
                       columns of any thickness and two columns to the side, cars become ground: \
                       recall on streets drops by 1 to 8 points.";

crate::params! {
    /// How the ground is estimated, see [`crate::ground`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct GroundParams {
        /// Edge of the square cells with one ground height each; rounded to whole columns, at least
        /// four of them.
        pub ground_cell_m: f64 = 1.5, "m", (0.1 to 20), SIMULATED;
        /// How far below the ground under the vehicle other ground may begin; lower returns are
        /// mirrored.
        pub ground_drop_m: f64 = 0.45, "m", (0 to 10), SIMULATED;
        /// How much farther below it may lie per metre of distance.
        pub ground_drop_slope: f32 = 0.1, "", (0 to 10), SIMULATED;
        /// Steepest descent of the ground from one cell to the next.
        pub ground_fall_slope: f64 = 0.066, "", (0 to 10), SIMULATED;
        /// How many cells the ground is extrapolated: behind a car none of it is seen.
        pub ground_passes: u32 = 3, "cells", (0 to 20), SIMULATED;
        /// A column's lowest return this little above the ground, or less, lies on it.
        pub ground_tolerance_m: f64 = 0.105, "m", (0 to 10), SIMULATED;
        /// Columns whose returns are farther apart in height are not ground, unless the upper ones
        /// overhang it.
        pub ground_thickness_m: f64 = 0.25, "m", (0 to 10), CLIMBED;
        /// Steepest ascent of the ground from one column to the next; 0: nothing that rises is
        /// ground.
        pub ground_slope: f32 = 0.5, "", (0 to 10), CLIMBED;
    }
}

crate::params! {
    /// The refinement's parameters, see [`crate::refinement`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct RefinementParams {
        /// Returns lower than this above the ground belong to it, in any column.
        pub ground_height_m: f64 = 0.105, "m", (0 to 2), SIMULATED;
        /// Returns higher than this above the ground belong to clusters.
        pub cluster_height_min_m: f64 = 0.18, "m", (0 to 2), SIMULATED;
        /// Returns from this height up belong to none; at most 32 voxels count.
        pub cluster_height_max_m: f64 = 4.2, "m", (0.5 to 64), SIMULATED;
        /// Edge of the sub-voxels that keep one return each; a voxel is divided into at most four
        /// per axis.
        pub thinning_m: f64 = 0.10, "m", (0.01 to 2), SIMULATED;
        /// Levels this far apart still touch, as parts of one cluster.
        pub cluster_gap_m: f64 = 0.6, "m", (0 to 10), SIMULATED;
        /// Matched neighbours whose displacements differ by more belong to different clusters.
        pub cluster_disparity_cells: u32 = 2, "cells", (0 to 30), SIMULATED;
        /// Larger clusters are static.
        pub cluster_extent_max_m: f64 = 30.0, "m", (1 to 1000), "The longest trams.";

        /// Radius around a return within which others determine the orientation of its surface.
        pub surface_radius_m: f64 = 0.45, "m", (0.01 to 5), SIMULATED;
        /// The same if those lie on a line, as from one ring on a bonnet.
        pub surface_radius_wide_m: f64 = 0.75, "m", (0.01 to 5), SIMULATED;
        /// Returns whose variance across their longest direction is smaller lie on a line.
        pub surface_line_m2: f64 = 0.0045, "m²", (0 to 1),
            "A ring with its noise is below, two rings 0.3 m apart above.";
        /// Standard deviation of a return.
        pub return_sigma_m: f64 = 0.045, "m", (0.001 to 1), SIMULATED;

        /// Maximum distance of the nearest neighbour, at most a voxel's edge.
        pub match_distance_m: f64 = 0.30, "m", (0.01 to 2), SIMULATED;
        /// Width of the Geman-McClure kernel in the first iterations.
        pub kernel_wide_m: f64 = 0.30, "m", (0.01 to 5), SIMULATED;
        /// Its width in later iterations.
        pub kernel_m: f64 = 0.105, "m", (0.01 to 5), SIMULATED;
        /// Maximum number of iterations with the wide kernel.
        pub iterations_wide: u32 = 3, "", (0 to 100), SIMULATED;
        /// Maximum number of Gauss-Newton iterations.
        pub iterations: u32 = 8, "", (1 to 100), SIMULATED;
        /// A step that moves by less is the last with its kernel; a rotation counts as the movement
        /// it causes at one voxel's distance.
        pub converged_m: f64 = 0.003, "m", (0 to 1), SIMULATED;
        /// Share of the information of a pair of returns that is independent: errors of neighbours
        /// are alike.
        pub information_ratio: f32 = 0.25, "", (0.001 to 1), CALIBRATED;
        /// Standard deviation of the rotation between two sweeps.
        pub turn_sigma_rad: f32 = 0.03, "rad", (0.0001 to 10), SIMULATED;
        /// Standard deviation of the prior that holds a displacement where no return is near.
        pub hold_sigma_m: f64 = 9.486833, "m", (0.01 to 1000), SIMULATED;

        /// A return within this distance fits.
        pub inlier_m: f64 = 0.045, "m", (0.001 to 2), SIMULATED;
        /// Truncation of the residual: a return farther away across its surface counts as missed.
        pub truncation_m: f64 = 0.15, "m", (0.001 to 2), SIMULATED;

        /// A return with at least this residual, or with nothing near it, is judged by the rays
        /// that passed there.
        pub sight_residual: f32 = 0.1, "", (0 to 1),
            "Columns reported as moving on simulated streets (`raywake-lab sim --drives 3 --sweeps \
             25 --seed 9001`, slow, plain and fast, `vlp32x2` and `hdl64`, and plain \
             `hdl32x4-full`), with 0.03 for `evidence_min`: precision 95.1 %, recall 94.6 here, \
             94.8 and 94.6 at 0.05. Without judging by rays, 94.2 and 94.4.";
        /// How near a ray must pass to a point to count as evidence about it.
        pub sight_distance_m: f64 = 0.1, "m", (0.001 to 5),
            "Precision and recall as above: 95.2 and 94.7 at 0.07 m, 95.1 and 94.7 at 0.15 m.";
        /// The same as an angle, if that is farther: rings are farther apart there.
        pub sight_angle_rad: f32 = 0.008, "rad", (0 to 1),
            "Half the angle between the rings of an HDL-32E is 0.012. Precision and recall as \
             above are the same at 0.004.";

        /// A cluster with a lower residual at rest is static without further test.
        pub residual_static: f32 = 0.05, "", (0 to 1),
            "Precision and recall as above, with `evidence_min` as shipped: 95.0 and 94.7 at 0.08, \
             94.7 and 95.1 here, 94.6 and 95.2 at 0.03, where a sweep of `kitti_raw_0005` takes 3 \
             ms longer on one core than at 0.08.";
        /// A start that leads to a residual this low is the last.
        pub residual_good: f32 = 0.05, "", (0 to 1), SIMULATED;
        /// A residual above this is a bad fit: it calls for a search, and for twice the evidence.
        pub residual_bad: f32 = 0.3, "", (0 to 1), SIMULATED;
        /// Minimum evidence against rest for a cluster to be dynamic, see [`crate::refinement`].
        pub evidence_min: f32 = 0.02, "", (0 to 1),
            "So low that P(moves) gets to decide on everything that moves. Precision and recall as \
             above: 95.1 and 94.6 at 0.03, 95.0 and 94.8 here, with 0.03 for `residual_static`.";
        /// Difference in evidence that makes motion e times as likely.
        pub evidence_scale: f32 = 0.04, "", (0.0001 to 1), CALIBRATED;
        /// Share of `evidence_min` and `residual_static` that suffices for a cluster that moved in
        /// the last sweep, or is beside one that moves.
        pub evidence_prior_ratio: f32 = 0.4, "", (0 to 1),
            "The smallest that keeps false motion in a static simulated street within its bound.";
        /// Share of a cluster's columns whose tracklets must have moved for that reduction to apply
        /// in full; with fewer it applies in proportion: a car's tracklets touch the road.
        pub prior_quorum: f32 = 0.5, "", (0.01 to 1),
            "Without it 4,581 static columns of `kitti_raw_0005` move, with it 2,952 (before the \
             static ground below a cluster became its footprint).";
        /// Columns whose could-move score (see [`crate::encoder`]) is below this join no moving
        /// cluster, unless most of that cluster is like them and it was seen to arrive.
        pub could_move_min: f32 = -5.5, "nat", (-8 to 8),
            "So low that P(moves) decides if the encoder is in doubt: whole groups of people are \
             below -4 in surroundings unlike its training. Recall at a precision of 95 % on \
             simulated streets (`raywake-lab sim --drives 3 --sweeps 25 --seed 9001`; slow and \
             plain, `vlp32x2`): 91.0 and 97.4 % at -4, 91.9 and 97.7 here, 91.5 and 97.8 at -8, \
             each with its own weights.";
        /// Scores that P(moves) goes by are cut to this either way: beyond it the case is clear.
        pub could_move_max: f32 = 4.0, "nat", (0 to 8), "Not measured in isolation.";
        /// Columns whose score is above this and that touch a moving cluster join it if they fit
        /// its motion about as well as rest (`remainder_residual`).
        pub body_min: f32 = 1.0, "nat", (-8 to 8),
            "At 0 precision and recall are the same to 0.1 points on simulated streets as above; \
             far from movers, four HDL-32E on outskirts (`--drives 6 --sweeps 25 --seed 7070`) \
             have 649 false moving columns, 528 here.";
        /// A cluster is static if something else was hit in more than this share of looks at its
        /// voxels in sweeps in which, by its motion, it was not there yet. Likewise, what has no
        /// evidence of its own does not go with a moving cluster: columns beside a moving part,
        /// remainders, hidden fragments, and what completes a body. That these may have started
        /// from rest is no excuse.
        pub worn_max: f32 = 0.5, "", (0 to 1),
            "2 % of simulated moving columns are in such clusters, and a quarter of the static \
             ones far from any mover (before `acceleration_mps2`). Columns reported as moving \
             (`raywake-lab sim --sweeps 25 --seed 9001`, `vlp32x2` and `hdl64`), precision and \
             recall if that holds for clusters alone, and here: narrow streets (`--drives 4`) \
             94.3 and 96.0 %, 96.7 and 96.1; plain ones (`--drives 3`) 96.0 and 97.4, 96.1 and \
             97.4; slow ones 95.9 and 93.1, 96.2 and 93.1; crowded ones (`--drives 2`) 98.4 and \
             89.9 both times; residential ones (`--drives 6 --seed 8181`) 90.9 and \
             92.9, 92.2 and 93.0.";
        /// A part of a moving cluster that could not move, as far as the encoder knows, while other
        /// parts could, and whose own evidence is at most `evidence_min`, is left behind if
        /// something else was hit in more than this share of looks at its own voxels.
        pub passed_worn_min: f32 = 0.2, "", (0 to 1),
            "Someone who walks along a low wall. Three hits in as many looks are enough. Columns \
             reported as moving (`raywake-lab sim --sweeps 25`, `vlp32x2` and `hdl64`), precision \
             and recall if nothing is left behind, here and at 0.1: on residential streets \
             (`--drives 6 --seed 8181`) 88.9 and 93.2 %, 90.9 and 92.9, 91.1 and 92.8; on slow \
             streets (`--drives 3 --seed 9001`) 95.8 and 93.1, 95.9 and 93.1, 95.9 and 93.1; on \
             crowded ones (`--drives 2 --seed 9001`) 98.3 and 90.0, 98.4 and 89.9, 98.4 and 89.8 \
             (before `worn_max` held for more than clusters).";
        /// How fast what starts may speed up. What was hit where a cluster may have been at rest
        /// before it started does not count against it, unless the encoder thinks that it could not
        /// move rather than that it could.
        pub acceleration_mps2: f64 = 3.0, "m/s²", (0 to 100),
            "A car that pulls out. Columns reported as moving on simulated streets (`raywake-lab \
             sim --sweeps 25 --seed 9001`, `vlp32x2` and `hdl64`), precision and recall at 0, 1.5 \
             and here: plain (`--drives 3`) 96.0 and 97.4 %, 96.1 and 97.4, 95.9 and 97.4; slow \
             96.0 and 92.2, 96.0 and 92.3, 95.8 and 93.1; crowded (`--drives 2`) 98.3 and 88.8, \
             98.2 and 88.9, 98.3 and 90.0 (before `passed_worn_min`).";
        /// Beyond this length a cluster that moved needs less evidence, in inverse proportion: its
        /// sides slide along themselves.
        pub evidence_length_m: f64 = 4.5, "m", (0.1 to 1000), SIMULATED;
        /// Minimum displacement of anything that moves.
        pub displacement_min_m: f64 = 0.039, "m", (0 to 10), SIMULATED;
        /// Returns that a cluster needs to move by itself.
        pub returns_min: u32 = 5, "returns", (1 to 96), SIMULATED;
        /// Returns that a cluster needs for a search: fewer fit anywhere.
        pub search_returns_min: u32 = 12, "returns", (1 to 96), SIMULATED;
        /// Maximum speed of the search, at most 15 cells from sweep to sweep.
        pub search_speed_mps: f64 = 28.6, "m/s", (0 to 1000), SIMULATED;
        /// Starts nearer to each other count as one.
        pub start_spacing_m: f64 = 0.225, "m", (0 to 10), SIMULATED;
        /// A start is first tried with every k-th return.
        pub start_stride: u32 = 3, "returns", (1 to 96), SIMULATED;

        /// Minimum mean residual at rest, in the second sweep or in the earliest, of a column that
        /// may belong to a moving part.
        pub column_residual: f32 = 0.15, "", (0 to 1), SIMULATED;
        /// Returns of a column examined for that.
        pub column_returns: u32 = 4, "returns", (1 to 1000), SIMULATED;
        /// Columns in which nothing was hit in sweeps that are older by at least this much, as far
        /// as they are remembered, may also belong to a moving part.
        pub part_since_s: f64 = 0.25, "s", (0 to 10),
            "Columns of walking people on `kitti_raw_0005` (94), found with a margin of 0: 14 at \
             10 s, where nothing is remembered, 26 at 0.15 s, 37 here, 33 at 0.4 s.";
        /// How much the evidence of such a part, or of one that fits badly in the earliest sweep
        /// only, must exceed what the test requires: what comes out of a shadow was not there
        /// before either.
        pub part_since_margin: f32 = 0.1, "", (0 to 1),
            "Columns true / false of two simulated drives (`raywake-lab sim --drives 2 --sweeps 20 \
             --seed 1100`): 9,073 / 318 without such parts, 9,073 / 397 at 0, 9,073 / 320 here. Of \
             the 94 of people as above 37 at 0, 0.05 and here, 29 at 0.15.";
        /// How much worse than rest the motion of a part may fit a column beside it, which must not
        /// have been there before (`worn_max`).
        pub growth_residual: f32 = 0.03, "", (0 to 1), SIMULATED;
        /// How much worse than rest the motion of a cluster's larger part may fit the remainder of
        /// it, and the motion of a body columns that could move and touch it; these must not have
        /// been there before (`worn_max`).
        pub remainder_residual: f32 = 0.05, "", (0 to 1), SIMULATED;
        /// Share of a cluster's extent that a part must exceed to take the remainder along.
        pub remainder_ratio: f32 = 0.5, "", (0 to 1), SIMULATED;
        /// Share of a cluster's returns that must be visible before rest is accepted, and before a
        /// motion of something that could move is judged by those alone.
        pub visible_ratio: f32 = 0.5, "", (0 to 1), SIMULATED;
        /// How far a fragment may lie from a moving cluster that takes it along.
        pub fragment_distance_m: f64 = 1.2, "m", (0 to 20), SIMULATED;
        /// How far the ground under a moving cluster extends beyond its returns.
        pub footprint_margin_m: f64 = 0.1, "m", (0 to 5),
            "Of the matched ground columns beside movers on `kitti_raw_0005` this near to the \
             registered returns, 589 are in labelled boxes and 65 are not; 467 and 12 at 0 m, 702 \
             and 293 at 0.2 m.";

        /// Standard deviation of the displacement of a static cluster that fits perfectly.
        pub static_sigma_m: f64 = 0.0075, "m", (0.0001 to 10), CALIBRATED;
        /// The residual that doubles a variance.
        pub inflation_residual: f32 = 0.008, "", (0.0001 to 1), CALIBRATED;
        /// Area, range times edge of the footprint, at which the covariance of a perfect fit is
        /// left unchanged: a near cluster shows another side with every sweep, a small one has
        /// returns whose errors are alike.
        pub confidence_m2: f64 = 0.117, "m²", (0.0001 to 1000), CALIBRATED;
        /// Minimum range of a cluster for that: the vehicle's own sides.
        pub range_min_m: f64 = 2.1, "m", (0.1 to 100), SIMULATED;
        /// Standard deviation of a motion as a share of itself, however well it fits.
        pub motion_sigma_ratio: f32 = 0.01, "", (0 to 1), CALIBRATED;
        /// Variance of whether a static cluster moves as its column's match says.
        pub mismatch_variance: f32 = 0.25, "", (0 to 1),
            "p (1 - p) of two motions that are equally likely.";
    }
}
