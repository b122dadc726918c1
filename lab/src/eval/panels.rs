//! Pictures of a drive: its best and worst sweeps, and motion over ground beside motion as seen
//! from the vehicle (figures 3.10 to 3.12).

use super::collect::PairData;
use super::facts;
use super::objects::Present;
use super::row::Row;
use crate::report::{Column, Look, Outline, Panel, birds_eye};
use glam::DVec3;
use raywake_core::output::{ColumnFlow, FlowBasis};
use raywake_io::Error;
use raywake_io::sink::atomic;
use std::io::Write;
use std::path::Path;

/// A sweep with fewer labelled columns in view is not a candidate.
const LABELLED: usize = 30;
/// Errors beyond this make a sweep no worse, m.
const CLIP_M: f32 = 1.0;
/// Arrows show the path covered in this time, s.
const ARROW_S: f64 = 0.5;
/// How far a picture reaches from the vehicle, m.
const EXTENT_M: f64 = 40.0;
/// Error from which on columns get the colour of the worst, m.
const WORST_M: f64 = 0.6;
/// Observations below which a tracklet is not drawn, as in the author's viewer.
const AGE: u32 = 3;

/// A sweep worth a picture.
struct Candidate {
    /// Of all candidates for a picture the one with the highest merit is drawn.
    merit: f32,
    /// Mean error of the raw flow of labelled columns, m.
    mean_m: f32,
    seen: PairData,
    rows: Vec<Row>,
    outlines: Vec<Outline>,
}

/// The sweeps drawn: by the error of their raw flow, then those with most moving tracklets while
/// the vehicle is stationary (figure 3.10) and while it drives (figures 3.11 and 3.12).
const PICTURES: [&str; 4] = ["worst", "best", "busiest standing", "busiest driving"];
/// A vehicle slower than this is stationary, m/s: twice the speed that poses with an error of 1 cm
/// on every sweep give a stationary one.
const STATIONARY_MPS: f64 = 0.3;

/// The sweeps to be drawn, so far.
#[derive(Default)]
pub struct Panels([Option<Candidate>; PICTURES.len()]);

impl Panels {
    /// Considers a sweep.
    pub fn consider(&mut self, seen: &PairData, rows: &[Row], present: &[Present]) {
        let labelled = || rows.iter().filter(|r| r.in_view && r.class > 0);
        let count = labelled().count();
        if count < LABELLED {
            return;
        }
        let mean_m = labelled().map(|r| error_m(r).min(CLIP_M)).sum::<f32>() / count as f32;
        let moving = labelled().filter(|r| r.is_moving() && r.age >= AGE).count() as f32;
        let driven = seen.then.translation - seen.first.world_from_vehicle.translation;
        let stands = driven.length() < STATIONARY_MPS * seen.dt_s;
        let busy = |this: bool| if this { moving } else { f32::NEG_INFINITY };
        let merits = [mean_m, -mean_m, busy(stands), busy(!stands)];
        for (kept, merit) in self.0.iter_mut().zip(merits).filter(|m| m.1.is_finite()) {
            if kept.as_ref().is_none_or(|c| merit > c.merit) {
                let outlines = present.iter().map(outline).collect();
                let (seen, rows) = (seen.clone(), rows.to_vec());
                *kept = Some(Candidate { merit, mean_m, seen, rows, outlines });
            }
        }
    }

    /// Draws the sweeps into `folder`.
    pub fn write(
        self,
        folder: &Path,
        drive: &str,
        cell_m: f64,
    ) -> Result<Vec<facts::Panel>, Error> {
        let mut written = Vec::new();
        for (what, candidate) in PICTURES.iter().zip(self.0) {
            let Some(c) = candidate else { continue };
            let file = format!("{drive}-{}.png", what.replace(' ', "-"));
            let frame = c.seen.first.frame;
            let (panels, shows) = match *what {
                "busiest standing" => (
                    [c.raw(), c.tracklets(true)],
                    "Temporal scene flow while the vehicle is stationary, as in figure 3.10."
                        .to_string(),
                ),
                "busiest driving" => (
                    [c.tracklets(true), c.tracklets(false)],
                    "Temporal scene flow over ground, as in figure 3.11, and as seen from the \
                     moving vehicle, as in figure 3.12."
                        .to_string(),
                ),
                _ => (
                    [c.raw(), c.tracklets(true)],
                    format!(
                        "Mean error of the raw flow of labelled columns: {:.0} cm, errors clipped \
                         at {CLIP_M} m.",
                        100.0 * c.mean_m
                    ),
                ),
            };
            let look = Look {
                half_extent_m: EXTENT_M,
                cell_m,
                error: "error, m".into(),
                worst: WORST_M,
                arrows: format!("path in {ARROW_S} s"),
            };
            let png = birds_eye(&panels, &look)?;
            atomic::write(&folder.join(&file), |out| out.write_all(&png))?;
            let caption = format!("The {what} sweep of `{drive}`, frame {frame}. {shows}");
            written.push(facts::Panel { file, caption });
        }
        Ok(written)
    }
}

fn outline(present: &Present) -> Outline {
    let [length, width, _] = present.size;
    Outline { pose: present.vehicle_from_box, size: [length, width], kind: present.kind }
}

fn error_m(row: &Row) -> f32 {
    (row.flow_x - row.true_x).hypot(row.flow_y - row.true_y)
}

impl Candidate {
    fn panel(&self, title: &str, columns: Vec<Column>) -> Panel {
        Panel {
            title: title.into(),
            points: self.seen.first.points.iter().map(|p| p.position).collect(),
            outlines: self.outlines.clone(),
            columns,
        }
    }

    /// Raw flow, with the errors of labelled columns.
    fn raw(&self) -> Panel {
        let foreground = self.rows.iter().filter(|r| r.basis != FlowBasis::Background as u8);
        self.panel("raw flow over ground", foreground.map(|r| self.raw_column(r)).collect())
    }

    fn raw_column(&self, row: &Row) -> Column {
        let labelled = row.in_view && row.class > 0;
        let per_s = 1.0 / self.seen.dt_s;
        let arrow = |x: f32, y: f32| self.arrow([x, y].map(|v| f64::from(v) * per_s));
        Column {
            at: [row.x, row.y].map(f64::from),
            error: labelled.then(|| f64::from(error_m(row))),
            truth: labelled.then(|| arrow(row.true_x, row.true_y)),
            estimate: row.is_matched().then(|| arrow(row.flow_x, row.flow_y)),
        }
    }

    /// Tracklets, over ground or relative to the vehicle.
    fn tracklets(&self, over_ground: bool) -> Panel {
        let estimate = |c: &ColumnFlow| match over_ground {
            true => self.arrow(c.velocity_world_mps.map(f64::from)),
            false => c.velocity_ego_mps.map(|v| ARROW_S * f64::from(v)),
        };
        let old =
            self.seen.columns.iter().filter(|c| c.basis >= FlowBasis::Matched && c.age >= AGE);
        let columns = old.map(|c| Column {
            at: c.position_vehicle_m.map(f64::from),
            error: None,
            truth: None,
            estimate: Some(estimate(c)),
        });
        let title = if over_ground { "tracklets over ground" } else { "tracklets, vehicle frame" };
        self.panel(title, columns.collect())
    }

    /// A velocity over ground, m/s, as an arrow along the vehicle's axes.
    fn arrow(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let along = self.seen.now().rotation.conjugate() * DVec3::new(x, y, 0.0);
        [along.x * ARROW_S, along.y * ARROW_S]
    }
}
