//! Parameters of whether a column moves: see [`crate::refinement::cues`].

/// Where the weights come from.
const FITTED: &str = "Fitted by `raywake-lab train moves` on twenty simulated drives (`raywake-lab \
                      sim`, each rig: `--drives 3 --sweeps 30 --seed 4100`, and `--drives 2 \
                      --sweeps 25 --seed 4200 --scenery street-cluttered`; `eval --moving 0`): \
                      Brier score 0.022 on what was held out.";

crate::params! {
    /// How cues become P(moves): logistic regression, one weight a cue.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MovesParams {
        /// What is put out as moving has at least this P(moves).
        pub moves_min: f32 = 0.3, "", (0 to 1),
            "Columns true / false / missed of `kitti_raw_0005`: 5,972 / 1,401 / 462; at 0.2 \
             5,990 / 1,459 / 444, at 0.5 5,934 / 1,305 / 500.";
        /// Logit without any cue.
        pub moves_bias: f32 = -2.85, "nat", (-100 to 100), FITTED;
        /// Weight of the evidence beyond what the hypothesis test asked for.
        pub moves_margin: f32 = 5.60, "nat", (-100 to 100), FITTED;
        /// Weight of the share of a cluster's columns whose tracklets moved.
        pub moves_share: f32 = 3.09, "nat", (-100 to 100), FITTED;
        /// Weight of the residual of the motion.
        pub moves_residual: f32 = 0.88, "nat", (-100 to 100), FITTED;
        /// Weight of the logarithm of the number of returns that were registered.
        pub moves_returns: f32 = -0.35, "nat", (-100 to 100), FITTED;
        /// Weight of how certain those tracklets were.
        pub moves_certainty: f32 = -0.53, "nat", (-100 to 100), FITTED;
        /// Weight of the share of earlier looks at a cluster's voxels that found something.
        pub moves_worn: f32 = -3.09, "nat", (-100 to 100), FITTED;
        /// Weight of the share that found nothing.
        pub moves_fresh: f32 = 3.12, "nat", (-100 to 100), FITTED;
        /// Weight of by how much a column's own returns fit rest worse than the motion.
        pub moves_misfit: f32 = 1.96, "nat", (-100 to 100), FITTED;
        /// Weight of the encoder's score of what could move.
        pub moves_could_move: f32 = 0.83, "", (-100 to 100), FITTED;
    }
}
