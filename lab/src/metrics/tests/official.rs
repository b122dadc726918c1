//! The figures of the official graders on a real pair, by class and bucket.
//!
//! `official.txt` holds their results for estimates derived from the truth by a formula (32-bit
//! floats, `i` the row):
//!
//! | estimate | flow |
//! |---|---|
//! | `zero` | none |
//! | `rounded` | `rint(truth / 0.3) * 0.3` |
//! | `pattern` | `truth * 0.9 + ((i % 7 - 3) * 0.01, (i % 11 - 5) * 0.01, (i % 5 - 2) * 0.01)` |
//! | `carried` | [`reference::carried`] |
//!
//! `bucketed` and `threeway` lines are from `bucketed-scene-flow-eval` 2.0.25 (numpy 2.4) on log
//! 7fab2350 of Argoverse 2's validation split (statistics of CC BY-NC-SA 4.0 data):
//! `Argoverse2CausalSceneFlow(root_dir, with_rgb=False, with_ground=…, eval_type="bucketed_epe" or
//! "threeway_epe")` for truth and estimate, `evaluator().eval(estimate[0][0].flow, truth[0][0])`,
//! then `compute_results()` (`class`: static and dynamic error within 35 m), its table
//! (`bucket`: category, range, speeds, count, EPE, mean speed) and its `get_mean_average_values`
//! (`mean`).
//!
//! `both` is one evaluator given two frames: `zero` without ground, then `pattern` with it.
//!
//! `accuracy` lines (count, EPE, strict, relaxed, outliers, angle) follow the formulas of av2-api's
//! `evaluation/scene_flow/eval.py`, and for outliers FlowNet3D's, in numpy on the returns that the
//! grader above counts without ground, with the vehicle's motion `removed` or `included`.

use super::*;
use argoverse::Log;
use grades::Grades;
use std::path::PathBuf;

/// The estimates of `official.txt`.
fn estimate(name: &str, pair: &Pair) -> Vec<[f32; 3]> {
    let offset = |i: usize, period: usize, half: f32| ((i % period) as f32 - half) * 0.01;
    let pattern = |(i, p): (usize, &TruePoint)| {
        let [x, y, z] = p.flow_m.map(|v| v * 0.9);
        [x + offset(i, 7, 3.0), y + offset(i, 11, 5.0), z + offset(i, 5, 2.0)]
    };
    match name {
        "zero" => reference::zero_motion(pair),
        "rounded" => reference::rounded(pair, 0.3),
        "pattern" => pair.points.iter().enumerate().map(pattern).collect(),
        "carried" => reference::carried(pair),
        _ => panic!("no estimate `{name}`"),
    }
}

fn same(line: &str, want: &[&str], got: &[f64]) {
    assert_eq!(want.len(), got.len(), "{line}");
    for (want, got) in want.iter().zip(got) {
        let want: f64 = want.parse().unwrap();
        let equal = want == *got || want.is_nan() && got.is_nan();
        assert!(equal || (want - got).abs() < 1e-6, "{line}: {got:?}");
    }
}

/// The figures a line is about.
fn figures(grades: &Grades, words: &[&str]) -> Vec<f64> {
    match *words {
        ["accuracy", _, group, ego] => accuracy(grades, group, ego),
        [metric, _, "bucket", name, range, from] => {
            let category = Category::from_name(name).unwrap();
            let range = if range == "35" { Range::Near } else { Range::All };
            let buckets = match metric {
                "bucketed" => grades.bucketed.category(category, range),
                _ => grades.three_way.category(category, range).to_vec(),
            };
            let from: f64 = from.parse().unwrap();
            let b = buckets.iter().find(|b| (b.from_m - from).abs() < 1e-6).unwrap();
            vec![b.to_m, b.count as f64, b.epe_m, b.mean_speed_m]
        }
        ["bucketed", _, kind, ref rest @ ..] => {
            let errors = grades.bucketed.errors(Range::Near);
            if kind == "mean" {
                return vec![errors.mean_static_epe_m, errors.mean_dynamic];
            }
            let class = errors.classes.iter().find(|c| c.class.name() == rest[0]).unwrap();
            vec![class.static_epe_m, class.dynamic]
        }
        ["threeway", _, kind, ref rest @ ..] => {
            let e = grades.three_way.errors(Range::Near);
            let background = [e.background_static.epe_m, e.background_dynamic.epe_m];
            let foreground = [e.foreground_static.epe_m, e.foreground_dynamic.epe_m];
            match (kind, rest) {
                ("class", ["BACKGROUND"]) => background.to_vec(),
                ("class", _) => foreground.to_vec(),
                _ => vec![(background[0] + foreground[0]) / 2.0, foreground[1]],
            }
        }
        _ => panic!("{words:?}"),
    }
}

fn accuracy(grades: &Grades, group: &str, ego: &str) -> Vec<f64> {
    let table = match ego {
        "removed" => &grades.over_ground,
        _ => &grades.with_ego_motion,
    };
    let a = match group {
        "all" => table.accuracy(|_| true, PointMotion::Any),
        "moving" => table.accuracy(|_| true, PointMotion::Moving),
        class => table.accuracy(|c| c.class().is_some_and(|c| c.name() == class), PointMotion::Any),
    };
    vec![a.count as f64, a.epe_m, a.strict, a.relaxed, a.outliers, a.angle_rad]
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn equal_to_the_official_graders() {
    let data = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names the data's folder");
    let data = PathBuf::from(data).join("av2_log");
    let mut log = Log::open(&data, Some(&data.join("truth")), true).unwrap();
    assert_eq!(log.pairs().count(), 1);
    let pair = log.pair(0).unwrap();
    let graded = |frames: &[(&str, bool)]| {
        let mut grades = Grades::default();
        for &(name, ground) in frames {
            let rules = Rules { ground, ..Rules::OFFICIAL };
            grades.add(&pair, &estimate(name, &pair), &rules).unwrap();
        }
        grades
    };
    let mut at_hand = (String::new(), Grades::default());
    for line in include_str!("official.txt").lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let key = format!("{} {}", words[0], words[2]);
        if at_hand.0 != key {
            let frames = match words[0] {
                "both" => &[("zero", false), ("pattern", true)][..],
                name => &[(name, words[2] == "with")],
            };
            at_hand = (key, graded(frames));
        }
        let named = match words[1..] {
            ["accuracy", ..] => 5,
            [_, _, "bucket", ..] => 7,
            [_, _, "class", ..] => 5,
            _ => 4,
        };
        let (names, want) = words.split_at(named);
        same(line, want, &figures(&at_hand.1, &names[1..]));
    }
}
