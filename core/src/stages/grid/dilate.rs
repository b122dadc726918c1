//! The foreground grown by one column either way.

use crate::record::SweepUniform;

/// 1 where a column or one of the eight beside it is marked.
pub fn dilate(sweep: &SweepUniform, foreground_marks: &[u32], dilated_marks: &mut [u32]) {
    let side = sweep.side;
    for (column, dilated) in dilated_marks.iter_mut().enumerate() {
        let (i, j) = (column as i32 / side, column as i32 % side);
        let rows = (i - 1).max(0)..=(i + 1).min(side - 1);
        *dilated = rows
            .flat_map(|i| ((j - 1).max(0)..=(j + 1).min(side - 1)).map(move |j| i * side + j))
            .any(|c| foreground_marks[c as usize] != 0) as u32;
    }
}
