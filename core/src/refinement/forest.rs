//! P(moves) from cues: symmetric decision trees, which ask the same questions on every path, added
//! up (gradient boosting: Friedman, "Greedy function approximation", 2001; symmetric trees as in
//! CatBoost). Cues depend on each other in ways that no sum of weighted cues expresses: few returns
//! say little, unless the cluster moved before.

use super::cues::Cues;
use crate::weights::{Weights, WeightsError};

/// Numbers of trees: of those for what was found to move, then of those for what stands, whose few
/// cues tell little.
pub const TREES: [usize; 2] = [100, 10];
/// Number of all trees.
pub const TREES_TOTAL: usize = TREES[0] + TREES[1];
/// Number of questions that a tree asks.
pub const QUESTIONS: usize = 4;
/// Number of answers to all of them together.
pub const LEAVES: usize = 1 << QUESTIONS;
/// Numbers of a tree in a file: for each question the cue's place in [`Cues::NAMES`] and the value
/// it is compared with, then the logit of each answer.
pub const NUMBERS: usize = 2 * QUESTIONS + LEAVES;

/// The weights built in.
pub const SHIPPED: &str = include_str!("../../weights/moves.txt");

/// One tree.
#[derive(Clone, Copy)]
struct Tree {
    /// The cue that each question is about.
    cues: [u8; QUESTIONS],
    /// Whether it is above this; the first question decides the lowest bit of the answer.
    above: [f32; QUESTIONS],
    /// Logits, in steps.
    leaves: [i32; LEAVES],
}

/// Boosted trees.
#[derive(Clone, Copy)]
pub struct MovesForest {
    trees: [Tree; TREES_TOTAL],
    /// Logits without any tree, steps.
    biases: [i32; TREES.len()],
    /// Steps per nat.
    scale: f32,
}

impl MovesForest {
    /// Reads a file of kind `moves`.
    pub fn load(text: &str) -> Result<MovesForest, WeightsError> {
        let file = Weights::parse(text, "moves", &[TREES_TOTAL, NUMBERS], TREES.len())?;
        let scale = file.scale as f32;
        let empty = Tree { cues: [0; QUESTIONS], above: [0.0; QUESTIONS], leaves: [0; LEAVES] };
        let (trees, biases) = ([empty; TREES_TOTAL], [0; TREES.len()]);
        let mut forest = MovesForest { trees, biases, scale };
        let mut values = file.values();
        for tree in &mut forest.trees {
            for (cue, above) in tree.cues.iter_mut().zip(&mut tree.above) {
                let known = values.next().and_then(|v| u8::try_from(v).ok());
                let known = known.filter(|cue| usize::from(*cue) < Cues::NAMES.len());
                *cue = known.ok_or(WeightsError::Range)?;
                *above = values.next().unwrap_or(0) as f32 / scale;
            }
            tree.leaves.fill_with(|| values.next().unwrap_or(0));
        }
        forest.biases.fill_with(|| values.next().unwrap_or(0));
        Ok(forest)
    }

    /// Logit of P(moves), nats.
    pub fn logit(&self, cues: &Cues) -> f32 {
        let values = cues.values();
        let answer = |tree: &Tree| {
            let asked = tree.cues.iter().zip(&tree.above).enumerate();
            asked.fold(0, |answer, (n, (cue, above))| {
                answer | usize::from(values[usize::from(*cue)] > *above) << n
            })
        };
        let (moved, standing) = self.trees.split_at(TREES[0]);
        let trees = if cues.stands { standing } else { moved };
        // Integers: the order of the trees makes no difference.
        let sum: i32 = trees.iter().map(|tree| tree.leaves[answer(tree)]).sum();
        (self.biases[usize::from(cues.stands)] + sum) as f32 / self.scale
    }

    /// P(moves).
    pub fn probability(&self, cues: &Cues) -> f32 {
        1.0 / (1.0 + libm::expf(-self.logit(cues)))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::digest::Digest;
    use std::format;
    use std::string::String;
    use std::vec::Vec;

    /// A file whose first trees of either kind are these, and all others nothing.
    fn file(moved: [i32; NUMBERS], standing: [i32; NUMBERS], biases: [i32; 2]) -> String {
        let trees = (0..TREES_TOTAL).flat_map(|tree| match tree {
            0 => moved,
            n if n == TREES[0] => standing,
            _ => [0; NUMBERS],
        });
        let numbers: Vec<String> = trees.chain(biases).map(|n| format!("{n}")).collect();
        let body = format!(
            "kind moves\nshape {TREES_TOTAL} {NUMBERS}\nscale 100\nprovenance test\n{}\n",
            numbers.join(" ")
        );
        format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
    }

    /// A tree that asks about the first cues in turn, whether they are above a half, a third, zero
    /// and zero, and whose leaves are ten times the answer.
    fn tree() -> [i32; NUMBERS] {
        let asked = [0, 50, 1, 33, 2, 0, 3, 0];
        core::array::from_fn(|n| match n.checked_sub(asked.len()) {
            None => asked[n],
            Some(answer) => 10 * answer as i32,
        })
    }

    #[test]
    fn answers_select_leaves() {
        let forest = MovesForest::load(&file(tree(), [0; NUMBERS], [-100, 7])).unwrap();
        let logit = |margin, share, residual, returns| {
            forest.logit(&Cues { margin, share, residual, returns, ..Cues::NONE })
        };
        assert_eq!(logit(0.5, 0.33, 0.0, 0.0), -1.0);
        assert_eq!(logit(0.51, 0.33, 0.0, 0.0), -0.9);
        assert_eq!(logit(0.5, 0.34, 0.0, 0.0), -0.8);
        assert_eq!(logit(0.51, 0.34, 0.1, 4.0), 0.5);
        // Neither of no cue nor of what is not a number is anything above.
        assert_eq!(logit(f32::NAN, f32::NAN, f32::NAN, f32::NAN), -1.0);
        // What stands has trees of its own.
        assert_eq!(forest.logit(&Cues { margin: 1.0, stands: true, ..Cues::NONE }), 0.07);
        let even = MovesForest::load(&file(tree(), [0; NUMBERS], [0; 2])).unwrap();
        assert_eq!(even.probability(&Cues::NONE), 0.5);
    }

    #[test]
    fn no_question_is_about_an_unknown_cue() {
        let mut wrong = tree();
        for cue in [-1, Cues::NAMES.len() as i32, 256] {
            wrong[2] = cue;
            let e = MovesForest::load(&file([0; NUMBERS], wrong, [0; 2])).err();
            assert_eq!(e, Some(WeightsError::Range), "{cue}");
        }
    }

    #[test]
    fn shipped_weights_load() {
        let forest = MovesForest::load(SHIPPED).unwrap();
        let cues = Cues { margin: 0.4, share: 1.0, returns: 4.5, earlier: 0.95, ..Cues::NONE };
        let moving = Cues { fresh: 0.95, could_move: 4.0, certainty: 3.0, ..cues };
        assert!(forest.probability(&moving) > 0.9);
        assert!(forest.probability(&Cues { stands: true, ..Cues::NONE }) < 0.05);
    }
}
