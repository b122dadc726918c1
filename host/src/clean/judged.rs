//! What became of every return, by either way through the drive.

use raywake_core::output::{PointFlow, Status};

/// Numbers of SemanticKITTI's labels for moving object segmentation.
const UNLABELLED: u32 = 0;
const STATIC: u32 = 9;
const MOVING: u32 = 251;

/// What is known of a return by both ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judged {
    /// No surface: no echo, the own vehicle, not finite.
    None,
    /// Outside the window both times.
    Unknown,
    Static,
    Moving,
}

impl Judged {
    pub fn label(self) -> u32 {
        match self {
            Judged::None | Judged::Unknown => UNLABELLED,
            Judged::Static => STATIC,
            Judged::Moving => MOVING,
        }
    }
}

/// What one way tells of a return, in four bits: P(moves) from 0 to [`SURE`], or one of the others.
type Nibble = u8;

const SURE: Nibble = 13;
/// Not looked at.
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

/// What one way tells of the returns of a sweep.
#[derive(Clone, Debug, Default)]
pub struct OneWay {
    nibbles: Vec<u8>,
}

impl OneWay {
    pub fn of(flows: impl ExactSizeIterator<Item = PointFlow>) -> OneWay {
        let mut nibbles = vec![0; flows.len().div_ceil(2)];
        for (n, flow) in flows.enumerate() {
            nibbles[n / 2] |= nibble(&flow) << (n % 2 * 4);
        }
        OneWay { nibbles }
    }

    fn get(&self, n: usize) -> Nibble {
        self.nibbles.get(n / 2).map_or(UNKNOWN, |byte| byte >> (n % 2 * 4) & 15)
    }
}

/// What is known of a return by both ways: it moves where the mean of P(moves) of those that looked
/// at it reaches `moving`.
pub fn judge(ways: [&OneWay; 2], n: usize, moving: f32) -> Judged {
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
            // At either place of a byte.
            for n in 0..3 {
                let way = |flow| OneWay::of((0..3).map(|k| if k == n { flow } else { still }));
                let ways = [way(forwards), way(backwards)];
                assert_eq!(judge([&ways[0], &ways[1]], n, 0.4), judged, "{n}");
            }
        }
        let nothing = OneWay::default();
        assert_eq!(judge([&nothing, &nothing], 7, 0.4), Judged::Unknown);
        let all = [Judged::None, Judged::Unknown, Judged::Static, Judged::Moving];
        assert_eq!(all.map(Judged::label), [0, 0, 9, 251]);
    }
}
