//! Background filter (section 3.4.2): which columns may move.
//!
//! A logistic classifier over the free and occupied voxels of 5x5 columns (3.4-3.7). Its decision,
//! score > 0, needs no sigmoid; the threshold is part of the bias. Weights are integers, in a table
//! of sums by whole bytes of a column's masks: 100 lookups replace 700 products.

use crate::params::{Frame, LEVELS_MAX};
use crate::record::{Column, SweepUniform};
use crate::weights::{Weights, WeightsError};

/// Columns of the patch along one axis.
pub const PATCH: usize = 5;
/// Entries of the lookup table: patch column, byte of its masks, value of the byte.
pub const FILTER_TABLE: usize = PATCH * PATCH * 4 * 256;
/// Words of the table followed by the bias.
pub const TABLE_WORDS: usize = FILTER_TABLE + 1;

/// Fills `table`, which must hold [`TABLE_WORDS`] elements, from a weights file of kind
/// `background`, shape (25 columns with di outermost, 2 for free then occupied, levels).
pub fn load(text: &str, levels: usize, table: &mut [i32]) -> Result<(), WeightsError> {
    assert!(table.len() == TABLE_WORDS && levels <= LEVELS_MAX);
    let weights = Weights::parse(text, "background", &[PATCH * PATCH, 2, levels], 1)?;
    let largest: i64 = weights.values().map(|w| (w as i64).abs()).sum();
    if largest > i32::MAX as i64 {
        return Err(WeightsError::Range);
    }
    let mut values = weights.values();
    for patch in table[..FILTER_TABLE].chunks_exact_mut(4 * 256) {
        let mut of_bit = [0; 32];
        for state in of_bit.chunks_exact_mut(16) {
            state[..levels].fill_with(|| values.next().unwrap_or(0));
        }
        for (bits, bytes) in of_bit.chunks_exact(8).zip(patch.chunks_exact_mut(256)) {
            fill_byte_table(bits, bytes);
        }
    }
    table[FILTER_TABLE] = values.next().unwrap_or(0);
    Ok(())
}

/// `bytes[b]` becomes the sum of `bits[n]` over the set bits `n` of `b`.
fn fill_byte_table(bits: &[i32], bytes: &mut [i32]) {
    bytes[0] = 0;
    for (n, bit) in bits.iter().enumerate() {
        let (without, with) = bytes[..2 << n].split_at_mut(1 << n);
        with.iter_mut().zip(without).for_each(|(with, without)| *with = *without + bit);
    }
}

/// Score of a column (3.6) times the scale of the weights: the bias plus the weight of every free
/// and every occupied voxel of the 5x5 columns around it. Columns outside the window are unknown.
pub fn score(sweep: &SweepUniform, filter_table: &[i32], columns: &[Column], column: usize) -> i32 {
    let (tables, mut sum) = tables(filter_table);
    each_of_patch(sweep, columns, column, |patch, masks| {
        for bit in (0..32).filter(|bit| masks >> bit & 1 == 1) {
            sum += tables[patch][bit / 8][1 << (bit % 8)];
        }
    });
    sum
}

/// [`score`] by whole bytes.
fn score_by_bytes(
    sweep: &SweepUniform,
    filter_table: &[i32],
    columns: &[Column],
    column: usize,
) -> i32 {
    let (tables, mut sum) = tables(filter_table);
    each_of_patch(sweep, columns, column, |patch, masks| {
        for (table, byte) in tables[patch].iter().zip(masks.to_le_bytes()) {
            sum += table[byte as usize];
        }
    });
    sum
}

/// The tables of every patch column, one for each byte of its masks, and the bias.
#[inline]
fn tables(filter_table: &[i32]) -> (&[[[i32; 256]; 4]], i32) {
    (filter_table.as_chunks().0.as_chunks().0, filter_table[FILTER_TABLE])
}

/// Calls `each` with the position in the patch and the masks of its columns that are in the window.
#[inline]
fn each_of_patch(
    sweep: &SweepUniform,
    columns: &[Column],
    column: usize,
    mut each: impl FnMut(usize, u32),
) {
    const REACH: usize = PATCH / 2;
    let side = sweep.side as usize;
    let (i, j) = (column / side, column % side);
    let (first, last) = (j.saturating_sub(REACH), (j + REACH).min(side - 1));
    for line in i.saturating_sub(REACH)..=(i + REACH).min(side - 1) {
        let patch = (line + REACH - i) * PATCH + (first + REACH - j);
        let columns = &columns[line * side + first..=line * side + last];
        columns.iter().enumerate().for_each(|(n, [masks, _])| each(patch + n, *masks));
    }
}

