//! Model weights: built in, or from files named on the command line.

use std::path::PathBuf;

use raywake_core::digest::Digest;
use raywake_core::encoder;
use raywake_core::params::Profile;
use raywake_core::refinement::forest;
use raywake_core::stages::background_filter;
use raywake_core::stages::occupancy_constancy;

use crate::args::Learned;
use crate::backend::{LearnedPart, Tables, TablesError};
use raywake_io::Error;
use raywake_io::source::whole::read_text;

/// The contents of the weights files.
#[derive(Clone)]
pub struct WeightFiles {
    /// `None`: every solid column is foreground.
    filter: Option<WeightFile>,
    constancy: WeightFile,
    /// `None`: nothing is encoded.
    encoder: Option<WeightFile>,
    moves: WeightFile,
}

#[derive(Clone)]
struct WeightFile {
    /// `None`: built in.
    path: Option<PathBuf>,
    text: String,
}

impl WeightFiles {
    /// Reads the files named on the command line, and uses the built-in weights for the rest.
    pub fn read(learned: &Learned, profile: &Profile) -> Result<WeightFiles, Error> {
        let file = |path: &Option<PathBuf>, shipped: &str| match path {
            Some(path) => Ok(WeightFile { path: Some(path.clone()), text: read_text(path)? }),
            None => Ok(WeightFile { path: None, text: shipped.to_string() }),
        };
        let none = |path: &Option<PathBuf>| path.as_ref().is_some_and(|f| f.as_os_str() == "none");
        let optional = |path: &Option<PathBuf>, shipped: &str| match none(path) {
            true => Ok(None),
            false => file(path, shipped).map(Some),
        };
        let frame = profile.frame;
        Ok(WeightFiles {
            filter: optional(&learned.filter, background_filter::shipped(frame))?,
            constancy: file(&learned.constancy, occupancy_constancy::shipped(frame))?,
            encoder: optional(&learned.encoder, encoder::SHIPPED)?,
            moves: file(&learned.moves, forest::SHIPPED)?,
        })
    }

    /// Whether there is a background filter.
    pub fn has_filter(&self) -> bool {
        self.filter.is_some()
    }

    /// Whether there is an encoder.
    pub fn has_encoder(&self) -> bool {
        self.encoder.is_some()
    }

    /// The same without the background filter: every solid column is foreground.
    pub fn without_filter(self) -> WeightFiles {
        WeightFiles { filter: None, ..self }
    }

    /// The same without the encoder.
    pub fn without_encoder(self) -> WeightFiles {
        WeightFiles { encoder: None, ..self }
    }

    /// The same with another occupancy constancy, given as text.
    pub fn with_constancy(self, text: &str) -> WeightFiles {
        WeightFiles { constancy: WeightFile { path: None, text: text.into() }, ..self }
    }

    /// A digest of the texts, 16 hexadecimal digits.
    pub fn digest(&self) -> String {
        let filter = self.filter.as_ref().map(|f| &f.text);
        let encoder = self.encoder.as_ref().map(|f| &f.text);
        let all = format!("{filter:?}{}{encoder:?}{}", self.constancy.text, self.moves.text);
        format!("{:016x}", Digest::of(all.as_bytes()))
    }

    /// Builds the tables for a profile. Errors name the file and the value in it, or the option to
    /// set if the built-in weights do not fit.
    pub fn tables(&self, profile: &Profile) -> Result<Tables, Error> {
        let filter = self.filter.as_ref().map(|f| f.text.as_str());
        let encoder = self.encoder.as_ref().map(|f| f.text.as_str());
        Tables::load(profile, filter, &self.constancy.text, encoder, &self.moves.text)
            .map_err(|e| self.mistake(profile, e))
    }

    fn mistake(&self, profile: &Profile, e: TablesError) -> Error {
        let (file, option) = match e.of {
            LearnedPart::Filter => (self.filter.as_ref(), "--filter"),
            LearnedPart::Constancy => (Some(&self.constancy), "--constancy"),
            LearnedPart::Encoder => (self.encoder.as_ref(), "--encoder"),
            LearnedPart::Moves => (Some(&self.moves), "--moves"),
        };
        match file.and_then(|f| f.path.as_ref()) {
            Some(path) => Error::input(path, "", e.to_string()),
            None => Error::Usage(format!(
                "the built-in weights do not fit profile `{}` with {} levels ({e}): use {option}",
                profile.name, profile.levels
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_weights_fit_the_built_in_profiles_only() {
        let load = |learned: &Learned, profile: &Profile| {
            let weights = WeightFiles::read(learned, profile)?;
            weights.tables(profile).map(|_| ())
        };
        for profile in Profile::shipped() {
            load(&Learned::default(), &profile).unwrap();
        }
        let low = Profile { levels: 12, ..Profile::hdl64() };
        let e = load(&Learned::default(), &low).unwrap_err().to_string();
        assert!(e.contains("12 levels") && e.contains("--filter"), "{e}");
        let none = Learned { filter: Some("none".into()), ..Learned::default() };
        let e = load(&none, &low).unwrap_err().to_string();
        assert!(e.contains("12 levels") && e.contains("--constancy"), "{e}");
    }
}
