//! Profiles: built in, or from files named on the command line.

use std::borrow::Cow;
use std::path::Path;

use raywake_core::params::{AssignError, ParameterSetting, Profile, ProfileError, Value};
use raywake_objects::params::TrackingParams;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::args::ProfileChoice;
use raywake_io::Error;
use raywake_io::source::whole::read_settings;

/// The group of the tracking parameters, which has groups of its own.
const OBJECTS: &str = "objects";

/// Everything that can be set.
pub struct Settings {
    /// Flow parameters.
    pub profile: Profile,
    /// Object tracking parameters.
    pub objects: TrackingParams,
}

impl Settings {
    fn check(&self) -> Result<(), ProfileError> {
        self.profile.check().and_then(|()| self.objects.check())
    }
}

/// Returns the profile asked for, checked. Errors name the file and the key in it.
pub fn profile(choice: &ProfileChoice) -> Result<Profile, Error> {
    settings(choice).map(|settings| settings.profile)
}

/// As [`profile`], with the tracking parameters.
pub fn settings(choice: &ProfileChoice) -> Result<Settings, Error> {
    settings_over(choice, TrackingParams::DEFAULT)
}

/// As [`settings`], with tracking parameters that start from these instead of the defaults.
pub fn settings_over(choice: &ProfileChoice, objects: TrackingParams) -> Result<Settings, Error> {
    let mut settings = match (&choice.config, &choice.profile) {
        (Some(path), _) => parse(path, &read_settings(path)?, objects)?,
        (None, Some(name)) => {
            let profile = Profile::named(name).ok_or_else(|| Error::Usage(no_profile(name)))?;
            Settings { profile, objects }
        }
        (None, None) => Settings { profile: Profile::hdl64(), objects },
    };
    for assignment in &choice.set {
        assign(&mut settings, assignment)
            .map_err(|e| Error::Usage(format!("--set {assignment}: {e}")))?;
    }
    if let Some(p) = choice.moving {
        settings.profile.moves.moves_min = p;
        settings.profile.check().map_err(|_| Error::Usage("--moving must be 0 to 1".into()))?;
    }
    let rule =
        |e: ProfileError| Error::Usage(format!("--set: `{}` must be {}", e.field, e.requirement));
    settings.check().map_err(rule)?;
    Ok(settings)
}

fn no_profile(name: &str) -> String {
    format!("no profile `{name}`: available are hdl64, wide, far and dissertation")
}

/// Sets a parameter from `name=value` or `group.name=value`. The profile's name gets an asterisk.
fn assign(settings: &mut Settings, assignment: &str) -> Result<(), String> {
    let to = ParameterSetting::parse(assignment).ok_or("expected NAME=VALUE")?;
    set(settings, &to)?;
    if to.group != Some(OBJECTS) && !settings.profile.name.ends_with('*') {
        // If there is no room for it, the name stays as it is.
        let _ = settings.profile.name.push('*');
    }
    Ok(())
}

/// Sets a parameter of the given group or, without one, of the group that has it. Names are unique.
fn set(s: &mut Settings, to: &ParameterSetting) -> Result<(), String> {
    let ParameterSetting { group, name, value } = *to;
    if group == Some(OBJECTS) {
        return set_of_objects(&mut s.objects, name, value);
    }
    s.profile.assign(to).map_err(|e| match e {
        AssignError::Unknown => {
            let place = group.map_or(String::new(), |g| format!(" in `{g}`"));
            format!("there is no parameter `{name}`{place} (see PARAMETERS.md)")
        }
        AssignError::InvalidValue(requirement) => format!("`{name}` must be {requirement}"),
    })
}

/// Sets a tracking parameter by `name` or `group.name`.
fn set_of_objects(objects: &mut TrackingParams, path: &str, value: Value) -> Result<(), String> {
    let (group, name) = path.split_once('.').map_or((None, path), |(g, n)| (Some(g), n));
    let mut found = Vec::new();
    objects.each(&mut |own, parameters| {
        if parameters.get(name).is_some() && group.is_none_or(|group| group == own) {
            found.push((own, parameters.set(name, value)));
        }
    });
    match found[..] {
        [] => Err(format!("there is no parameter `objects.{path}` (see PARAMETERS.md)")),
        [(_, set)] => set.map_err(|requirement| format!("`{name}` must be {requirement}")),
        [(a, _), (b, _), ..] => Err(format!("ambiguous: `{a}.{name}` or `{b}.{name}`?")),
    }
}

