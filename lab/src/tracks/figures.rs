//! Figures 2.1 and 2.5 to 2.9 of the dissertation.

use super::errors::Alignment;
use super::evaluate::{MAIN, Method, OURS, Score, methods, track};
use super::object::{Moment, Object, moment_at};
use super::tables::Set;
use super::tracker::{Track, baseline};
use crate::report::{Axis, Chart, Cloud, Lines, Picture, Plot, Series, clouds};
use glam::DVec3;
use raywake_io::Error;
use raywake_objects::centroid_ekf::CentroidParams;
use raywake_objects::estimate::{Cost, Estimator};
use raywake_sim::Rng;

/// Maximum number of returns of a cloud that are drawn.
const DRAWN: usize = 40_000;

/// Figure 2.5: cost, and mean distance of a return from its model point, after each iteration on
/// the simulated sets.
pub fn convergence(sets: &[Set]) -> Chart {
    let part = |title: &str, y: &str, of: std::ops::Range<usize>, value: fn(&Cost) -> f64| {
        let mut lines = Lines::new(Axis::new("iteration"), Axis::new(y));
        lines.log_y = true;
        for set in sets.iter().filter(|s| s.id == "stationary" || s.id == "moving") {
            for n in of.clone() {
                let scores: Vec<&Score> = set.outcomes.iter().map(|o| &o.scores[n]).collect();
                let (name, points) = (methods()[n].0, means(&scores, value));
                if !points.is_empty() {
                    lines.series.push(Series::line(&format!("{name}, {}", set.name), points));
                }
            }
        }
        (title.to_string(), Plot::Lines(lines))
    };
    let parts = vec![
        part("cost, as printed", "mean J", 1..OURS, Cost::total),
        part("distance, as printed", "mean distance, m", 1..OURS, |c| c.residual_m),
        part("cost, ours", "mean J", OURS..MAIN, Cost::total),
        part("distance, ours", "mean distance, m", OURS..MAIN, |c| c.residual_m),
    ];
    let caption = "As figure 2.5: cost J, and mean distance of a return from its model point, \
        after each iteration; mean over tracks, where those that have ended keep their last value.";
    Chart::small_multiples("figure-2-5", caption, parts)
}

/// Means over tracks after each iteration.
fn means(scores: &[&Score], value: fn(&Cost) -> f64) -> Vec<[f64; 2]> {
    let most = scores.iter().map(|s| s.costs.len()).max().unwrap_or(0);
    let after = |i: usize| {
        let of = |s: &&Score| s.costs.get(i).or(s.costs.last()).map_or(0.0, value);
        [i as f64, scores.iter().map(of).sum::<f64>() / scores.len() as f64]
    };
    (0..most).map(after).collect()
}

/// The trackers drawn: the baseline, as printed, ours.
fn drawn(object: &Object, estimator: &mut Estimator) -> [(&'static str, Track); 3] {
    let methods: [(&str, Method); 3] = [0, 1, OURS].map(|n| methods()[n]);
    let history = baseline(object, &CentroidParams::DEFAULT);
    methods.map(|(name, method)| (name, track(object, &history, &method, estimator).track))
}

type Quantity = fn(&Moment) -> f64;

/// Figure 2.7: speed and heading of an object.
pub fn profile(object: &Object, estimator: &mut Estimator) -> Chart {
    let kind = format!("{:?}", object.kind).to_lowercase();
    let mut parts = Vec::new();
    let tracks = drawn(object, estimator);
    let really: Vec<Moment> =
        tracks[0].1.moments.iter().map(|m| moment_at(&object.truth, m.time_s)).collect();
    let speed = |m: &Moment| m.velocity.truncate().length();
    let quantities: [(&str, Quantity); 2] =
        [("speed, m/s", speed), ("heading, rad", |m| m.heading)];
    for (label, value) in quantities {
        let mut lines = Lines::new(Axis::new("time, s"), Axis::new(label));
        let mut add = |name: &str, moments: &[Moment]| {
            let points = moments.iter().map(|m| [m.time_s, value(m)]).collect();
            lines.series.push(Series::line(name, points));
        };
        add("truth", &really);
        for (name, track) in &tracks {
            let alignment = Alignment::fit(&track.moments, &object.truth);
            let mut moments: Vec<Moment> =
                track.moments.iter().map(|m| alignment.apply(m)).collect();
            // Whole revolutions are irrelevant.
            let turns = really[0].heading - moments[0].heading;
            let turns = (turns / std::f64::consts::TAU).round() * std::f64::consts::TAU;
            moments.iter_mut().for_each(|m| m.heading += turns);
            add(name, &moments);
        }
        parts.push((label.to_string(), Plot::Lines(lines)));
    }
    let caption = format!(
        "As figure 2.7: profiles of a {kind} ({}), at the same point of the body.",
        object.name
    );
    Chart::small_multiples("figure-2-7", &caption, parts)
}

/// Figures 2.1, 2.6, 2.8 and 2.9: the cloud of an object by each tracker and by its true motion.
///
/// Fails if a picture cannot be drawn.
pub fn cloud(id: &str, object: &Object, estimator: &mut Estimator) -> Result<Picture, Error> {
    let really = Track::of(object, |t| moment_at(&object.truth, t));
    let tracks = drawn(object, estimator).into_iter().chain([("truth", really)]);
    let order = order(object.returns.len());
    let span_s = object.span_s();
    let mut panels = Vec::new();
    for (name, track) in tracks {
        let alignment = Alignment::fit(&track.moments, &object.truth);
        let to_true_frame = |&n: &usize| {
            let at = DVec3::from_array(track.cloud[n].map(f64::from));
            alignment.to_true_frame(at).as_vec3().to_array()
        };
        let time = |&n: &usize| (f64::from(object.returns[n].time_s) / span_s) as f32;
        panels.push(Cloud {
            title: name.into(),
            points: order.iter().map(to_true_frame).collect(),
            times: order.iter().map(time).collect(),
        });
    }
    let kind = format!("{:?}", object.kind).to_lowercase();
    let standing = if object.stationary { "parked " } else { "" };
    let caption = format!(
        "A {standing}{kind} ({}, {} returns in {span_s:.1} s).",
        object.name,
        object.returns.len()
    );
    let reach = object.size.map(|side| 1.3 * side + 0.3);
    Ok(Picture { id: id.into(), caption, png: clouds(&panels, reach)? })
}

/// Returns in drawing order, which is random: in order of time the last would hide the first.
fn order(count: usize) -> Vec<usize> {
    let mut rng = Rng::new(1);
    let mut order: Vec<usize> = (0..count).collect();
    for n in 0..count.min(DRAWN) {
        order.swap(n, n + (rng.unit() * (count - n) as f64) as usize);
    }
    order.truncate(DRAWN);
    order
}
