//! The lattice stays fixed while the window moves.

use crate::record::{Column, SweepUniform};

/// The columns of the previous sweep, seen from the new window: cell `(i, j)` receives what was at
/// `(i + shift_x, j + shift_y)`, its levels moved by `shift_z`. Columns that come into view are
/// unknown.
pub fn shift(sweep: &SweepUniform, columns_now: &[Column], columns_before: &mut [Column]) {
    let side = sweep.side;
    let mask = (1u32 << sweep.levels) - 1;
    for (index, column) in columns_before.iter_mut().enumerate() {
        let i = index as i32 / side + sweep.shift_x;
        let j = index as i32 % side + sweep.shift_y;
        *column = [0, 0];
        if (0..side).contains(&i) && (0..side).contains(&j) && sweep.shift_z.abs() < sweep.levels {
            let [state, solid] = columns_now[(i * side + j) as usize];
            let moved = |m: u32| {
                (if sweep.shift_z >= 0 { m >> sweep.shift_z } else { m << -sweep.shift_z }) & mask
            };
            *column = [moved(state & 0xffff) | moved(state >> 16) << 16, moved(solid)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_move_with_the_window() {
        let sweep =
            SweepUniform { side: 3, levels: 4, shift_x: 1, shift_z: 1, ..Default::default() };
        let mut now = [[0; 2]; 9];
        now[8] = [0b0001 | 0b0110 << 16, 0b0100];
        let mut before = [[7; 2]; 9];
        shift(&sweep, &now, &mut before);
        // (2, 2) is seen at (1, 2), one level lower.
        assert_eq!(before[5], [0b0011 << 16, 0b0010]);
        assert!(before.iter().enumerate().all(|(n, c)| n == 5 || *c == [0, 0]));
        let up = SweepUniform { shift_x: 0, shift_z: -2, ..sweep };
        shift(&up, &now, &mut before);
        assert_eq!(before[8], [0b0100 | 0b1000 << 16, 0]);
        // A shift by the window's width is how a drive starts: nothing comes into view.
        shift(&SweepUniform { shift_x: 3, ..up }, &now, &mut before);
        assert!(before.iter().all(|c| *c == [0, 0]));
    }
}
