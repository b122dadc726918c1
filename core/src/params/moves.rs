//! Parameters of whether a column moves: see [`crate::refinement::cues`].

/// Where the weights come from.
const FITTED: &str = "Fitted by `raywake-lab train moves` to the columns it decides of, of 44 \
                      simulated drives (`raywake-lab sim`, each rig: `--drives 3 --sweeps 25 \
                      --seed 9100`, `--drives 5 --sweeps 20 --seed 9200 --scenery street-fast`, \
                      `--drives 3 --sweeps 20 --seed 9300 --scenery street-cluttered`; \
                      `eval --moving 0`).";

crate::params! {
    /// How cues become P(moves): logistic regression, one weight a cue.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MovesParams {
        /// What is put out as moving has at least this P(moves).
        pub moves_min: f32 = 0.6, "", (0 to 1),
            "The most that keeps a recall of 0.95 on simulated streets of other seeds than \
             those the weights are from (four rigs in three sceneries): precision and recall of \
             columns 95.6 and 96.0 % at 0.3, 95.9 and 95.8 at 0.45, 96.3 and 95.4 here.";
        /// Logit without any cue.
        pub moves_bias: f32 = -4.00, "nat", (-100 to 100), FITTED;
        /// Weight of the evidence beyond what the hypothesis test asked for.
        pub moves_margin: f32 = 1.48, "nat", (-100 to 100), FITTED;
        /// Weight of the share of a cluster's columns whose tracklets moved.
        pub moves_share: f32 = 1.97, "nat", (-100 to 100), FITTED;
        /// Weight of the residual of the motion.
        pub moves_residual: f32 = 0.87, "nat", (-100 to 100), FITTED;
        /// Weight of the logarithm of the number of returns that were registered.
        pub moves_returns: f32 = 1.16, "nat", (-100 to 100), FITTED;
        /// Weight of how certain those tracklets were.
        pub moves_certainty: f32 = -0.19, "nat", (-100 to 100), FITTED;
        /// Weight of the share of earlier looks at a cluster's voxels that found something.
        pub moves_worn: f32 = -4.10, "nat", (-100 to 100), FITTED;
        /// Weight of the share that found nothing.
        pub moves_fresh: f32 = 0.04, "nat", (-100 to 100), FITTED;
        /// Weight of by how much a column's own returns fit rest worse than the motion.
        pub moves_misfit: f32 = 1.42, "nat", (-100 to 100), FITTED;
        /// Weight of the encoder's score of what could move.
        pub moves_could_move: f32 = 0.37, "", (-100 to 100), FITTED;
    }
}
