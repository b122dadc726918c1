//! The layers, evaluated for many cells at a time.
//!
//! Sums are kept in memory, those of a cell contiguous, and every loop over them has a fixed
//! length: compilers vectorise that for every instruction set, which they do not reliably do for
//! sums held in individual registers.

use super::layers::*;
use super::load::EncoderWeights;
use super::rows::{Plane, each_row, gathered};
use super::{ColumnScores, FINE, PaddedWindow};
use crate::team::Team;
use raywake_simd::Simd;

/// Cells whose inputs are gathered together, and whose sums are computed together. A multiple of
/// the number that [`Simd::add_products`] holds in registers; not measured otherwise.
const CELLS: usize = 16;

/// Sums of a cell, biases included, and the shifts that scale them back to activations.
struct CellSums<'a, const OUT: usize> {
    sums: &'a [i32; OUT],
    shifts: &'a [u8; OUT],
}

impl<const OUT: usize> CellSums<'_, OUT> {
    #[inline(always)]
    fn activations(&self) -> [u8; OUT] {
        let mut activations = [0; OUT];
        for ((to, sum), shift) in activations.iter_mut().zip(self.sums).zip(self.shifts) {
            *to = activation(*sum, *shift);
        }
        activations
    }

    #[inline(always)]
    fn scores(&self) -> [i8; OUT] {
        let mut scores = [0; OUT];
        for ((score, sum), shift) in scores.iter_mut().zip(self.sums).zip(self.shifts) {
            *score = (sum >> shift).clamp(-TOP, TOP) as i8;
        }
        scores
    }
}

/// Writes the activations to a cell.
#[inline(always)]
fn write_to<const OUT: usize>(sums: &CellSums<OUT>, cell: &mut [u8; OUT]) {
    *cell = sums.activations();
}

/// Adds the shifted sums to the activations of a cell.
#[inline(always)]
fn add_to<const OUT: usize>(sums: &CellSums<OUT>, cell: &mut [u8; OUT]) {
    for (n, value) in cell.iter_mut().enumerate() {
        let sum = i32::from(*value) + (sums.sums[n] >> sums.shifts[n]);
        *value = sum.clamp(0, TOP) as u8;
    }
}

/// The cells of a row.
#[inline(always)]
fn cells<const CHANNELS: usize>(row: &mut [u8]) -> &mut [[u8; CHANNELS]] {
    row.as_chunks_mut().0
}

impl EncoderWeights {
    /// The activations of a column, from its masks.
    #[inline(always)]
    fn column(&self, masks: u32) -> [u8; COLUMN_CHANNELS] {
        let bytes = masks.to_le_bytes();
        let (_, biases, shifts) = self.layer::<BITS, COLUMN_CHANNELS>(COLUMN);
        let mut sums = *biases;
        for (table, byte) in self.bytes.iter().zip(bytes) {
            for (sum, of_byte) in sums.iter_mut().zip(&table[byte as usize]) {
                *sum += i32::from(*of_byte);
            }
        }
        CellSums { sums: &sums, shifts }.activations()
    }

    /// Weights, biases and shifts of a layer.
    #[inline(always)]
    fn layer<const IN: usize, const OUT: usize>(
        &self,
        layer: usize,
    ) -> (&[i16], &[i32; OUT], &[u8; OUT]) {
        assert!(LAYERS[layer] == Layer { inputs: IN, outputs: OUT });
        let [first, output] = before(layer);
        let biases = self.biases[output..].first_chunk().expect("as many");
        let shifts = self.shifts[output..].first_chunk().expect("as many");
        (&self.weights[first..][..IN * OUT], biases, shifts)
    }

