//! Parameters of the network, and the state of training, as files.

use crate::learning::{Adam, checkpoint};
use raywake_io::Error;
use raywake_io::sink::atomic;
use std::path::Path;

/// Header of weights files.
const WEIGHTS: &[u8] = b"raywake-flsf-weights 1\n";
/// Header of checkpoints.
const TRAINING: &[u8] = b"raywake-flsf-training 1\n";

/// Maximum bytes of the provenance text.
const PROVENANCE_MAX: usize = 10_000;

/// Trained parameters, and their provenance.
pub struct TrainedWeights {
    /// Parameters of the network.
    pub numbers: Vec<f32>,
    /// Command, inputs, steps.
    pub provenance: String,
}

impl TrainedWeights {
    /// Writes them.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let mut body: Vec<u8> = self.numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        body.extend(self.provenance.bytes().take(PROVENANCE_MAX));
        atomic::write(path, |to| checkpoint::write(to, WEIGHTS, 0, &body))
    }

    /// Reads `count` parameters. Fails if the file is damaged or from another network.
    pub fn read(path: &Path, count: usize) -> Result<TrainedWeights, Error> {
        let lengths = 4 * count..=4 * count + PROVENANCE_MAX;
        let body = checkpoint::read(path, WEIGHTS, 0, lengths)?;
        let (numbers, provenance) = body.split_at(4 * count);
        let provenance = String::from_utf8_lossy(provenance).into_owned();
        Ok(TrainedWeights { numbers: floats(numbers), provenance })
    }
}

/// Writes the state of the training identified by `of`.
pub fn write_state(path: &Path, of: u64, numbers: &[f32], state: &Adam) -> Result<(), Error> {
    let mut body: Vec<u8> = state.step.to_le_bytes().to_vec();
    let all = numbers.iter().chain(&state.means).chain(&state.squares);
    body.extend(all.flat_map(|n| n.to_le_bytes()));
    atomic::write(path, |to| checkpoint::write(to, TRAINING, of, &body))
}

/// Reads it back; fails if it is damaged or from another training.
pub fn read_state(path: &Path, of: u64, count: usize) -> Result<(Vec<f32>, Adam), Error> {
    let length = 4 + 12 * count;
    let body = checkpoint::read(path, TRAINING, of, length..=length)?;
    let (step, rest) = body.split_at(4);
    let mut numbers = floats(rest);
    let squares = numbers.split_off(2 * count);
    let means = numbers.split_off(count);
    let step = u32::from_le_bytes(step.try_into().expect("4 bytes"));
    Ok((numbers, Adam { means, squares, step }))
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}
