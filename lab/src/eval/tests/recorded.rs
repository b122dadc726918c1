//! Recorded drives: results on them must not get worse. `RAYWAKE_DATA` names their folder. The
//! limits are slightly looser than the values measured when they were set; tighten them after
//! improvements.

use super::{eval, figure};
use crate::scratch::Scratch;
use std::path::{Path, PathBuf};

/// Evaluates a recorded drive and returns the folder of results.
fn evaluated(scratch: &Scratch, drive: &str, options: &[&str]) -> PathBuf {
    let folder = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA");
    let out = scratch.path().join("out");
    eval(&[&PathBuf::from(folder).join(drive), Path::new("--out"), &out], options).unwrap();
    out
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn movers_are_found_and_little_else() {
    let scratch = Scratch::new();
    let out = evaluated(&scratch, "kitti_raw_0005", &["--pairs"]);
    let verdict = |of: &str, column: &str| figure(&out, "moving-or-not", &[of, "labels"], column);
    let flow = |column: &str| figure(&out, "table-3-1", &["All labelled", "moving"], column);
    let late =
        |class: &str| figure(&out, "first-sight", &["labels", class], "Half of it: median, s");
    let mut wrong = Vec::new();
    for (what, value, least, most) in [
        ("precision of columns", verdict("columns", "Precision, %"), 81.0, 100.0),
        ("recall of columns", verdict("columns", "Recall, %"), 94.6, 100.0),
        ("IoU of columns", verdict("columns", "IoU, %"), 77.5, 100.0),
        ("0.5 m forgiven", verdict("columns", "Precision, 0.5 m forgiven, %"), 98.0, 100.0),
        ("false columns a sweep far from movers", verdict("columns", "Farther"), 0.0, 0.75),
        ("IoU of returns", verdict("returns", "IoU, %"), 84.5, 100.0),
        ("median error of raw flow, cm", flow("Median, cm"), 0.0, 2.3),
        // 94.96: 0.3 points less since P(moves) comes from trees.
        ("raw flow within 30 cm, %", flow("Within 30 cm, %"), 94.8, 100.0),
        ("the same pair by pair, cm", flow("Median, cm (pair by pair)"), 0.0, 2.0),
        ("seconds until half the van is found", late("Van"), 0.1, 0.15),
        ("seconds until half the cyclist is found", late("Cyclist"), 0.1, 0.15),
    ] {
        println!("{what}: {value}");
        if !(least..=most).contains(&value) {
            wrong.push(format!("{what}: {value}, not {least} to {most}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn static_structure_is_reported_static() {
    let scratch = Scratch::new();
    let out = evaluated(&scratch, "kitti_odometry_00", &["--deskew", "off"]);
    let share = |class: &str| figure(&out, "semantic-kitti", &[class], "Reported as moving, %");
    for (class, most) in [
        ("all static", 0.0025),
        ("building", 0.002),
        // Eight of 14 as if they had just started: `acceleration_mps2`.
        ("vegetation", 0.01),
        ("fence", 0.005),
        ("sidewalk", 0.005),
        // One return of 8,643.
        ("terrain", 0.012),
    ] {
        println!("{class}: {}", share(class));
        assert!(share(class) <= most, "{} % of {class}", share(class));
    }
}