    /// Applies a dense layer to `count` cells: `input` supplies a cell's inputs, `done` receives
    /// its sums.
    #[inline(always)]
    fn dense<const IN: usize, const OUT: usize>(
        &self,
        simd: Simd,
        layer: usize,
        count: usize,
        input: impl Fn(usize) -> [u8; IN],
        mut done: impl FnMut(usize, CellSums<OUT>),
    ) {
        let (weights, biases, shifts) = self.layer::<IN, OUT>(layer);
        let weights = weights.as_chunks().0.as_chunks::<OUT>().0;
        let (mut inputs, mut sums) = ([[0; IN]; CELLS], [[0; OUT]; CELLS]);
        for from in (0..count).step_by(CELLS) {
            let cells = CELLS.min(count - from);
            for (n, inputs) in inputs[..cells].iter_mut().enumerate() {
                // Not `map`, which compilers neither inline nor vectorise for long arrays.
                for (to, x) in inputs.iter_mut().zip(input(from + n)) {
                    *to = i16::from(x);
                }
            }
            sums[..cells].fill(*biases);
            simd.add_products(weights, &inputs[..cells], &mut sums[..cells]);
            sums[..cells].iter().enumerate().for_each(|(n, sums)| {
                done(from + n, CellSums { sums, shifts });
            });
        }
    }

    /// Computes one row of a depthwise layer's outputs.
    #[inline(always)]
    fn depthwise<const CHANNELS: usize>(
        &self,
        layer: usize,
        level: Plane<CHANNELS>,
        row: usize,
        out: &mut [[u8; CHANNELS]],
    ) {
        let (weights, biases, shifts) = self.layer::<TAPS, CHANNELS>(layer);
        let weights = weights.as_chunks().0.as_chunks().0;
        let (mut sums, side) = ([*biases; FINE], level.side);
        let sums = &mut sums[..side];
        for (tap, weights) in weights.iter().enumerate() {
            // Wraps below zero and is then outside the level, which is padded with zeros.
            let i = (row + tap).wrapping_sub(1);
            if i < side {
                add_depthwise(sums, level.row(i), weights);
            }
        }
        for (cell, sums) in out.iter_mut().zip(sums) {
            *cell = CellSums { sums, shifts }.activations();
        }
    }

    /// Applies a dense layer to all cells of a level with `side` cells along an axis: `input`
    /// supplies the inputs of the cell at a row and a place in it, `done` receives its sums and its
    /// cell in `to`.
    #[inline(always)]
    fn dense_level<const IN: usize, const OUT: usize>(
        &self,
        team: &impl Team,
        layer: usize,
        side: usize,
        to: &mut [u8],
        input: impl Fn(usize, usize) -> [u8; IN] + Sync + Copy,
        done: impl Fn(&CellSums<OUT>, &mut [u8; OUT]) + Sync + Copy,
    ) {
        each_row(
            team,
            to,
            side * OUT,
            #[inline(always)]
            move |simd, row, out| {
                let out = cells::<OUT>(out);
                self.dense(
                    simd,
                    layer,
                    side,
                    #[inline(always)]
                    |at| input(row, at),
                    #[inline(always)]
                    |at, sums| done(&sums, &mut out[at]),
                );
            },
        );
    }

    /// Computes the finest level, with 2 x 2 columns per cell.
    pub(super) fn down_from_columns(
        &self,
        team: &impl Team,
        window: &PaddedWindow,
        side: usize,
        to: &mut [u8],
    ) {
        self.dense_level(
            team,
            DOWN_FINE,
            side,
            to,
            #[inline(always)]
            |row, at| {
                let mut x = [0; 4 * COLUMN_CHANNELS];
                for (n, x) in cells(&mut x).iter_mut().enumerate() {
                    *x = self.column(window.masks(2 * row + n / 2, 2 * at + n % 2));
                }
                x
            },
            write_to::<FINE_CHANNELS>,
        );
    }

    /// Computes the next coarser level, each cell from the `ALL` numbers of 2 x 2 cells.
    pub(super) fn down<const IN: usize, const ALL: usize, const OUT: usize>(
        &self,
        team: &impl Team,
        layer: usize,
        from: Plane<IN>,
        to: &mut [u8],
    ) {
        self.dense_level(
            team,
            layer,
            from.side / 2,
            to,
            #[inline(always)]
            |row, at| gathered::<IN, ALL>(&from, row, at),
            write_to::<OUT>,
        );
    }

