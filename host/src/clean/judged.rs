//! The verdict on every return from both passes through the drive.

use raywake_core::output::{PointFlow, Status};

/// Numbers of SemanticKITTI's labels for moving object segmentation.
const UNLABELLED: u32 = 0;
const STATIC: u32 = 9;
const MOVING: u32 = 251;

/// The verdict on a return from both passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Judged {
    /// No surface: no echo, the own vehicle, not finite.
    None,
    /// Outside the window or over capacity in both passes.
    Unknown,
    Static,
    Moving,
}

impl Judged {
    /// All verdicts, in order of discriminant.
    const ALL: [Judged; 4] = [Judged::None, Judged::Unknown, Judged::Static, Judged::Moving];

    pub fn label(self) -> u32 {
        match self {
            Judged::None | Judged::Unknown => UNLABELLED,
            Judged::Static => STATIC,
            Judged::Moving => MOVING,
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
pub struct OneWay(Nibbles);

impl OneWay {
    pub fn of(flows: impl ExactSizeIterator<Item = PointFlow>) -> OneWay {
        OneWay(Nibbles::of(flows.map(|flow| nibble(&flow))))
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
    pub fn of(ways: [&OneWay; 2], returns: usize, moving: f32) -> Verdicts {
        Verdicts(Nibbles::of((0..returns).map(|n| judge(ways, n, moving) as Nibble)))
    }

    /// The verdicts, for the given number of returns.
    pub fn all(&self, returns: usize) -> Vec<Judged> {
        let judged = |n| self.0.get(n).and_then(|nibble| Judged::ALL.get(usize::from(nibble)));
        (0..returns).map(|n| judged(n).copied().unwrap_or(Judged::Unknown)).collect()
    }
}

/// The verdict on a return from both passes: it moves if the mean P(moves) of the passes that
/// examined it reaches `moving`.
fn judge(ways: [&OneWay; 2], n: usize, moving: f32) -> Judged {
    let told = ways.map(|way| way.get(n));
    if told.contains(&NONE) {
        return Judged::None;
    }
    let looked = || told.into_iter().filter(|nibble| *nibble <= SURE);
    let sum: f32 = looked().map(f32::from).sum();
    match looked().count() {
        0 => Judged::Unknown,
        count if sum >= moving * f32::from(SURE) * count as f32 => Judged::Moving,
        _ => Judged::Static,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_are_heard() {
        let flow = |status, probability| PointFlow { status, probability, ..PointFlow::default() };
        let out = flow(Status::OutsideWindow, 0.0);
        let own = flow(Status::OwnVehicle, 0.0);
        let [still, unsure] = [0.0, 0.3].map(|p| flow(Status::Static, p));
        let moving = flow(Status::Moving, 0.9);
        for (forwards, backwards, judged) in [
            (moving, moving, Judged::Moving),
            (moving, still, Judged::Moving),
            (unsure, still, Judged::Static),
            (unsure, unsure, Judged::Static),
            (out, moving, Judged::Moving),
            (still, out, Judged::Static),
            (out, out, Judged::Unknown),
            (own, still, Judged::None),
        ] {
            // In either half of a byte.
            for n in 0..3 {
                let way = |flow| OneWay::of((0..3).map(|k| if k == n { flow } else { still }));
                let ways = [way(forwards), way(backwards)];
                assert_eq!(judge([&ways[0], &ways[1]], n, 0.4), judged, "{n}");
            }
        }
        let nothing = OneWay::default();
        assert_eq!(judge([&nothing, &nothing], 7, 0.4), Judged::Unknown);
        assert_eq!(Judged::ALL.map(Judged::label), [0, 0, 9, 251]);
        let way = OneWay::of([moving, still, own, out, moving].into_iter());
        let verdicts = Verdicts::of([&way, &way], 5, 0.4);
        let [moves, stands, none, unknown] =
            [Judged::Moving, Judged::Static, Judged::None, Judged::Unknown];
        assert_eq!(verdicts.all(5), [moves, stands, none, unknown, moves]);
        assert_eq!(Verdicts::default().all(1), [unknown]);
    }
}
