//! Learned numbers as text files, all read by this one reader.
//!
//! ```text
//! raywake-weights 1
//! checksum <16 hexadecimal digits: FNV-1a of every byte after this line>
//! kind constancy
//! shape 3 14
//! scale 100
//! provenance <one line>
//! <integers, white space between them>
//! ```
//! A weight is its integer divided by `scale`. The number of integers is the product of `shape`,
//! plus one if the kind has a bias, which comes last. Text, so that a change shows in a review;
//! integers, so that every machine computes with the same numbers.

use crate::digest::Digest;
use core::fmt;

/// A weights file, parsed and verified; borrows the text.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a> {
    /// Integers per unit of weight.
    pub scale: i32,
    /// Where the numbers come from.
    pub provenance: &'a str,
    values: &'a str,
}

/// Why a text is not a weights file of the kind wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightsError {
    /// Not a weights file, or of another version.
    Magic,
    /// The header line of this name is missing or malformed.
    Header(&'static str),
    /// The bytes do not match the checksum.
    Checksum,
    /// Weights of a different kind.
    Kind,
    /// A different shape than the profile needs.
    Shape,
    /// The value at this position (from 0) is missing or not an integer of 24 bits.
    Value(usize),
    /// More values than the shape calls for.
    Surplus,
    /// Their sums do not fit the arithmetic or the tables that use them.
    Range,
}

impl fmt::Display for WeightsError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            WeightsError::Magic => write!(f, "not a `raywake-weights 1` file"),
            WeightsError::Header(name) => write!(f, "header line `{name}` missing or malformed"),
            WeightsError::Checksum => write!(f, "checksum does not match: the file is damaged"),
            WeightsError::Kind => write!(f, "weights of a different kind"),
            WeightsError::Shape => write!(f, "weights of a different shape than the profile needs"),
            WeightsError::Value(n) => write!(f, "value {n} missing or not an integer below 2^23"),
            WeightsError::Surplus => write!(f, "more values than the shape calls for"),
            WeightsError::Range => write!(f, "the sums of the weights are too large"),
        }
    }
}

impl<'a> Weights<'a> {
    /// Parses `text`, which must be of `kind` and `shape`, followed by this many biases.
    pub fn parse(
        text: &'a str,
        kind: &str,
        shape: &[usize],
        biases: usize,
    ) -> Result<Weights<'a>, WeightsError> {
        let (magic, rest) = text.split_once('\n').ok_or(WeightsError::Magic)?;
        if magic != "raywake-weights 1" {
            return Err(WeightsError::Magic);
        }
        let (sum, rest) = field(rest, "checksum")?;
        let sum = u64::from_str_radix(sum, 16).map_err(|_| WeightsError::Header("checksum"))?;
        if Digest::of(rest.as_bytes()) != sum {
            return Err(WeightsError::Checksum);
        }
        let (found, rest) = field(rest, "kind")?;
        if found != kind {
            return Err(WeightsError::Kind);
        }
        let (found, rest) = field(rest, "shape")?;
        if !found.split_whitespace().map(|n| n.parse().ok()).eq(shape.iter().map(|n| Some(*n))) {
            return Err(WeightsError::Shape);
        }
        let (scale, rest) = field(rest, "scale")?;
        let scale = scale.parse().ok().filter(|s| (1..=1 << 16).contains(s));
        let scale = scale.ok_or(WeightsError::Header("scale"))?;
        let (provenance, values) = field(rest, "provenance")?;
        let weights = Weights { scale, provenance, values };
        let count = shape.iter().product::<usize>() + biases;
        let mut words = values.split_whitespace();
        for n in 0..count {
            let value = words.next().and_then(|w| w.parse::<i32>().ok());
            value.filter(|v| v.abs() < 1 << 23).ok_or(WeightsError::Value(n))?;
        }
        if words.next().is_some() {
            return Err(WeightsError::Surplus);
        }
        Ok(weights)
    }

    /// The integers, a bias last.
    pub fn values(&self) -> impl Iterator<Item = i32> + use<'a> {
        // Every word was checked by `parse`.
        self.values.split_whitespace().map(|w| w.parse().unwrap_or(0))
    }
}

fn field<'a>(text: &'a str, name: &'static str) -> Result<(&'a str, &'a str), WeightsError> {
    let (line, rest) = text.split_once('\n').ok_or(WeightsError::Header(name))?;
    let value = line.strip_prefix(name).and_then(|v| v.strip_prefix(' '));
    Ok((value.ok_or(WeightsError::Header(name))?, rest))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::format;
    use std::string::String;

    fn file(body: &str) -> String {
        format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
    }

    #[test]
    fn good_and_damaged_files() {
        let body = "kind toy\nshape 2 2\nscale 10\nprovenance hand\n1 2 -3\n4 5\n";
        let good = file(body);
        let w = Weights::parse(&good, "toy", &[2, 2], 1).unwrap();
        assert!(w.values().eq([1, 2, -3, 4, 5]));
        assert_eq!((w.scale, w.provenance), (10, "hand"));
        let fails = |t: &str| Weights::parse(t, "toy", &[2, 2], 1).unwrap_err();
        assert_eq!(fails(""), WeightsError::Magic);
        assert_eq!(fails(&good.replace("-3", "-4")), WeightsError::Checksum);
        assert_eq!(fails(&good[..good.len() - 1]), WeightsError::Checksum);
        assert_eq!(fails(&file(&body.replace("toy", "doll"))), WeightsError::Kind);
        assert_eq!(fails(&file(&body.replace("2 2", "2 3"))), WeightsError::Shape);
        assert_eq!(fails(&file(&body.replace("-3", "NaN"))), WeightsError::Value(2));
        assert_eq!(fails(&file(&body.replace("4 5", "4"))), WeightsError::Value(4));
        assert_eq!(fails(&file(&body.replace("4 5", "4 5 6"))), WeightsError::Surplus);
        assert_eq!(
            fails(&file(&body.replace("scale 10", "scale 0"))),
            WeightsError::Header("scale")
        );
    }
}
