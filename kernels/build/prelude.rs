//! The constants and records of `raywake-core`, as WGSL.

use raywake_core::{background_filter, layout, params, record};
use std::fmt::Write;

/// Text to put in front of every kernel.
pub fn prelude() -> String {
    let mut text = String::new();
    let unsigned: &[(&str, usize)] = &[
        ("POINTS_MAX", params::POINTS_MAX),
        ("LEVELS_MAX", params::LEVELS_MAX),
        ("FOREGROUND_MAX", params::FOREGROUND_MAX),
        ("SIDE", params::SIDE),
        ("LINE", params::LINE),
        ("ROW", params::ROW),
        ("ROW_WORDS", params::ROW_WORDS),
        ("MERGE_SLOTS", params::MERGE_SLOTS),
        ("MERGE_PROBES", params::MERGE_PROBES as usize),
        ("WORKGROUP", params::WORKGROUP),
        ("ROW_WORKGROUP", params::ROW_WORKGROUP),
        ("TILE", params::TILE),
        ("RADIX", params::RADIX),
        ("COST_UNKNOWN", params::COST_UNKNOWN as usize),
        ("FILTER_TABLE", background_filter::TABLE),
        ("DISTINCT_COUNT", layout::DISTINCT_COUNT),
        ("FOREGROUND_COUNT", layout::FOREGROUND_COUNT),
        ("FOREGROUND_MARKED", layout::FOREGROUND_MARKED),
        ("GROUPS_DISTINCT", layout::GROUPS_DISTINCT),
        ("GROUPS_FOREGROUND", layout::GROUPS_FOREGROUND),
        ("GROUPS_ROWS", layout::GROUPS_ROWS),
        ("DIGIT_SHIFT", layout::DIGIT_SHIFT),
        ("NO_END", record::NO_END as usize),
        ("VALID", record::VALID as usize),
        ("NONE", record::NONE as usize),
    ];
    for (name, value) in unsigned {
        let _ = writeln!(text, "const {name} = {value}u;");
    }
    let signed: &[(&str, i32)] = &[
        ("REACH", params::REACH),
        ("LOG_ODDS_FREE", params::LOG_ODDS_FREE),
        ("LOG_ODDS_OCCUPIED", params::LOG_ODDS_OCCUPIED),
        ("LOG_ODDS_SOLID", params::LOG_ODDS_SOLID),
        ("I32_MAX", i32::MAX),
    ];
    for (name, value) in signed {
        let _ = writeln!(text, "const {name}: i32 = {value};");
    }
    let fields: String = record::Step::FIELDS.iter().map(|f| format!("{f}: i32, ")).collect();
    let _ = writeln!(text, "struct Step {{ {fields}}}");
    text
}
