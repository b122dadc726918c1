//! Pictures of a drive's best and worst sweeps, and of motion in both frames (figures 3.10-3.12).

use super::collect::Seen;
use super::facts;
use super::objects::Present;
use super::row::Row;
use crate::labels::Kind;
use crate::report::{Column, Look, Outline, Panel, birds_eye};
use glam::DVec3;
use raywake::error::Error;
use raywake::sink::atomic;
use raywake_core::output::Origin;
use raywake_core::pose::Pose;
use std::io::Write;
use std::path::Path;

/// A sweep with fewer labelled columns in view is no candidate.
const LABELLED: usize = 30;
/// Errors beyond this do not make a sweep any worse, m.
const CLIP_M: f32 = 1.0;
/// Arrows are as long as the way in this time, s.
const ARROW_S: f64 = 0.5;
/// How far a picture reaches, m.
const EXTENT_M: f64 = 40.0;

/// A sweep worth a picture.
struct Candidate {
    mean_m: f32,
    seen: Seen,
    rows: Vec<Row>,
    outlines: Vec<Outline>,
}

/// The best and the worst sweep so far.
#[derive(Default)]
pub struct Panels {
    best: Option<Candidate>,
    worst: Option<Candidate>,
}

impl Panels {
    /// Considers a sweep.
    pub fn consider(&mut self, seen: Seen, rows: Vec<Row>, present: &[Present]) {
        let errors: Vec<f32> = rows
            .iter()
            .filter(|r| r.in_view && r.class > 0)
            .map(|r| (r.flow_x - r.true_x).hypot(r.flow_y - r.true_y).min(CLIP_M))
            .collect();
        if errors.len() < LABELLED {
            return;
        }
        let mean_m = errors.iter().sum::<f32>() / errors.len() as f32;
        let better = self.best.as_ref().is_none_or(|b| mean_m < b.mean_m);
        let worse = self.worst.as_ref().is_none_or(|w| mean_m > w.mean_m);
        if !better && !worse {
            return;
        }
        let outlines = present.iter().map(|p| Outline {
            pose: p.vehicle_from_box,
            size: [p.size[0], p.size[1]],
            kind: Kind::ALL[p.class as usize - 1],
        });
        let candidate = Candidate { mean_m, outlines: outlines.collect(), seen, rows };
        if better {
            self.best = Some(candidate);
        } else {
            self.worst = Some(candidate);
        }
    }

    /// Draws them into `folder`.
    pub fn write(
        self,
        folder: &Path,
        drive: &str,
        cell_m: f64,
    ) -> Result<Vec<facts::Panel>, Error> {
        let mut written = Vec::new();
        for (what, candidate) in [("worst", self.worst), ("best", self.best)] {
            let Some(c) = candidate else { continue };
            let file = format!("{drive}-{what}.png");
            let caption = format!(
                "The {what} sweep of `{drive}`, frame {}: mean error of the raw flow of labelled \
                 columns {:.0} cm. Left: over ground, with the error of labelled columns; right: \
                 the tracklets' velocities as the moving vehicle sees them.",
                c.seen.first.frame,
                100.0 * c.mean_m,
            );
            let png = c.picture(cell_m)?;
            atomic::write(&folder.join(&file), |out| out.write_all(&png))?;
            written.push(facts::Panel { file, caption });
        }
        Ok(written)
    }
}

impl Candidate {
    fn picture(&self, cell_m: f64) -> Result<Vec<u8>, Error> {
        let points: Vec<[f32; 3]> = self.seen.first.points.iter().map(|p| p.position).collect();
        let ground = Panel {
            title: "raw flow over ground".into(),
            points: points.clone(),
            outlines: self.outlines.clone(),
            columns: self
                .rows
                .iter()
                .filter(|r| r.origin != Origin::Background as u8)
                .map(|r| self.raw(r))
                .collect(),
        };
        let ego = Panel {
            title: "velocity of tracklets relative to the vehicle".into(),
            points,
            outlines: self.outlines.clone(),
            columns: self
                .seen
                .columns
                .iter()
                .filter(|c| c.origin == Origin::Matched)
                .map(|c| Column {
                    at: c.position_vehicle_m.map(f64::from),
                    error: None,
                    truth: None,
                    estimate: Some(c.velocity_ego_mps.map(|v| ARROW_S * f64::from(v))),
                })
                .collect(),
        };
        let look = Look {
            half_extent_m: EXTENT_M,
            cell_m,
            error: "error, m".into(),
            worst: 0.6,
            arrows: format!("way in {ARROW_S} s"),
        };
        birds_eye(&[ground, ego], &look)
    }

    /// A column with the arrows of its raw flow, along the vehicle's axes.
    fn raw(&self, row: &Row) -> Column {
        let now = self.seen.now();
        let scale = ARROW_S / self.seen.dt_s;
        let labelled = row.in_view && row.class > 0;
        let found = arrow(&now, row.flow_x, row.flow_y, scale);
        let truth = arrow(&now, row.true_x, row.true_y, scale);
        let error = f64::from((row.flow_x - row.true_x).hypot(row.flow_y - row.true_y));
        Column {
            at: [row.x, row.y].map(f64::from),
            error: labelled.then_some(error),
            truth: labelled.then_some(truth),
            estimate: (row.origin == Origin::Matched as u8).then_some(found),
        }
    }
}

/// A displacement over ground along the vehicle's axes.
fn arrow(world_from_vehicle: &Pose, x: f32, y: f32, scale: f64) -> [f64; 2] {
    let along = world_from_vehicle.rotation.conjugate() * DVec3::new(x.into(), y.into(), 0.0);
    [along.x * scale, along.y * scale]
}
