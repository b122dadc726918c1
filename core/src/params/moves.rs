//! Parameters for deciding whether a column moves: see [`crate::refinement::cues`].

/// The source of the weights.
const FITTED: &str = "Fitted by `raywake-lab train moves` to columns of 44 simulated drives \
                      (`raywake-lab sim`, each rig: `--drives 3 --sweeps 25 --seed 9100`, \
                      `--drives 5 --sweeps 20 --seed 9200 --scenery street-fast`, `--drives 3 \
                      --sweeps 20 --seed 9300 --scenery street-cluttered`; `eval --moving 0 --set \
                      could_move_min=-8`), before there were \
                      `moves_no_history`, `acceleration_mps2` and `passed_worn_min`, with the \
                      encoder trained on 500 drives.";

crate::params! {
    /// How cues become P(moves): logistic regression, one weight per cue.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MovesParams {
        /// Minimum P(moves) of anything reported as moving.
        pub moves_min: f32 = 0.4, "", (0 to 1),
            "The smallest of 0.3, 0.4 and 0.5 at which fewer than one in 2,000 returns of a \
             static simulated street are reported as moving. Precision and recall of columns on \
             simulated streets of another seed than the weights (as for `could_move_min`; slow and \
             plain, `vlp32x2`): 95.4 and 91.1, 96.2 and 97.5 % at 0.3; 95.8 and 90.3, 96.4 and \
             97.3 here; 96.2 and 89.4, 96.8 and 97.0 at 0.5.";
        /// Logit without any cue.
        pub moves_bias: f32 = -5.87, "nat", (-100 to 100), FITTED;
        /// Weight of the evidence in excess of what the hypothesis test required.
        pub moves_margin: f32 = 5.97, "nat", (-100 to 100), FITTED;
        /// Weight of the share of a cluster's columns whose tracklets moved.
        pub moves_share: f32 = 3.52, "nat", (-100 to 100), FITTED;
        /// Weight of the residual of the motion.
        pub moves_residual: f32 = 2.26, "nat", (-100 to 100), FITTED;
        /// Weight of the logarithm of the number of returns that were registered.
        pub moves_returns: f32 = 0.85, "nat", (-100 to 100), FITTED;
        /// Weight of the certainty of the tracklets that moved.
        pub moves_certainty: f32 = -0.59, "nat", (-100 to 100), FITTED;
        /// Weight of the share of earlier looks at a cluster's voxels that hit something else.
        pub moves_worn: f32 = -0.51, "nat", (-100 to 100), FITTED;
        /// Weight of the share of those looks that found nothing.
        pub moves_fresh: f32 = 1.44, "nat", (-100 to 100), FITTED;
        /// Weight of how much worse a column's own returns fit rest than the motion.
        pub moves_misfit: f32 = 1.51, "nat", (-100 to 100), FITTED;
        /// Weight of the encoder's could-move score.
        pub moves_could_move: f32 = 0.36, "", (-100 to 100), FITTED;
        /// Weight of there having been no sweep before the pair, or only one.
        pub moves_no_history: f32 = 0.9, "nat", (-100 to 100),
            "Fitted alone, the other weights given, to the pairs of the same \
             drives on their own (`eval --pairs --moving 0 --set could_move_min=-8`, `train moves \
             --only moves_no_history OUT/pairs`). On drives, those and twelve crowded \
             ones (`--drives 3 --sweeps 20 --seed 9400 --scenery street-crowded`), first pairs \
             give 1.07, second ones 0.98. On every fifth drive, held out, \
             the loss over pairs is 0.094 with it, 0.104 without it.";
        /// Weight of the test's finding that the cluster is static.
        pub moves_stands: f32 = 0.75, "nat", (-100 to 100), FITTED;
    }
}
