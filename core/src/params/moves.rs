//! Parameters for deciding whether a column moves: see [`crate::refinement::cues`].

crate::params! {
    /// What P(moves) decides.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MovesParams {
        /// Minimum P(moves) of anything reported as moving.
        pub moves_min: f32 = 0.25, "", (0 to 1),
            "Precision and recall of columns reported as moving (`raywake-lab sim --sweeps 25`, \
             `vlp32x2` and `hdl64`) at 0.2, here and at 0.3: slow streets (`--drives 4 --seed \
             9001`) 96.7 and 95.9 %, 97.1 and 95.7, 97.3 and 95.6; residential ones (`--drives 6 \
             --seed 8181`) 93.6 and 94.6, 94.1 and 94.4, 94.6 and 94.3. `kitti_raw_0005`: 81.0 and \
             94.9, 81.4 and 94.5, 82.1 and 94.0.";
        /// The same for the first two pairs of a recording or after a gap, if that is more: little
        /// is known then.
        pub moves_min_first: f32 = 0.6, "", (0 to 1),
            "Precision and recall, pair by pair without history (`eval --pairs`, all rigs, \
             `--sweeps 20`, `--drives 2 --seed 9400` and `--drives 3 --seed 9450` on slow streets, \
             9700 and 9750 on broad ones): 93.5 and 93.0 %, 96.2 and 95.3 at 0.25; 96.1 and 91.0, \
             97.6 and 93.1 at 0.5, where one column of a tunnel moves; 96.9 and 89.7, 98.1 and \
             91.9 here.";
    }
}