fn parse(path: &Path, text: &str, objects: TrackingParams) -> Result<Settings, Error> {
    let line = |at: usize| format!("line {}", text[..at.min(text.len())].matches('\n').count() + 1);
    let table = DeTable::parse(text).map_err(|e| {
        let place = e.span().map_or(String::new(), |s| line(s.start));
        Error::input(path, place, e.message())
    })?;
    let table = table.get_ref();
    let word = |key: &'static str, default| match table.get(key).map(|v| v.get_ref()) {
        None => Ok(default),
        Some(DeValue::String(word)) => Ok(word.as_ref()),
        Some(_) => Err(Error::input(path, format!("key `{key}`"), "must be a string")),
    };
    let base = word("base", "hdl64")?;
    let profile =
        Profile::named(base).ok_or_else(|| Error::input(path, "key `base`", no_profile(base)))?;
    let mut settings = Settings { profile, objects };
    settings.profile.name = word("name", "custom")?
        .parse()
        .map_err(|_| Error::input(path, "key `name`", "must be at most 24 bytes long"))?;
    for (key, value) in table.iter().filter(|(k, _)| !["base", "name"].contains(&&**k.get_ref())) {
        let mut put = |group, key: &Spanned<Cow<str>>, value: &DeValue| {
            let mut one = |name: &str, value: &DeValue| {
                let value = value_of(value).ok_or_else(|| format!("`{name}` has the wrong type"));
                value
                    .and_then(|value| set(&mut settings, &ParameterSetting { group, name, value }))
                    .map_err(|e| Error::input(path, line(key.span().start), e))
            };
            match value {
                DeValue::Table(inner) if group == Some(OBJECTS) => {
                    let name = |inner: &str| format!("{}.{inner}", key.get_ref());
                    inner.iter().try_for_each(|(k, v)| one(&name(k.get_ref()), v.get_ref()))
                }
                value => one(key.get_ref(), value),
            }
        };
        match value.get_ref() {
            DeValue::Table(group) => {
                let name = Some(key.get_ref().as_ref());
                group.iter().try_for_each(|(key, value)| put(name, key, value.get_ref()))?;
            }
            value => put(None, key, value)?,
        }
    }
    let rule = |e: ProfileError| {
        Error::input(path, format!("key `{}`", e.field), format!("must be {}", e.requirement))
    };
    settings.check().map_err(rule)?;
    Ok(settings)
}

/// The value of a parameter as given in a file.
fn value_of<'a>(value: &'a DeValue) -> Option<Value<'a>> {
    match value {
        DeValue::String(word) => Some(Value::Word(word)),
        DeValue::Integer(v) => {
            Some(Value::Number(i64::from_str_radix(v.as_str(), v.radix()).ok()? as f64))
        }
        DeValue::Float(v) => v.as_str().parse().ok().map(Value::Number),
        DeValue::Boolean(v) => Some(Value::Flag(*v)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::params::{Birth, Frame};

    fn parsed(text: &str) -> Result<Profile, String> {
        parse(Path::new("p.toml"), text, TrackingParams::DEFAULT)
            .map(|settings| settings.profile)
            .map_err(|e| {
                assert_eq!(e.exit_code(), 3);
                e.to_string()
            })
    }

    #[test]
    fn every_key() {
        let text = "base = \"wide\"\nname = \"mine\"\nside = 101\nlevels = 12\nvoxel_m = 0.4\n\
            range_m = 80\nframe = \"sensor\"\ndeskew = false\nem_rounds = 5\nsmoothing = 7\n\
            displacement_cost = 8\noutside_cost = 9\nrefinement_sweeps = 0\ngap_s = 0.25\n\
            jump_mps = 33.0\nspin_radps = 2.0\n[tracklet]\n\
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
        assert!(parsed("side = 339").unwrap_err().contains("key `side`: must be 31 to 337"));
        assert!(parsed("voxel_m = nan").unwrap_err().contains("`voxel_m`"));
        assert!(parsed("range_m = inf").unwrap_err().contains("`range_m`"));
        assert!(parsed("[tracklet]\ngate_d2 = 1e300").unwrap_err().contains("`gate_d2`"));
        assert!(parsed("base = \"x\"").unwrap_err().contains("key `base`"));
        assert!(parsed("name = \"\"").unwrap_err().contains("key `name`"));
        assert!(parsed("name = \"a name of more than 24 bytes\"").unwrap_err().contains("24"));
        let e = parsed("frame = \"x\"").unwrap_err();
        assert!(e.contains("line 1") && e.contains("must be lattice or sensor"), "{e}");
        assert!(parsed("[tracklet]\nside = 101").unwrap_err().contains("in `tracklet`"));
        assert!(parsed("side = [1]").unwrap_err().contains("`side`"));
        assert!(parsed("side = ").is_err() && parsed("é = 1 =").is_err());
    }

    #[test]
    fn damaged_files() {
        let text = "base = \"wide\"\nside = 101\nvoxel_m = 0.4\ndeskew = false\nem_rounds = 5\n\
            [tracklet]\ngate_d2 = 5.0\nbirth = \"source\"\n[objects]\npatience_s = 0.6\n";
        let checked = |profile: Profile| assert_eq!(profile.check(), Ok(()));
        crate::damaged::check(text, 5000, |text| parsed(text).map(checked).is_ok());
    }

    #[test]
    fn single_parameters() {
        let choice = |set: &[&str]| ProfileChoice {
            set: set.iter().map(|s| s.to_string()).collect(),
            ..ProfileChoice::default()
        };
        let p = profile(&choice(&["side=101", "tracklet.birth = source", "takes_over=false"]));
        let p = p.unwrap();
        assert_eq!((p.side, p.tracklet.birth, p.tracklet.takes_over), (101, Birth::Source, false));
        assert_eq!((p.name.as_str(), p.voxel_m), ("hdl64*", 0.30));
        for (set, words) in [
            ("side", "NAME=VALUE"),
            ("sied=3", "no parameter `sied`"),
            ("limits.side=3", "in `limits`"),
            ("side=1.5", "whole number"),
            ("side=9", "`side` must be 31 to 337"),
            ("side=100", "`side` must be odd"),
            ("gap_s=x", "`gap_s` must be a number"),
        ] {
            let e = profile(&choice(&[set])).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains(words), "{e}");
        }
    }
}
