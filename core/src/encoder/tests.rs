//! The layers against their formulas, shifted windows with the shipped weights, and bad files.

extern crate std;
use super::*;
use crate::digest::Digest;
use crate::random::Random;
use crate::team::{SingleThread, Team};
use raywake_simd::Simd;
use std::fmt::Write;
use std::string::String;
use std::vec::Vec;

/// A weights file with these numbers.
fn file(numbers: &[i32]) -> String {
    let mut body = std::format!("kind encoder\nshape {NUMBERS}\nscale 16\nprovenance test\n");
    numbers.iter().for_each(|n| writeln!(body, "{n}").unwrap());
    std::format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
}

fn whole(random: &mut Random, range: core::ops::Range<i32>) -> i32 {
    range.start + random.below(range.len()) as i32
}

/// Random numbers, layer by layer.
fn drawn(random: &mut Random) -> Vec<i32> {
    let mut numbers = Vec::new();
    for layer in LAYERS {
        numbers.extend((0..layer.inputs * layer.outputs).map(|_| whole(random, -127..128)));
        numbers.extend((0..layer.outputs).map(|_| whole(random, -3000..9000)));
        numbers.extend((0..layer.outputs).map(|_| whole(random, 6..11)));
    }
    numbers
}

/// Random columns of a window, two fifths of them solid.
fn columns(random: &mut Random, side: usize) -> Vec<Column> {
    let one = |random: &mut Random| {
        let [free, occupied] = [0; 2].map(|_| random.below(1 << LEVELS) as u32);
        [free & !occupied | occupied << 16, u32::from(random.below(5) < 2)]
    };
    (0..side * side).map(|_| one(random)).collect()
}

/// A team of one thread with this instruction set.
struct OneThread(Simd);

impl Team for OneThread {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        SingleThread.join(a, b);
    }

    fn simd(&self) -> Simd {
        self.0
    }
}

/// The scores, the same with every instruction set.
fn encoded(
    weights: &EncoderWeights,
    columns: &[Column],
    side: usize,
    corner: [i32; 2],
) -> Vec<ColumnScores> {
    // A new one each time: nothing is left of an earlier result.
    let scores_with = |simd| {
        let mut encoder = raywake_alloc_guard::boxed!(Encoder, Encoder::new());
        encoder.set_weights(Some(weights));
        encoder.keep(columns, side, corner);
        encoder.encode(&OneThread(simd));
        encoder.scores().to_vec()
    };
    let scores = scores_with(Simd::BASELINE);
    for simd in Simd::available() {
        assert_eq!(scores_with(simd), scores, "{}", simd.name());
    }
    scores
}

/// The network written out plainly: levels of `[row][column][channel]`, loops over everything.
struct Naive<'a> {
    numbers: &'a [i32],
}

type Level = Vec<Vec<Vec<i32>>>;

impl Naive<'_> {
    /// Sums of a layer, shifted but not clamped.
    fn shifted(&self, layer: usize, x: &[i32]) -> Vec<i32> {
        let Layer { inputs, outputs } = LAYERS[layer];
        let [weights, all] = before(layer);
        let numbers = &self.numbers[weights + 2 * all..];
        let value = |o: usize| {
            let own = if inputs == 9 { &x[o * 9..][..9] } else { x };
            let products = own.iter().zip(&numbers[o * inputs..]).map(|(x, w)| x * w);
            let biased = products.sum::<i32>() + numbers[inputs * outputs + o];
            biased >> numbers[inputs * outputs + outputs + o]
        };
        (0..outputs).map(value).collect()
    }

    fn cut(x: Vec<i32>) -> Vec<i32> {
        x.into_iter().map(|x| x.clamp(0, TOP)).collect()
    }

    fn plus(x: &[i32], y: &[i32]) -> Vec<i32> {
        x.iter().zip(y).map(|(x, y)| (x + y).clamp(0, TOP)).collect()
    }

    fn level(side: usize, cell: impl Fn(usize, usize) -> Vec<i32>) -> Level {
        (0..side).map(|i| (0..side).map(|j| cell(i, j)).collect()).collect()
    }

    fn down(&self, layer: usize, x: &Level) -> Level {
        Naive::level(x.len() / 2, |i, j| {
            let four = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let all: Vec<i32> =
                four.iter().flat_map(|(a, b)| x[2 * i + a][2 * j + b].clone()).collect();
            Naive::cut(self.shifted(layer, &all))
        })
    }

    fn block(&self, layer: usize, x: &Level) -> Level {
        let side = x.len();
        let at = |i: usize, j: usize, c: usize| {
            let cell = x.get(i.wrapping_sub(1)).and_then(|row| row.get(j.wrapping_sub(1)));
            cell.map_or(0, |cell| cell[c])
        };
        let beside = Naive::level(side, |i, j| {
            let taps: Vec<i32> = (0..LAYERS[layer].outputs)
                .flat_map(|c| (0..9).map(move |t| (i + t / 3, j + t % 3, c)))
                .map(|(i, j, c)| at(i, j, c))
                .collect();
            Naive::cut(self.shifted(layer, &taps))
        });
        Naive::level(side, |i, j| Naive::plus(&x[i][j], &self.shifted(layer + 1, &beside[i][j])))
    }

    fn up(&self, layer: usize, from: &Level, to: &Level) -> Level {
        Naive::level(to.len(), |i, j| {
            Naive::plus(&to[i][j], &self.shifted(layer, &from[i / 2][j / 2]))
        })
    }

    fn scores(&self, columns: &[Column], side: usize, corner: [i32; 2]) -> Vec<ColumnScores> {
        let phase = corner.map(|c| c.rem_euclid(8) as usize);
        let own = |i: usize, j: usize| -> Vec<i32> {
            let inside = |n: usize, p: usize| (p..p + side).contains(&n);
            let masks = match inside(i, phase[0]) && inside(j, phase[1]) {
                true => columns[(i - phase[0]) * side + j - phase[1]][0],
                false => 0,
            };
            let bits = (0..LEVELS).chain(16..16 + LEVELS);
            let x: Vec<i32> = bits.map(|bit| (masks >> bit & 1) as i32 * ONE).collect();
            Naive::cut(self.shifted(COLUMN, &x))
        };
        let x0 = Naive::level((side + 7).next_multiple_of(8), own);
        let blocks = |firsts: &[usize], x| firsts.iter().fold(x, |x, l| self.block(*l, &x));
        let x1 = blocks(&BLOCKS_FINE, self.down(DOWN_FINE, &x0));
        let x2 = blocks(&BLOCKS_MIDDLE, self.down(DOWN_MIDDLE, &x1));
        let x3 = blocks(&BLOCKS_COARSE, self.down(DOWN_COARSE, &x2));
        let x2 = self.up(UP_MIDDLE, &x3, &x2);
        let x1 = self.block(BLOCK_AFTER, &self.up(UP_FINE, &x2, &x1));
        let score = |n: usize| -> ColumnScores {
            if columns[n][1] == 0 {
                return [0; SCORES];
            }
            let [i, j] = [n / side + phase[0], n % side + phase[1]];
            let around = Naive::cut(self.shifted(UP_COLUMN, &x1[i / 2][j / 2]));
            let x = [around, x0[i][j].clone()].concat();
            let hidden = Naive::cut(self.shifted(HEAD, &x));
            let scores = self.shifted(SCORE, &hidden);
            core::array::from_fn(|k| scores[k].clamp(-TOP, TOP) as i8)
        };
        (0..side * side).map(score).collect()
    }
}

