//! Drives evaluated end to end.

mod recorded;

use super::row::{CLASSES, Row};
use super::{Args, ablate, name_of, rows_file, run};
use crate::scratch::Scratch;
use crate::simulate::{Motion, Recipe, truth, write};
use clap::Parser;
use raywake_core::output::FlowBasis;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Parser)]
enum Command {
    Eval(Args),
    Ablate(ablate::Args),
}

/// Runs `raywake-lab COMMAND` with these arguments.
fn command(name: &str, words: &[&Path], options: &[&str]) -> Result<(), String> {
    let words = words.iter().map(|w| w.as_os_str());
    let options = ["--backend", "scalar"].iter().chain(options).map(OsStr::new);
    let all = ["raywake-lab", name].into_iter().map(OsStr::new).chain(words).chain(options);
    match Command::parse_from(all) {
        Command::Eval(args) => run(&args),
        Command::Ablate(args) => ablate::run(&args),
    }
    .map_err(|e| e.to_string())
}

fn eval(words: &[&Path], options: &[&str]) -> Result<(), String> {
    command("eval", words, options)
}

/// Six sweeps of a busy street, seen from a stationary vehicle.
fn drive(folder: &Path) -> PathBuf {
    drive_of(folder, Motion::Standing, 6)
}

fn drive_of(folder: &Path, motion: Motion, sweeps: usize) -> PathBuf {
    let recipe = Recipe { seed: 3, sweeps, motion, ..Recipe::default() };
    write(folder, &recipe, 1, 2, true).unwrap();
    folder.join("2000_01_01/2000_01_01_drive_0000_sync")
}

fn rows(file: &Path) -> Vec<Row> {
    let mut all = Vec::new();
    rows_file::read(file, |rows| all.extend_from_slice(rows)).unwrap();
    all
}

