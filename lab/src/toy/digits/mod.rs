//! Pictures of digits.

mod csv_file;
mod idx;
mod json;
#[cfg(test)]
mod tests;

use raywake_io::Error;
use raywake_sim::Rng;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Classes of digits.
pub const CLASSES: usize = 10;
/// Maximum unpacked size of a file, bytes: sixty thousand digits of 28 x 28 take 47 MB.
const BYTES_MAX: u64 = 1 << 29;

/// Square pictures of one size, each showing a digit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Digits {
    /// Pixels of a picture.
    pub pixels: usize,
    /// Brightness from 0 to 1, picture after picture.
    pub values: Vec<f32>,
    /// Digits, 0 to 9.
    pub labels: Vec<u8>,
}

/// What a network is trained on, and what it is tested on.
#[derive(Clone, Debug, PartialEq)]
pub struct DigitSets {
    /// For learning.
    pub training: Digits,
    /// Not seen during training.
    pub test: Digits,
    /// Where the digits come from and how they were divided.
    pub origin: String,
}

impl Digits {
    /// Number of digits.
    pub fn count(&self) -> usize {
        self.labels.len()
    }

    /// The picture with this index.
    pub fn picture(&self, n: usize) -> &[f32] {
        &self.values[n * self.pixels..][..self.pixels]
    }

    /// Indices by digit.
    pub fn by_class(&self) -> [Vec<usize>; CLASSES] {
        let mut indices = [const { Vec::new() }; CLASSES];
        for (n, label) in self.labels.iter().enumerate() {
            indices[usize::from(*label)].push(n);
        }
        indices
    }

    /// The digits with these indices.
    fn of(&self, indices: &[usize]) -> Digits {
        Digits {
            pixels: self.pixels,
            values: indices.iter().flat_map(|n| self.picture(*n)).copied().collect(),
            labels: indices.iter().map(|n| self.labels[*n]).collect(),
        }
    }
}

/// Opens digits: a folder of MNIST's IDX files, plain or gzipped; a folder of `0.json` to `9.json`;
/// or a file of comma-separated values, `.csv` or `.csv.gz`. If training and test digits are not
/// kept apart, one in five, drawn by the seed, is used for the test.
///
/// Fails if a file is missing, truncated or of another kind, or if a digit does not occur.
pub fn open(path: &Path, seed: u64) -> Result<DigitSets, Error> {
    let sets = match () {
        () if path.is_file() => divided(csv_file::read(path)?, path, seed),
        () if path.join("0.json").exists() => divided(json::read(path)?, path, seed),
        () => idx::read(path, seed)?,
    };
    for (set, name) in [(&sets.training, "training"), (&sets.test, "test")] {
        if let Some(digit) = set.by_class().iter().position(Vec::is_empty) {
            let what = format!("no {digit} among the {} digits for {name}", set.count());
            return Err(Error::input(path, "", what));
        }
    }
    Ok(sets)
}

/// Sets one in five aside for the test.
fn divided(all: Digits, path: &Path, seed: u64) -> DigitSets {
    let mut order: Vec<usize> = (0..all.count()).collect();
    let mut rng = Rng::split(seed, 1);
    for n in (1..order.len()).rev() {
        order.swap(n, rng.bits() as usize % (n + 1));
    }
    let (test, training) = order.split_at(all.count() / 5);
    let origin = format!(
        "{}, {} digits, {} of them, drawn by seed {seed}, for the test",
        path.display(),
        all.count(),
        test.len()
    );
    DigitSets { training: all.of(training), test: all.of(test), origin }
}

/// All bytes of a file, unpacked if its name ends in `.gz`.
fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let file = File::open(path).map_err(Error::reading(path))?;
    let mut bytes = Vec::new();
    let packed = path.extension().is_some_and(|e| e == "gz");
    let read = match packed {
        true => flate2::read::GzDecoder::new(file).take(BYTES_MAX + 1).read_to_end(&mut bytes),
        false => file.take(BYTES_MAX + 1).read_to_end(&mut bytes),
    };
    read.map_err(Error::reading(path))?;
    if bytes.len() as u64 > BYTES_MAX {
        return Err(Error::input(path, "", format!("more than {BYTES_MAX} bytes")));
    }
    Ok(bytes)
}
