//! Parameters of whether a column moves: see [`crate::refinement::cues`].

/// Where the weights come from.
const FITTED: &str = "Fitted by `raywake-lab train moves` on twenty simulated drives (`raywake-lab \
                      sim`, each rig: `--drives 3 --sweeps 30 --seed 4100`, and `--drives 2 \
                      --sweeps 25 --seed 4200 --scenery street-cluttered`; `eval --moving 0`): \
                      Brier score 0.042 on what was held out.";

crate::params! {
    /// How cues become P(moves): logistic regression, one weight a cue.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MovesParams {
        /// What is put out as moving has at least this P(moves).
        pub moves_min: f32 = 0.3, "", (0 to 1),
            "Columns true / false / missed of `kitti_raw_0005`: 5,956 / 1,511 / 478; at 0 6,025 / \
             1,728 / 409, at 0.5 5,849 / 1,442 / 585.";
        /// Logit without any cue.
        pub moves_bias: f32 = -2.74, "nat", (-100 to 100), FITTED;
        /// Weight of the evidence beyond what the hypothesis test asked for.
        pub moves_margin: f32 = 7.72, "nat", (-100 to 100), FITTED;
        /// Weight of the share of a cluster's columns whose tracklets moved.
        pub moves_share: f32 = 1.81, "nat", (-100 to 100), FITTED;
        /// Weight of the residual of the motion.
        pub moves_residual: f32 = 1.51, "nat", (-100 to 100), FITTED;
        /// Weight of the logarithm of the number of returns that were registered.
        pub moves_returns: f32 = -0.05, "nat", (-100 to 100), FITTED;
        /// Weight of how certain those tracklets were.
        pub moves_certainty: f32 = 0.46, "nat", (-100 to 100), FITTED;
        /// Weight of the share of earlier looks at a cluster's voxels that found something.
        pub moves_worn: f32 = -1.57, "nat", (-100 to 100), FITTED;
        /// Weight of the share that found nothing.
        pub moves_fresh: f32 = 1.31, "nat", (-100 to 100), FITTED;
        /// Weight of by how much a column's own returns fit rest worse than the motion.
        pub moves_misfit: f32 = 1.92, "nat", (-100 to 100), FITTED;
    }
}