    /// Applies a block to a level: a depthwise layer into `beside`, then a dense one added to the
    /// level.
    pub(super) fn block<const CHANNELS: usize>(
        &self,
        team: &impl Team,
        first: usize,
        side: usize,
        level: &mut [u8],
        beside: &mut [u8],
    ) {
        let from = Plane::<CHANNELS> { side, cells: level };
        each_row(
            team,
            beside,
            side * CHANNELS,
            #[inline(always)]
            move |_, row, out| self.depthwise(first, from, row, cells(out)),
        );
        let from = Plane::<CHANNELS> { side, cells: beside };
        self.dense_level(
            team,
            first + 1,
            side,
            level,
            #[inline(always)]
            |row, at| *from.at(row, at),
            add_to::<CHANNELS>,
        );
    }

    /// Applies a layer from a level to the next finer one, adding the result to its cells.
    pub(super) fn up<const IN: usize, const OUT: usize>(
        &self,
        team: &impl Team,
        layer: usize,
        from: Plane<IN>,
        to: &mut [u8],
    ) {
        let length = 2 * from.side * OUT;
        each_row(
            team,
            to,
            2 * length,
            #[inline(always)]
            move |simd, row, out| {
                let (upper, lower) = out.split_at_mut(length);
                let mut lines = [cells::<OUT>(upper), cells::<OUT>(lower)];
                self.dense(
                    simd,
                    layer,
                    from.side,
                    #[inline(always)]
                    |at| *from.at(row, at),
                    #[inline(always)]
                    |at, sums| {
                        for cell in lines.iter_mut().flat_map(|line| &mut line[2 * at..][..2]) {
                            add_to(&sums, cell);
                        }
                    },
                );
            },
        );
    }

    /// Computes the features around the columns of each pair.
    pub(super) fn around_columns(
        &self,
        team: &impl Team,
        from: Plane<FINE_CHANNELS>,
        to: &mut [u8],
    ) {
        self.dense_level(
            team,
            UP_COLUMN,
            from.side,
            to,
            #[inline(always)]
            |row, at| *from.at(row, at),
            write_to::<COLUMN_CHANNELS>,
        );
    }

    /// Computes the scores of `count` columns from their masks and the features around them.
    #[inline(always)]
    pub(super) fn head<'a>(
        &self,
        simd: Simd,
        count: usize,
        masks: impl Fn(usize) -> u32,
        around: impl Fn(usize) -> &'a [u8; COLUMN_CHANNELS],
        mut done: impl FnMut(usize, ColumnScores),
    ) {
        let mut hidden = [[0; HEAD_CHANNELS]; CELLS];
        for from in (0..count).step_by(CELLS) {
            let columns = CELLS.min(count - from);
            self.dense(
                simd,
                HEAD,
                columns,
                #[inline(always)]
                |n| {
                    let mut x = [0; 2 * COLUMN_CHANNELS];
                    let own = self.column(masks(from + n));
                    cells(&mut x).copy_from_slice(&[*around(from + n), own]);
                    x
                },
                #[inline(always)]
                |n, sums| hidden[n] = sums.activations(),
            );
            self.dense(
                simd,
                SCORE,
                columns,
                #[inline(always)]
                |n| hidden[n],
                #[inline(always)]
                |n, sums| done(from + n, sums.scores()),
            );
        }
    }
}

/// Adds the products of a line of cells, and of the cells before and after each, to a row's sums.
#[inline(always)]
fn add_depthwise<const CHANNELS: usize>(
    sums: &mut [[i32; CHANNELS]],
    line: &[[u8; CHANNELS]],
    weights: &[[i16; CHANNELS]; 3],
) {
    let [left, middle, right] = weights;
    let last = line.len() - 1;
    add_products(&mut sums[0], &line[0], middle);
    if last > 0 {
        add_products(&mut sums[0], &line[1], right);
        add_products(&mut sums[last], &line[last - 1], left);
        add_products(&mut sums[last], &line[last], middle);
    }
    for (sums, around) in sums[1..].iter_mut().zip(line.array_windows()) {
        let [a, b, c] = around;
        for n in 0..CHANNELS {
            sums[n] += i32::from(a[n]) * i32::from(left[n])
                + i32::from(b[n]) * i32::from(middle[n])
                + i32::from(c[n]) * i32::from(right[n]);
        }
    }
}

#[inline(always)]
fn add_products<const N: usize>(sums: &mut [i32; N], x: &[u8; N], weights: &[i16; N]) {
    for n in 0..N {
        sums[n] += i32::from(x[n]) * i32::from(weights[n]);
    }
}
