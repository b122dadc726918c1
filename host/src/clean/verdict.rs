//! The verdict on every return from both passes through the drive.

use raywake_core::output::{PointFlow, Status};

/// Numbers of SemanticKITTI's labels for moving object segmentation.
const UNLABELLED: u32 = 0;
const STATIC: u32 = 9;
const MOVING: u32 = 251;

/// The verdict on a return from both passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ReturnVerdict {
    /// No surface: no echo, the own vehicle, not finite.
    None,
    /// Outside the window or over capacity in both passes.
    Unknown,
    Static,
    Moving,
}

impl ReturnVerdict {
    /// All verdicts, in order of discriminant.
    const ALL: [ReturnVerdict; 4] =
        [ReturnVerdict::None, ReturnVerdict::Unknown, ReturnVerdict::Static, ReturnVerdict::Moving];

    pub fn label(self) -> u32 {
        match self {
            ReturnVerdict::None | ReturnVerdict::Unknown => UNLABELLED,
            ReturnVerdict::Static => STATIC,
            ReturnVerdict::Moving => MOVING,
        }
    }
}

/// The result of one pass for a return, in four bits: P(moves) scaled to 0 to [`SURE`], or
/// [`UNKNOWN`] or [`NONE`].
type Nibble = u8;

const SURE: Nibble = 13;
/// Not examined.
const UNKNOWN: Nibble = 14;
/// No surface.
const NONE: Nibble = 15;

fn nibble(flow: &PointFlow) -> Nibble {
    match flow.status {
        Status::OutsideWindow | Status::OverCapacity => UNKNOWN,
        Status::OwnVehicle | Status::NoEcho | Status::Invalid => NONE,
        Status::Static | Status::Moving | Status::Unmatched => {
            (flow.probability * f32::from(SURE)).round() as Nibble
        }
    }
}

/// Four bits per return of a sweep.
#[derive(Clone, Debug, Default)]
struct Nibbles(Vec<u8>);

impl Nibbles {
    fn of(all: impl ExactSizeIterator<Item = Nibble>) -> Nibbles {
        let mut nibbles = vec![0; all.len().div_ceil(2)];
        for (n, nibble) in all.enumerate() {
            nibbles[n / 2] |= nibble << (n % 2 * 4);
        }
        Nibbles(nibbles)
    }

    fn get(&self, n: usize) -> Option<Nibble> {
        self.0.get(n / 2).map(|byte| byte >> (n % 2 * 4) & 15)
    }
}

/// The results of one pass for the returns of a sweep.
#[derive(Clone, Debug, Default)]
pub struct PassResults(Nibbles);

impl PassResults {
    pub fn of(flows: impl ExactSizeIterator<Item = PointFlow>) -> PassResults {
        PassResults(Nibbles::of(flows.map(|flow| nibble(&flow))))
    }

    fn get(&self, n: usize) -> Nibble {
        self.0.get(n).unwrap_or(UNKNOWN)
    }
}

/// The verdicts on the returns of a sweep.
#[derive(Clone, Debug, Default)]
pub struct Verdicts(Nibbles);

impl Verdicts {
    /// The verdicts on the given number of returns from both passes.
    pub fn of(passes: [&PassResults; 2], returns: usize, moving: f32) -> Verdicts {
        Verdicts(Nibbles::of((0..returns).map(|n| judge(passes, n, moving) as Nibble)))
    }

    /// The verdicts, for the given number of returns.
    pub fn all(&self, returns: usize) -> Vec<ReturnVerdict> {
        let judged =
            |n| self.0.get(n).and_then(|nibble| ReturnVerdict::ALL.get(usize::from(nibble)));
        (0..returns).map(|n| judged(n).copied().unwrap_or(ReturnVerdict::Unknown)).collect()
    }
}

/// The verdict on a return from both passes: it moves if the mean P(moves) of the passes that
/// examined it reaches `moving`.
fn judge(passes: [&PassResults; 2], n: usize, moving: f32) -> ReturnVerdict {
    let results = passes.map(|pass| pass.get(n));
    if results.contains(&NONE) {
        return ReturnVerdict::None;
    }
    let examined = || results.into_iter().filter(|nibble| *nibble <= SURE);
    let sum: f32 = examined().map(f32::from).sum();
    match examined().count() {
        0 => ReturnVerdict::Unknown,
        count if sum >= moving * f32::from(SURE) * count as f32 => ReturnVerdict::Moving,
        _ => ReturnVerdict::Static,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_passes_count() {
        let flow = |status, probability| PointFlow { status, probability, ..PointFlow::default() };
        let out = flow(Status::OutsideWindow, 0.0);
        let own = flow(Status::OwnVehicle, 0.0);
        let [still, unsure] = [0.0, 0.3].map(|p| flow(Status::Static, p));
        let moving = flow(Status::Moving, 0.9);
        for (forwards, backwards, judged) in [
            (moving, moving, ReturnVerdict::Moving),
            (moving, still, ReturnVerdict::Moving),
            (unsure, still, ReturnVerdict::Static),
            (unsure, unsure, ReturnVerdict::Static),
            (out, moving, ReturnVerdict::Moving),
            (still, out, ReturnVerdict::Static),
            (out, out, ReturnVerdict::Unknown),
            (own, still, ReturnVerdict::None),
        ] {
            // In either half of a byte.
            for n in 0..3 {
                let pass =
                    |flow| PassResults::of((0..3).map(|k| if k == n { flow } else { still }));
                let passes = [pass(forwards), pass(backwards)];
                assert_eq!(judge([&passes[0], &passes[1]], n, 0.4), judged, "{n}");
            }
        }
        let nothing = PassResults::default();
        assert_eq!(judge([&nothing, &nothing], 7, 0.4), ReturnVerdict::Unknown);
        assert_eq!(ReturnVerdict::ALL.map(ReturnVerdict::label), [0, 0, 9, 251]);
        let pass = PassResults::of([moving, still, own, out, moving].into_iter());
        let verdicts = Verdicts::of([&pass, &pass], 5, 0.4);
        let [moves, stands, none, unknown] = [
            ReturnVerdict::Moving,
            ReturnVerdict::Static,
            ReturnVerdict::None,
            ReturnVerdict::Unknown,
        ];
        assert_eq!(verdicts.all(5), [moves, stands, none, unknown, moves]);
        assert_eq!(Verdicts::default().all(1), [unknown]);
    }
}
