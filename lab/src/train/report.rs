//! Output of training: weights, and a report on it.

use raywake_io::Error;
use raywake_io::sink::atomic;
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

/// Recalls at which curves are reported.
pub const RECALLS: [f64; 11] = [0.5, 0.6, 0.7, 0.8, 0.9, 0.925, 0.95, 0.96, 0.97, 0.98, 0.99];

/// Where results go.
#[derive(clap::Args, Clone, Debug)]
pub struct Outputs {
    /// Weights file to write.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// File of results to write.
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

impl Outputs {
    /// Writes both, and prints the report.
    pub fn write(&self, weights: &str, report: &impl Serialize) -> Result<(), Error> {
        atomic::write(&self.out, |file| file.write_all(weights.as_bytes()))?;
        let text = serde_json::to_string_pretty(report).expect("numbers and names serialise");
        println!("{text}");
        match &self.report {
            Some(path) => atomic::write(path, |file| writeln!(file, "{text}")),
            None => Ok(()),
        }
    }
}

/// Samples of either class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Foreground, or true pairs.
    pub positive: usize,
    /// Background, or other pairs.
    pub negative: usize,
}

impl Counts {
    pub fn of(labels: impl Iterator<Item = bool>) -> Counts {
        labels.fold(Counts { positive: 0, negative: 0 }, |c, positive| Counts {
            positive: c.positive + positive as usize,
            negative: c.negative + !positive as usize,
        })
    }

    /// Fails if a class is missing in the drives of this part.
    pub fn both(&self, part: &str, positive: &str, negative: &str) -> Result<(), Error> {
        let missing = match self {
            Counts { positive: 0, .. } => positive,
            Counts { negative: 0, .. } => negative,
            _ => return Ok(()),
        };
        Err(Error::Usage(format!("the {part} drives contain no {missing}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_class_is_named() {
        let counts = |labels: &[bool]| Counts::of(labels.iter().copied());
        let error = |labels: &[bool]| counts(labels).both("held-out", "cars", "trees");
        assert!(error(&[true, false]).is_ok());
        assert!(
            error(&[false]).unwrap_err().to_string().contains("held-out drives contain no cars")
        );
        assert!(error(&[true]).unwrap_err().to_string().contains("no trees"));
        assert!(error(&[]).is_err());
    }
}
