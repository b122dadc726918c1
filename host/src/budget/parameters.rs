//! `PARAMETERS.md`: every parameter as declared.

use std::fmt::Write as _;

use raywake_core::params::{Parameter, Profile};

use super::shipped;
use raywake_objects::params::TrackingParams;

const HEAD: &str = "\
# Parameters

Printed by `raywake budget --parameters`; a test compares it with this file. A parameter is set by
`--set NAME=VALUE` or, in a file given with `--config`, by a key of this name, at the top level or
in a table named after its group. Defaults are those of profile `hdl64`, followed by the profiles
that differ. Figures are described in RESULTS.md; they were measured when a value was chosen, not
again with every change since.
";

const OBJECTS: &str = "
## objects

Parameters of `raywake track`: `--set objects.NAME=VALUE`, or keys of the table `objects`. A name
that occurs in two groups is given as `objects.GROUP.NAME`.
";

const COLUMNS: &str = "\
| name | default | unit | range | meaning | why this default |
|---|---|---|---|---|---|
";

/// Returns the text of `PARAMETERS.md`.
pub fn parameters() -> String {
    let mut text = HEAD.to_string();
    let profiles = shipped();
    for (n, (name, group)) in profiles[0].groups().iter().enumerate() {
        let title = if name.is_empty() { "Profile" } else { name };
        let _ = write!(text, "\n## {title}\n\n{COLUMNS}");
        for p in group.declared() {
            text += &row(p, &default_of(p.name, n, &profiles));
        }
    }
    text += OBJECTS;
    let mut objects = TrackingParams::DEFAULT;
    objects.each(&mut |name, group| {
        let _ = write!(text, "\n### objects.{name}\n\n{COLUMNS}");
        for p in group.declared() {
            let default = group.get(p.name).map_or(String::new(), |v| v.to_string());
            text += &row(p, &default);
        }
    });
    text
}

/// The values of a parameter of group `n` in the profiles.
fn default_of(name: &str, n: usize, profiles: &[Profile]) -> String {
    let value = |p: &Profile| p.groups()[n].1.get(name).map_or(String::new(), |v| v.to_string());
    let default = value(&profiles[0]);
    let others = profiles[1..].iter().map(|p| (p.name.as_str(), value(p)));
    let differ = others.filter(|(_, v)| *v != default).map(|(name, v)| format!("{name}: {v}"));
    [default.clone()].into_iter().chain(differ).collect::<Vec<_>>().join("; ")
}

fn row(p: &Parameter, default: &str) -> String {
    let cells = [p.name, default, p.unit, p.bounds.text, p.doc, p.why];
    let cells = cells.map(|c| c.trim().replace('|', "\\|"));
    format!("| `{}` | {} |\n", cells[0], cells[1..].join(" | "))
}
