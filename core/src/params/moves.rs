//! Parameters for deciding whether a column moves: see [`crate::refinement::forest`].

crate::params! {
    /// What P(moves) decides.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MovesParams {
        /// Minimum P(moves) of anything reported as moving.
        pub moves_min: f32 = 0.3, "", (0 to 1),
            "Precision and recall of columns reported as moving (`raywake-lab sim --sweeps 25`, \
             `vlp32x2` and `hdl64`) at 0.2, here and at 0.4: slow streets (`--drives 4 --seed \
             9001`) 96.7 and 95.6 %, 97.2 and 95.4, 97.7 and 95.1; residential ones (`--drives 6 \
             --seed 8181`) 95.3 and 93.7, 96.3 and 93.1, 97.1 and 92.4. `kitti_raw_0005`: 81.1 and \
             95.2 at 0.2, 81.8 and 94.8 here.";
        /// The same for the first two pairs of a recording or after a gap, if that is more: little
        /// is known then.
        pub moves_min_first: f32 = 0.5, "", (0 to 1),
            "Precision and recall, pair by pair without history (`eval --pairs`, all rigs, \
             `--sweeps 20`, `--drives 2 --seed 9400` and `--drives 3 --seed 9450` on slow streets, \
             9700 and 9750 on broad ones): 92.3 and 93.2 %, 96.4 and 95.2 at 0.2; 96.2 and 90.0, \
             98.2 and 90.8 here.";
    }
}
