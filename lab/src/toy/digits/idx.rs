//! MNIST's files: a magic number, counts, bytes; all integers big-endian.

use super::{DigitSets, Digits, bytes, divided};
use raywake_io::Error;
use std::path::{Path, PathBuf};

/// Magic numbers of byte arrays in three dimensions and in one.
const IMAGES: u32 = 0x803;
const LABELS: u32 = 0x801;

/// Reads both sets of a folder; if there is only one, it is divided.
pub fn read(folder: &Path, seed: u64) -> Result<DigitSets, Error> {
    let test = set(folder, "t10k")?;
    let training = set(folder, "train")?;
    match (training, test) {
        (Some(training), Some(test)) if training.pixels == test.pixels => {
            let origin = format!(
                "{}, {} digits for training, {} for the test",
                folder.display(),
                training.count(),
                test.count()
            );
            Ok(DigitSets { training, test, origin })
        }
        (Some(_), Some(_)) => {
            Err(Error::input(folder, "", "training and test have pictures of different sizes"))
        }
        (Some(one), None) | (None, Some(one)) => Ok(divided(one, folder, seed)),
        (None, None) => {
            let what = "no digits: neither t10k-images-idx3-ubyte (gzipped or not) nor 0.json";
            Err(Error::input(folder, "", what))
        }
    }
}

/// The set with this name, if its images are there.
fn set(folder: &Path, name: &str) -> Result<Option<Digits>, Error> {
    let file = |kind: &str| -> Option<PathBuf> {
        let names = ["", ".gz"].map(|end| folder.join(format!("{name}-{kind}-ubyte{end}")));
        names.into_iter().find(|path| path.exists())
    };
    let Some(images) = file("images-idx3") else { return Ok(None) };
    let Some(labels) = file("labels-idx1") else {
        return Err(Error::input(&images, "", "its labels are missing"));
    };
    let ([count, rows, columns], values) = contents(&images, IMAGES)?;
    let ([labelled], labels) = labels_of(&labels)?;
    if count != labelled {
        let what = format!("{count} images, but {labelled} labels");
        return Err(Error::input(&images, "", what));
    }
    let values = values.iter().map(|v| f32::from(*v) / 255.0).collect();
    Ok(Some(Digits { pixels: rows * columns, values, labels }))
}

fn labels_of(path: &Path) -> Result<([usize; 1], Vec<u8>), Error> {
    let (count, labels) = contents(path, LABELS)?;
    match labels.iter().position(|l| usize::from(*l) >= super::CLASSES) {
        Some(n) => Err(Error::input(path, format!("label {n}"), format!("is {}", labels[n]))),
        None => Ok((count, labels)),
    }
}

/// Counts and bytes of a file.
fn contents<const N: usize>(path: &Path, magic: u32) -> Result<([usize; N], Vec<u8>), Error> {
    let mut bytes = bytes(path)?;
    let error = |what: String| Error::input(path, "", what);
    let head = 4 + 4 * N;
    if bytes.len() < head {
        return Err(error(format!("{} bytes, cut off within its header", bytes.len())));
    }
    let word = |n: usize| u32::from_be_bytes(std::array::from_fn(|i| bytes[4 * n + i]));
    if word(0) != magic {
        return Err(error(format!("begins with {:#x}, not with {magic:#x}", word(0))));
    }
    let counts: [usize; N] = std::array::from_fn(|n| word(n + 1) as usize);
    let wanted = counts.iter().try_fold(1usize, |all, n| all.checked_mul(*n));
    let found = bytes.len() - head;
    if wanted != Some(found) {
        return Err(error(format!("{found} bytes for counts of {counts:?}")));
    }
    bytes.drain(..head);
    Ok((counts, bytes))
}