#[test]
fn scores_follow_the_formulas() {
    let mut random = Random(11);
    for (side, corner) in [(41, [0, 0]), (40, [-3, 13]), (7, [5, 2]), (1, [7, 7])] {
        let numbers = drawn(&mut random);
        let columns = columns(&mut random, side);
        let mut weights = EncoderWeights::new();
        weights.load(&file(&numbers), LEVELS).unwrap();
        let scores = encoded(&weights, &columns, side, corner);
        assert!(scores == Naive { numbers: &numbers }.scores(&columns, side, corner), "{side}");
        assert!(side < 40 || scores.iter().collect::<std::collections::BTreeSet<_>>().len() > 50);
    }
}

#[test]
fn static_structure_keeps_its_scores_when_the_window_shifts() {
    let mut weights = EncoderWeights::new();
    weights.load(SHIPPED, LEVELS).unwrap();
    let mut random = Random(12);
    let (side, shift) = (160, 3);
    // World columns as two windows see them; near the rim, scores depend on what lies beyond.
    let world = columns(&mut random, side + shift);
    let window = |from: usize| -> Vec<Column> {
        let rows = (from..from + side).map(|i| &world[i * (side + shift)..][..side]);
        rows.flatten().copied().collect()
    };
    let first = encoded(&weights, &window(0), side, [100, 7]);
    let second = encoded(&weights, &window(shift), side, [100 + shift as i32, 7]);
    // The receptive field reaches 63 columns: an octet and two more on either side, plus blocks of
    // finer cells.
    let middle = |n: usize| (66..side - 66 - shift).contains(&n);
    let both = (0..side * side).filter(|n| middle(n / side) && middle(n % side));
    assert!(both.clone().count() > 500);
    assert!(both.into_iter().all(|n| first[n + shift * side] == second[n]));
}

#[test]
fn files_that_do_not_fit_are_refused() {
    let numbers = drawn(&mut Random(13));
    let mut weights = EncoderWeights::new();
    let mut fails = |change: &dyn Fn(&mut Vec<i32>), levels| {
        let mut changed = numbers.clone();
        change(&mut changed);
        weights.load(&file(&changed), levels).unwrap_err()
    };
    assert_eq!(fails(&|_| (), LEVELS - 1), WeightsError::Shape);
    assert_eq!(fails(&|n| n[0] = 128, LEVELS), WeightsError::Range);
    assert_eq!(fails(&|n| n[BITS * 16] = BIAS_MAX, LEVELS), WeightsError::Range);
    assert_eq!(fails(&|n| n[BITS * 16 + 16] = SHIFT_MAX + 1, LEVELS), WeightsError::Range);
    assert_eq!(fails(&|n| n[BITS * 16 + 16] = -1, LEVELS), WeightsError::Range);
    assert!(matches!(fails(&|n| n.truncate(NUMBERS - 1), LEVELS), WeightsError::Value(_)));
}