/// Marks the foreground of the previous sweep: 1 if a column is solid and scores above zero (or,
/// unfiltered, is solid), otherwise 0.
pub fn background_filter(
    sweep: &SweepUniform,
    filter_table: &[i32],
    columns_before: &[Column],
    foreground_marks: &mut [u32],
) {
    mark(sweep, columns_before, 0, foreground_marks, |column| {
        score(sweep, filter_table, columns_before, column)
    });
}

/// [`background_filter`] for the scalar backend.
pub fn background_filter_by_bytes(
    sweep: &SweepUniform,
    filter_table: &[i32],
    columns_before: &[Column],
    foreground_marks: &mut [u32],
) {
    mark_by_bytes(sweep, filter_table, columns_before, 0, foreground_marks);
}

/// The same for the columns from `first` on.
pub(super) fn mark_by_bytes(
    sweep: &SweepUniform,
    filter_table: &[i32],
    columns_before: &[Column],
    first: usize,
    foreground_marks: &mut [u32],
) {
    mark(sweep, columns_before, first, foreground_marks, |column| {
        score_by_bytes(sweep, filter_table, columns_before, column)
    });
}

fn mark(
    sweep: &SweepUniform,
    columns_before: &[Column],
    first: usize,
    foreground_marks: &mut [u32],
    score: impl Fn(usize) -> i32,
) {
    for (column, mark) in (first..).zip(foreground_marks) {
        let solid = columns_before[column][1] != 0;
        *mark = (solid && (sweep.unfiltered != 0 || score(column) > 0)) as u32;
    }
}

/// The filter shipped with the program: see the file's provenance.
pub const SHIPPED: &str = include_str!("../../weights/background.txt");

/// The filter shipped for a frame: for the lattice, ours; for the vehicle's frame, trained as in
/// section 3.4.2.
pub fn shipped(frame: Frame) -> &'static str {
    match frame {
        Frame::Lattice => SHIPPED,
        Frame::Sensor => include_str!("../../weights/background_as_printed.txt"),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::digest::Digest;
    use std::fmt::Write;
    use std::string::String;
    use std::vec;

    #[test]
    fn lookups_equal_the_sum_over_voxels() {
        let levels = 14;
        let weight = |n: usize| (n * 7919 % 2001) as i32 - 1000;
        let mut body =
            String::from("kind background\nshape 25 2 14\nscale 1000\nprovenance test\n");
        for n in 0..25 * 2 * levels + 1 {
            writeln!(body, "{}", weight(n)).unwrap();
        }
        let text = std::format!(
            "raywake-weights 1\nchecksum {:016x}\n{body}",
            Digest::of(body.as_bytes())
        );
        let mut table = vec![0; TABLE_WORDS];
        load(&text, levels, &mut table).unwrap();
        let sweep = SweepUniform { side: 9, levels: 14, ..Default::default() };
        let columns: std::vec::Vec<Column> = (0..81u32)
            .map(|n| {
                let free = n.wrapping_mul(2654435761) >> 18 & 0x3fff;
                [free | (!free & n.wrapping_mul(40503) & 0x3fff) << 16, n % 3]
            })
            .collect();
        for index in [0, 4, 40, 80, 17] {
            let (i, j) = (index as i32 / 9, index as i32 % 9);
            let mut sum = weight(700);
            for di in -2..=2 {
                for dj in -2..=2 {
                    let (ni, nj) = (i + di, j + dj);
                    if !(0..9).contains(&ni) || !(0..9).contains(&nj) {
                        continue;
                    }
                    let state = columns[(ni * 9 + nj) as usize][0];
                    for half in 0..2 {
                        for k in 0..levels {
                            if state >> (16 * half + k) & 1 == 1 {
                                let column = ((di + 2) * 5 + dj + 2) as usize;
                                sum += weight((column * 2 + half) * levels + k);
                            }
                        }
                    }
                }
            }
            assert_eq!(score(&sweep, &table, &columns, index), sum);
            assert_eq!(score_by_bytes(&sweep, &table, &columns, index), sum);
        }
        let all: String = (0..701).map(|_| "8000000 ").collect();
        let body =
            std::format!("kind background\nshape 25 2 14\nscale 1000\nprovenance test\n{all}\n");
        let text = std::format!(
            "raywake-weights 1\nchecksum {:016x}\n{body}",
            Digest::of(body.as_bytes())
        );
        assert_eq!(load(&text, levels, &mut table), Err(WeightsError::Range));
        let mut marks = vec![9; 81];
        background_filter(&sweep, &table, &columns, &mut marks);
        for (n, m) in marks.iter().enumerate() {
            let wanted = columns[n][1] != 0 && score(&sweep, &table, &columns, n) > 0;
            assert_eq!(*m, wanted as u32);
        }
        let by_formula = core::mem::replace(&mut marks, vec![9; 81]);
        background_filter_by_bytes(&sweep, &table, &columns, &mut marks);
        assert_eq!(marks, by_formula);
    }
}
