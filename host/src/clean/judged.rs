//! What became of every return, by either way through the drive.

use std::path::Path;

use raywake_core::output::{PointFlow, Status};

/// Numbers of SemanticKITTI's labels for moving object segmentation.
const UNLABELLED: u32 = 0;
const STATIC: u32 = 9;
const MOVING: u32 = 251;

/// What is known of a return. The order is that in which one way overrules the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Judged {
    /// No surface: no echo, the own vehicle, not finite.
    None,
    /// Outside the window, or of a sweep that was not looked at.
    #[default]
    Unknown,
    Static,
    Moving,
}

impl Judged {
    pub fn of(flow: &PointFlow) -> Judged {
        match flow.status {
            Status::Moving => Judged::Moving,
            Status::Static | Status::Unmatched => Judged::Static,
            Status::OutsideWindow | Status::OverCapacity => Judged::Unknown,
            Status::OwnVehicle | Status::NoEcho | Status::Invalid => Judged::None,
        }
    }

    pub fn label(self) -> u32 {
        match self {
            Judged::None | Judged::Unknown => UNLABELLED,
            Judged::Static => STATIC,
            Judged::Moving => MOVING,
        }
    }
}

/// What is known of the returns of a sweep, two bits each.
#[derive(Clone, Debug, Default)]
pub struct SweepJudged {
    bytes: Vec<u8>,
}

impl SweepJudged {
    pub fn of(flows: impl Iterator<Item = PointFlow>) -> SweepJudged {
        let mut bytes = Vec::new();
        for (n, flow) in flows.enumerate() {
            if n % 4 == 0 {
                bytes.push(0);
            }
            bytes[n / 4] |= (Judged::of(&flow) as u8) << (n % 4 * 2);
        }
        bytes.shrink_to_fit();
        SweepJudged { bytes }
    }

    /// Of a return; unknown where there is none.
    pub fn get(&self, n: usize) -> Judged {
        let all = [Judged::None, Judged::Unknown, Judged::Static, Judged::Moving];
        let bits = self.bytes.get(n / 4).map(|byte| byte >> (n % 4 * 2) & 3);
        bits.map_or(Judged::Unknown, |bits| all[usize::from(bits)])
    }
}

/// Where the files of a sweep go.
pub fn file(root: &Path, folder: &str, frame: u64, extension: &str) -> std::path::PathBuf {
    root.join(format!("{folder}/{frame:010}.{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_bits_a_return() {
        let flows = Status::ALL.map(|status| PointFlow { status, ..PointFlow::default() });
        let judged = SweepJudged::of(flows.into_iter());
        let all: Vec<Judged> = (0..9).map(|n| judged.get(n)).collect();
        use Judged::*;
        assert_eq!(all, [Static, Moving, Static, Unknown, Unknown, None, None, None, None]);
        assert_eq!(judged.get(12), Unknown);
        assert_eq!(all.iter().max(), Some(&Moving));
        assert_eq!([None, Unknown, Static, Moving].map(Judged::label), [0, 0, 9, 251]);
    }
}
