//! Profiles and learned numbers: shipped ones, or files named on the command line.

use std::fs;
use std::path::{Path, PathBuf};

use raywake_core::background_filter::{self, TABLE_WORDS};
use raywake_core::digest::Digest;
use raywake_core::occupancy_constancy::{self, SCORES_MAX, WEIGHT_WORDS};
use raywake_core::params::{Birth, Frame, Profile};
use raywake_core::weights::WeightsError;
use serde::Deserialize;

use crate::args::{Learned, ProfileChoice};
use crate::backend::Tables;
use raywake_io::Error;

/// The keys of a profile's file; those it lacks are taken from `base`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    base: Option<String>,
    name: Option<String>,
    side: Option<u32>,
    levels: Option<u32>,
    voxel_m: Option<f64>,
    range_m: Option<f64>,
    frame: Option<FrameKey>,
    deskew: Option<bool>,
    em_rounds: Option<u32>,
    smoothing: Option<u32>,
    displacement_cost: Option<u32>,
    outside_cost: Option<u32>,
    refinement_sweeps: Option<u32>,
    gap_s: Option<f64>,
    jump_mps: Option<f64>,
    spin_radps: Option<f64>,
    #[serde(default)]
    tracklet: TrackletKeys,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct TrackletKeys {
    measurement_cells: Option<f32>,
    pose_noise_m: Option<f32>,
    speed_noise_mps2: Option<f32>,
    turn_noise_radps2: Option<f32>,
    turn_birth_radps: Option<f32>,
    gate_d2: Option<f32>,
    innovation_sweeps: Option<f32>,
    birth: Option<BirthKey>,
    takes_over: Option<bool>,
    coast_sweeps: Option<u32>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FrameKey {
    Lattice,
    Sensor,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum BirthKey {
    Target,
    Source,
}

/// Takes over a key where it is given.
fn set<T>(field: &mut T, key: Option<T>) {
    if let Some(value) = key {
        *field = value;
    }
}

impl Keys {
    fn apply(self, p: &mut Profile) {
        set(&mut p.side, self.side);
        set(&mut p.levels, self.levels);
        set(&mut p.voxel_m, self.voxel_m);
        set(&mut p.range_m, self.range_m);
        let frame = |key| match key {
            FrameKey::Lattice => Frame::Lattice,
            FrameKey::Sensor => Frame::Sensor,
        };
        set(&mut p.frame, self.frame.map(frame));
        set(&mut p.deskew, self.deskew);
        set(&mut p.em_rounds, self.em_rounds);
        set(&mut p.smoothing, self.smoothing);
        set(&mut p.displacement_cost, self.displacement_cost);
        set(&mut p.outside_cost, self.outside_cost);
        set(&mut p.refinement_sweeps, self.refinement_sweeps);
        set(&mut p.limits.gap_s, self.gap_s);
        set(&mut p.limits.jump_mps, self.jump_mps);
        set(&mut p.limits.spin_radps, self.spin_radps);
        let (t, keys) = (&mut p.tracklet, self.tracklet);
        set(&mut t.measurement_cells, keys.measurement_cells);
        set(&mut t.pose_noise_m, keys.pose_noise_m);
        set(&mut t.speed_noise_mps2, keys.speed_noise_mps2);
        set(&mut t.turn_noise_radps2, keys.turn_noise_radps2);
        set(&mut t.turn_birth_radps, keys.turn_birth_radps);
        set(&mut t.gate_d2, keys.gate_d2);
        set(&mut t.innovation_sweeps, keys.innovation_sweeps);
        let birth = |key| match key {
            BirthKey::Target => Birth::Target,
            BirthKey::Source => Birth::Source,
        };
        set(&mut t.birth, keys.birth.map(birth));
        set(&mut t.takes_over, keys.takes_over);
        set(&mut t.coast_sweeps, keys.coast_sweeps);
    }
}

/// The profile asked for, checked. Errors name the file, and the key in it.
pub fn profile(choice: &ProfileChoice) -> Result<Profile, Error> {
    match (&choice.config, &choice.profile) {
        (Some(path), _) => parse(path, &read(path)?),
        (None, Some(name)) => named(name).ok_or_else(|| Error::Usage(no_profile(name))),
        (None, None) => Ok(Profile::hdl64()),
    }
}

fn named(name: &str) -> Option<Profile> {
    Profile::named(name)
}

fn no_profile(name: &str) -> String {
    format!("no profile `{name}`: there are hdl64, wide and dissertation")
}

/// A profile from the text of a file.
fn parse(path: &Path, text: &str) -> Result<Profile, Error> {
    let mut keys: Keys = toml::from_str(text).map_err(|e| {
        let line = e.span().map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1);
        let place = line.map_or(String::new(), |line| format!("line {line}"));
        Error::input(path, place, e.message())
    })?;
    let base = keys.base.take().unwrap_or_else(|| "hdl64".into());
    let mut profile =
        named(&base).ok_or_else(|| Error::input(path, "key `base`", no_profile(&base)))?;
    let name = keys.name.take().unwrap_or_else(|| "custom".into());
    profile.name = name
        .parse()
        .map_err(|_| Error::input(path, "key `name`", "must be at most 24 bytes long"))?;
    keys.apply(&mut profile);
    let rule = |e: raywake_core::params::ProfileError| {
        Error::input(path, format!("key `{}`", e.field), format!("must be {}", e.must))
    };
    profile.check().map_err(rule)?;
    Ok(profile)
}

fn read(path: &Path) -> Result<String, Error> {
    let bytes = fs::read(path).map_err(Error::reading(path))?;
    String::from_utf8(bytes).map_err(|e| {
        let place = format!("byte {}", e.utf8_error().valid_up_to());
        Error::input(path, place, "is no text")
    })
}

/// The texts of both weights files, checked against a profile.
#[derive(Clone)]
pub struct Weights {
    filter: Option<String>,
    constancy: String,
}

impl Weights {
    /// Reads what the command line names, takes what is shipped for the rest. Errors name the file
    /// and the value in it.
    pub fn read(learned: &Learned, profile: &Profile) -> Result<Weights, Error> {
        let filter = match &learned.filter {
            Some(word) if word.as_os_str() == "none" => None,
            Some(path) => Some((Some(path), read(path)?)),
            None => Some((None, background_filter::SHIPPED.to_string())),
        };
        let constancy = match &learned.constancy {
            Some(path) => (Some(path), read(path)?),
            None => (None, occupancy_constancy::shipped(profile.frame).to_string()),
        };
        let levels = profile.levels as usize;
        if let Some((path, text)) = &filter {
            let checked = background_filter::load(text, levels, &mut vec![0; TABLE_WORDS]);
            checked.map_err(|e| mistake(*path, "background filter", "--filter", profile, e))?;
        }
        let (mut words, mut costs) = (vec![0; WEIGHT_WORDS], vec![0; SCORES_MAX]);
        occupancy_constancy::load(&constancy.1, levels, &mut words, &mut costs)
            .map_err(|e| mistake(constancy.0, "occupancy constancy", "--constancy", profile, e))?;
        Ok(Weights { filter: filter.map(|f| f.1), constancy: constancy.1 })
    }

    /// Whether there is a background filter.
    pub fn has_filter(&self) -> bool {
        self.filter.is_some()
    }

    /// The same without the background filter: every solid column is foreground.
    pub fn without_filter(self) -> Weights {
        Weights { filter: None, ..self }
    }

    /// A digest of both texts, 16 hexadecimal digits.
    pub fn digest(&self) -> String {
        let all = format!("{:?}{}", self.filter, self.constancy);
        format!("{:016x}", Digest::of(all.as_bytes()))
    }

    /// The tables made of them.
    pub fn tables(&self, profile: &Profile) -> Result<Tables, Error> {
        Tables::load(profile, self.filter.as_deref(), &self.constancy).map_err(Error::Usage)
    }
}

/// Why the weights of a file, or shipped ones, do not serve a profile.
fn mistake(
    path: Option<&PathBuf>,
    kind: &str,
    option: &str,
    profile: &Profile,
    e: WeightsError,
) -> Error {
    match path {
        Some(path) => Error::input(path, "", format!("{kind}: {e}")),
        None => Error::Usage(format!(
            "the shipped {kind} does not fit profile `{}` of {} levels ({e}): give {option}",
            profile.name, profile.levels
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Profile, String> {
        parse(Path::new("p.toml"), text).map_err(|e| {
            assert_eq!(e.exit_code(), 3);
            e.to_string()
        })
    }

    #[test]
    fn every_key() {
        let text = "base = \"wide\"\nname = \"mine\"\nside = 101\nlevels = 12\nvoxel_m = 0.4\n\
            range_m = 80\nframe = \"sensor\"\ndeskew = false\nem_rounds = 5\nsmoothing = 7\n\
            displacement_cost = 8\noutside_cost = 9\nrefinement_sweeps = 0\ngap_s = 0.25\njump_mps = 33.0\nspin_radps = 2.0\n[tracklet]\n\
            measurement_cells = 0.75\nspeed_noise_mps2 = 2.0\nturn_noise_radps2 = 3.0\n\
            turn_birth_radps = 4.0\ngate_d2 = 5.0\ninnovation_sweeps = 12\nbirth = \"source\"\n\
            takes_over = false\ncoast_sweeps = 6\npose_noise_m = 0.25\n";
        let p = parsed(text).unwrap();
        assert_eq!((p.name.as_str(), p.side, p.levels), ("mine", 101, 12));
        assert_eq!((p.voxel_m, p.range_m, p.frame, p.deskew), (0.4, 80.0, Frame::Sensor, false));
        assert_eq!((p.em_rounds, p.smoothing, p.displacement_cost, p.outside_cost), (5, 7, 8, 9));
        assert_eq!(
            (p.limits.gap_s, p.limits.jump_mps, p.tracklet.birth),
            (0.25, 33.0, Birth::Source)
        );
        let t = &p.tracklet;
        assert_eq!(
            (t.measurement_cells, t.speed_noise_mps2, t.turn_noise_radps2),
            (0.75, 2.0, 3.0)
        );
        assert_eq!((t.turn_birth_radps, t.gate_d2, t.pose_noise_m), (4.0, 5.0, 0.25));
        assert_eq!(t.innovation_sweeps, 12.0);
        assert_eq!((p.refinement_sweeps, t.takes_over, t.coast_sweeps), (0, false, 6));
        let p = parsed("base = \"dissertation\"").unwrap();
        assert_eq!(Profile { name: Profile::dissertation().name, ..p }, Profile::dissertation());
    }

    #[test]
    fn mistakes_name_file_and_key() {
        let e = parsed("side = 101\nsied = 3\n").unwrap_err();
        assert!(e.contains("p.toml, line 2") && e.contains("`sied`"), "{e}");
        let e = parsed("[tracklet]\ngate = 3\n").unwrap_err();
        assert!(e.contains("line 2") && e.contains("`gate`"), "{e}");
        assert!(parsed("side = -1").unwrap_err().contains("line 1"));
        assert!(parsed("side = 257").unwrap_err().contains("key `side`: must be at most 255"));
        assert!(parsed("voxel_m = nan").unwrap_err().contains("`voxel_m`"));
        assert!(parsed("range_m = inf").unwrap_err().contains("`range_m`"));
        assert!(parsed("[tracklet]\ngate_d2 = 1e300").unwrap_err().contains("`gate_d2`"));
        assert!(parsed("base = \"x\"").unwrap_err().contains("key `base`"));
        assert!(parsed("name = \"\"").unwrap_err().contains("key `name`"));
        assert!(parsed("name = \"a name of more than 24 bytes\"").unwrap_err().contains("24"));
        assert!(parsed("side = ").is_err() && parsed("é = 1 =").is_err());
    }

    #[test]
    fn shipped_weights_fit_the_shipped_profiles_only() {
        for profile in [Profile::hdl64(), Profile::wide(), Profile::dissertation()] {
            let weights = Weights::read(&Learned::default(), &profile).unwrap();
            assert!(weights.tables(&profile).is_ok());
        }
        let low = Profile { levels: 12, ..Profile::hdl64() };
        let e = Weights::read(&Learned::default(), &low).err().unwrap().to_string();
        assert!(e.contains("12 levels") && e.contains("--filter"), "{e}");
        let none = Learned { filter: Some("none".into()), constancy: None };
        let e = Weights::read(&none, &low).err().unwrap().to_string();
        assert!(e.contains("12 levels") && e.contains("--constancy"), "{e}");
    }
}