fn facts(out: &Path) -> serde_json::Value {
    let file = out.join("drives/2000_01_01_drive_0000_sync.json");
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

/// The figure in a table's column, from the first row that begins with `head`.
fn figure(out: &Path, table: &str, head: &[&str], column: &str) -> f64 {
    let file = out.join(format!("tables/{table}.csv"));
    let mut reader = csv::Reader::from_path(file).unwrap();
    let columns = reader.headers().unwrap().clone();
    let at = columns.iter().position(|c| c == column).expect(column);
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    let row = rows.iter().find(|r| r.iter().zip(head).all(|(a, b)| a == *b));
    row.unwrap_or_else(|| panic!("{table}: {head:?}"))[at].parse().unwrap()
}

/// Equal up to what f32 keeps of a few metres.
fn same(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-4
}

/// Whether a column moves with its object, regardless of the filter and the match.
fn joined(row: &Row) -> bool {
    row.basis == FlowBasis::Joined as u8
}

#[test]
fn a_simulated_drive() {
    let folder = Scratch::new();
    let out = folder.path().join("out");
    let drive = drive(folder.path());
    let flag: &Path = Path::new("--out");
    eval(&[&drive, flag, &out], &["--all-columns"]).unwrap();

    let rows_of = out.join("rows/2000_01_01_drive_0000_sync.parquet");
    let rows = rows(&rows_of);
    // The pairs, and the columns of each.
    assert_eq!(rows.iter().map(|r| r.sweep).max(), Some(4));
    assert!(rows.len() > 5 * 3000, "{} rows", rows.len());
    // Seen all round by a stationary vehicle: nothing is carried along, and rounding is within half
    // a cell along each axis.
    let labelled: Vec<&Row> = rows.iter().filter(|r| r.class > 0 && r.in_view).collect();
    assert!(labelled.len() > 200, "{} labelled", labelled.len());
    for r in &labelled {
        assert!(r.carried_x.hypot(r.carried_y) < 2e-3 && r.voxels > 0 && r.track > 0);
        let off = [r.rounded_x - r.true_x, r.rounded_y - r.true_y];
        assert!(off.iter().all(|v| v.abs() <= 0.15 + 1e-4), "{off:?}");
        // Exact labels equal their own smoothed motion.
        assert!(same(r.smooth_x, r.true_x) && same(r.smooth_y, r.true_y), "{r:?}");
        let moved = r.true_x.hypot(r.true_y) / r.dt;
        assert_eq!(
            r.motion == 0,
            moved < 0.02,
            "{} moves at {moved} m/s",
            CLASSES[r.class as usize]
        );
    }
    assert!(labelled.iter().any(|r| r.motion == 2) && labelled.iter().any(|r| r.motion == 0));
    for r in rows.iter().filter(|r| !r.is_matched()) {
        assert_eq!((r.flow_x, r.flow_y), (0.0, 0.0));
    }
    // Whatever the filter rejects scored at most 0.
    assert!(rows.iter().filter(|r| !joined(r)).all(|r| (r.basis > 0) == (r.score > 0)));

    let first = facts(&out);
    assert_eq!((&first["pairs"], &first["sweeps"]), (&5.into(), &6.into()));
    assert_eq!(first["unfiltered"].as_array().unwrap().len(), 5);
    for file in ["report.html", "tables/table-3-1.csv", "charts/figure-3-6.png"] {
        assert!(fs::metadata(out.join(file)).unwrap().len() > 100, "{file}");
    }
    let table = fs::read_to_string(out.join("tables/references-raw.csv")).unwrap();
    let line = table.lines().find(|l| l.starts_with("parked,ego motion only")).unwrap();
    assert!(line.split(',').nth(4).unwrap().parse::<f64>().unwrap() < 1e-3, "{line}");

    // The vehicle is stationary, and movers are seen well.
    for of in ["columns", "returns"] {
        let share = |column: &str| figure(&out, "moving-or-not", &[of, "exact"], column);
        assert!(share("Recall, %") > 70.0 && share("Precision, %") > 50.0, "{of}");
    }

    // Again: nothing is redone; with another margin it is, since that decides on columns of ground.
    eval(&[&drive, flag, &out], &["--all-columns"]).unwrap();
    assert_eq!(facts(&out), first);
    eval(&[&drive, flag, &out], &["--margin", "0.3"]).unwrap();
    assert_ne!(facts(&out)["settings"], first["settings"]);
    assert!(super::tests::rows(&rows_of) != rows);

    // Damaged facts are made anew, damaged rows are named.
    let facts_of = out.join("drives/2000_01_01_drive_0000_sync.json");
    fs::write(&facts_of, "{").unwrap();
    eval(&[&drive, flag, &out], &["-n", "3"]).unwrap();
    let whole = fs::read(&rows_of).unwrap();
    fs::write(&rows_of, &whole[..whole.len() / 2]).unwrap();
    let failed = eval(&[&drive, flag, &out], &["-n", "3"]).unwrap_err();
    assert!(failed.contains("2000_01_01_drive_0000_sync.parquet"), "{failed}");
}

#[test]
fn boxes_where_truth_is_unknown() {
    let folder = Scratch::new();
    let out = folder.path().join("out");
    let drive = drive(folder.path());
    // The rest is a recording, labelled in the camera's view.
    fs::remove_file(drive.join("truth/objects.feather")).unwrap();
    let labelled = |margin: &str| {
        let options = ["-n", "3", "--margin", margin];
        eval(&[&drive, Path::new("--out"), &out], &options).unwrap();
        let rows = rows(&out.join("rows/2000_01_01_drive_0000_sync.parquet"));
        rows.iter().filter(|r| r.class > 0).count()
    };
    let (boxes, wider) = (labelled("0"), labelled("0.3"));
    assert!(boxes > 20 && wider > boxes, "{boxes} and {wider}");
    // Without boxes, but with a class for every return: building.
    fs::remove_file(drive.join("tracklet_labels.xml")).unwrap();
    fs::create_dir(drive.join("labels")).unwrap();
    let building = 50u32.to_le_bytes();
    let returns = |n: usize| {
        let cloud = drive.join(format!("velodyne_points/data/{n:010}.bin"));
        fs::metadata(cloud).unwrap().len() as usize / size_of::<[f32; 4]>()
    };
    for n in 0..3 {
        fs::write(drive.join(format!("labels/{n:06}.label")), building.repeat(returns(n))).unwrap();
    }
    assert_eq!(labelled("0"), 0);
    let all = (returns(0) + returns(1)) as f64;
    let count = |column: &str| figure(&out, "semantic-kitti", &["building"], column);
    assert_eq!((count("Returns"), count("Reported as moving") > 0.0), (all, true));
}

#[test]
fn pairs_on_their_own() {
    let folder = Scratch::new();
    let drive = drive_of(folder.path(), Motion::Straight, 4);
    let out = folder.path().join("out");
    eval(&[&drive, Path::new("--out"), &out], &["--pairs"]).unwrap();
    let of = |folder: &Path| rows(&folder.join("rows/2000_01_01_drive_0000_sync.parquet"));
    let (run, pairs) = (of(&out), of(&out.join("pairs")));
    assert_eq!(run.len(), pairs.len());
    for (a, b) in run.iter().zip(&pairs) {
        let truth = |r: &Row| (r.sweep, [r.cell_i, r.cell_j], [r.true_x, r.true_y], r.voxels);
        assert_eq!(truth(a), truth(b));
        // The first pair has no history in either case.
        assert!(b.age == 0 && (a.sweep > 0 || a == b));
    }
    assert!(run.iter().any(|r| r.age > 0));
    let median = |column: &str| figure(&out, "table-3-1", &["All labelled", "moving"], column);
    assert!(median("Median, cm (pair by pair)") < 10.0 && median("Median, cm") < 10.0);
}

#[test]
fn drives_that_fail_are_named() {
    let folder = Scratch::new();
    let out = folder.path().join("out");
    let good = drive(folder.path());
    let flag: &Path = Path::new("--out");
    // Another drive without its labels.
    let bad = folder.path().join("unlabelled");
    let copy = std::process::Command::new("cp").arg("-r").arg(&good).arg(&bad).status().unwrap();
    assert!(copy.success());
    fs::remove_file(bad.join("truth/objects.feather")).unwrap();
    fs::remove_file(bad.join("tracklet_labels.xml")).unwrap();
    let failed = eval(&[&bad, &good, flag, &out], &["-n", "2", "--jobs", "2"]).unwrap_err();
    assert!(failed.contains("unlabelled") && failed.contains("label"), "{failed}");
    assert!(out.join("report.html").is_file());
    // Truth that does not fit the clouds.
    let first = truth::points_path(&good, 0);
    let rows = truth::read_points(&first).unwrap();
    truth::write_points(&first, &rows[1..]).unwrap();
    let failed = eval(&[&good, flag, &out], &["-n", "3"]).unwrap_err();
    assert!(failed.contains("0000000000.feather"), "{failed}");
    // One name for two drives, no drive, an invalid margin.
    let twin = folder.path().join("twin").join(good.file_name().unwrap());
    fs::create_dir_all(&twin).unwrap();
    assert!(eval(&[&good, &twin, flag, &out], &[]).unwrap_err().contains("same name"));
    let upper = folder.path().join("UNLABELLED");
    fs::create_dir(&upper).unwrap();
    assert!(eval(&[&bad, &upper, flag, &out], &[]).unwrap_err().contains("same name"));
    assert!(eval(&[Path::new("/nowhere"), flag, &out], &[]).unwrap_err().contains("/nowhere"));
    assert!(eval(&[&good, flag, &out], &["--margin", "9"]).unwrap_err().contains("--margin"));
}

#[test]
fn parts_of_a_list() {
    let folder = Scratch::new();
    let good = drive(folder.path());
    let name = good.file_name().unwrap();
    // Another drive of the same name.
    let twin = folder.path().join("twin").join(name);
    fs::create_dir_all(twin.parent().unwrap()).unwrap();
    let copy = std::process::Command::new("cp").arg("-r").arg(&good).arg(&twin).status().unwrap();
    assert!(copy.success());
    let (list, out) = (folder.path().join("list"), folder.path().join("out"));
    fs::write(&list, format!("{}\n{}\n", good.display(), twin.display())).unwrap();
    let [list_flag, flag] = ["--list", "--out"].map(Path::new);
    for (shard, rows, report) in [("0/2", 1, false), ("1/2", 2, false), ("0/1", 2, true)] {
        eval(&[list_flag, &list, flag, &out], &["-n", "2", "--shard", shard]).unwrap();
        assert_eq!(fs::read_dir(out.join("rows")).unwrap().count(), rows, "{shard}");
        assert_eq!(out.join("report.html").is_file(), report, "{shard}");
    }
    eval(&[list_flag, &list, flag, &out], &["--shard", "7/9"]).unwrap();
}

#[test]
fn a_moving_vehicle() {
    let folder = Scratch::new();
    let drive = drive_of(folder.path(), Motion::Straight, 4);
    let [out, above] = ["out", "above"].map(|name| folder.path().join(name));
    let flag: &Path = Path::new("--out");
    eval(&[&drive, flag, &out], &[]).unwrap();
    let rows_of = out.join("rows/2000_01_01_drive_0000_sync.parquet");
    let all = rows(&rows_of);
    // The window moves on between the sweeps, and scores are still those the filter saw.
    assert!(all.iter().any(|r| r.carried_x.hypot(r.carried_y) > 0.3));
    let other = all.iter().filter(|r| !joined(r) && (r.basis > 0) != (r.score > 0)).count();
    assert_eq!(other, 0, "of {}", all.len());

    // Named by a folder above it, the drive has the same truth.
    eval(&[folder.path(), flag, &above], &[]).unwrap();
    let table = |out: &Path| fs::read_to_string(out.join("tables/three-way.csv")).unwrap();
    assert_eq!(table(&above), table(&out));

    // Opened differently, it is evaluated anew; if that fails, nothing old is left that could pass
    // for it.
    let settings = || facts(&out)["settings"].clone();
    let before = settings();
    eval(&[&drive, flag, &out], &["--ground", "-1.6"]).unwrap();
    assert_ne!(settings(), before);
    let cloud = drive.join("velodyne_points/data/0000000002.bin");
    let whole = fs::read(&cloud).unwrap();
    fs::write(&cloud, &whole[..whole.len() - 3]).unwrap();
    let failed = eval(&[&drive, flag, &out], &[]).unwrap_err();
    assert!(failed.contains("0000000002.bin"), "{failed}");
    assert!(!rows_of.exists() && !out.join("drives/2000_01_01_drive_0000_sync.json").exists());
    fs::write(&cloud, &whole).unwrap();
    eval(&[&drive, flag, &out], &[]).unwrap();
    assert_eq!((settings(), rows(&rows_of)), (before, all));
}

#[test]
fn variants_in_one_table() {
    let folder = Scratch::new();
    let drive = drive_of(folder.path(), Motion::Standing, 4);
    let [out, author] = ["out", "author"].map(|name| folder.path().join(name));
    let flag: &Path = Path::new("--out");
    let lines = |out: &Path| -> Vec<Vec<String>> {
        let text = fs::read_to_string(out.join("tables/ablations.csv")).unwrap();
        text.lines().skip(1).map(|l| l.split(',').map(String::from).collect()).collect()
    };
    let only = ["--only", "filter-off,base,rounds-6,refine-0"];
    command("ablate", &[&drive, flag, &out], &only).unwrap();
    let table = lines(&out);
    let names: Vec<&String> = table.iter().map(|row| &row[0]).collect();
    assert_eq!(names, ["base", "refine-0", "rounds-6", "filter-off"]);
    // From the same rows: the base has as many rounds.
    assert_eq!(table[0][2..], table[2][2..]);
    assert!(out.join("filter-off/rows").is_dir() && !out.join("rounds-6").exists());
    let number = |row: usize, column: usize| table[row][column].parse::<f64>().unwrap();
    // Whole cells have larger errors on movers, and the filter changes what is found.
    assert!(number(1, 3) > 2.0 * number(0, 3), "{table:?}");
    assert_ne!(table[3][3..10], table[0][3..10]);
    // Precision and recall.
    assert!([18, 19].iter().all(|&n| (30.0..=100.0).contains(&number(0, n))), "{table:?}");
    assert!(number(0, 13) > number(0, 14) && number(0, 14) > 0.0, "{table:?}");
    // A variant's folder is an `eval` folder: `eval` finds it done, with the same figures.
    let base = out.join("base");
    let before = facts(&base);
    eval(&[&drive, flag, &base], &[]).unwrap();
    assert_eq!(facts(&base), before);
    let flows = fs::read_to_string(base.join("tables/references-raw.csv")).unwrap();
    let moving = flows.lines().find(|l| l.starts_with("moving,raywake,")).unwrap();
    assert_eq!(moving.split(',').skip(2).collect::<Vec<_>>(), table[0][2..6]);

    // One that cannot run is named, and the others are present.
    let only = ["--profile", "dissertation", "--only", "base,refine-2", "-n", "2"];
    let failed = command("ablate", &[&drive, flag, &author], &only).unwrap_err();
    assert!(failed.contains("refine-2: refinement_sweeps"), "{failed}");
    let table = lines(&author);
    assert!(!table[0][2].is_empty() && table[1][0] == "refine-2" && table[1][2].is_empty());
    assert!(fs::read_to_string(author.join("report.html")).unwrap().contains("refinement_sweeps"));
}

#[test]
fn no_two_paths_of_a_list_have_one_name() {
    let names = ["a/b", "a+b", "a/+b", "a+/b", "a%2Bb", "ab"].map(|path| name_of(Path::new(path)));
    assert_eq!(names, ["a+b", "a%2Bb", "a+%2Bb", "a%2B+b", "a%252Bb", "ab"]);
}
