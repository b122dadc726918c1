//! `raywake demo`: a small simulated drive, and the error of its flow.

use std::collections::HashMap;
use std::path::Path;

use raywake_core::output::PairFlows;
use raywake_core::output::{ColumnFlow, FlowBasis};
use raywake_core::params::Profile;
use raywake_sim::Truth;

use crate::args::{DemoArgs, Learned};
use crate::console::say;
use crate::engine::{self, RunPlan};
use crate::error::RunError;
use crate::order_statistics::Spread;
use crate::outputs::{Kinds, RunFiles};
use crate::picture::PictureFiles;
use crate::summary::RunSummary;
use crate::weight_files::WeightFiles;
use raywake_io::sink::streams::StreamTargets;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{Source, SweepData};

/// Minimum observations of a tracklet for its velocity to be compared with the truth.
const AGE: u32 = 5;
/// Objects slower than this do not count as moving, m/s.
const MOVING_MPS: f32 = 1.0;

/// Runs on the simulated drive, writes flow and pictures, prints the accuracy.
pub fn demo(args: &DemoArgs) -> Result<RunSummary, RunError> {
    let profile = Profile::hdl64();
    let mut source = Simulated::demo();
    let plan = RunPlan {
        weights: WeightFiles::read(&Learned::default(), &profile)?,
        backend: &args.backend,
        sweeps: 0..source.len(),
        files: files(&args.out),
        summary: None,
        quiet: args.quiet,
        profile,
    };
    let mut errors = SpeedErrors::default();
    let voxel_m = plan.profile.voxel_m;
    let summary = engine::execute(&plan, &mut source, &mut |source, pair| {
        let truth = VelocityField::new(source, pair.first, source.truth(pair.index), voxel_m);
        errors.add(&truth, pair.flows);
    })?;
    say(args.quiet, &errors.line())?;
    let page = if cfg!(feature = "png") { "; open demo.html in a browser" } else { "" };
    say(args.quiet, &format!("results in {}{page}\n", args.out.display()))?;
    Ok(summary)
}

/// Everything this build can write.
fn files(out: &Path) -> RunFiles {
    let png = |name: &str| cfg!(feature = "png").then(|| out.join(name));
    RunFiles {
        root: Some(out.to_path_buf()),
        kinds: Kinds { columns: cfg!(feature = "arrow"), ..Kinds::default() },
        streams: StreamTargets {
            mcap: cfg!(feature = "mcap").then(|| out.join("demo.mcap")),
            ..StreamTargets::default()
        },
        pictures: PictureFiles { folder: png("png"), film: None, page: png("demo.html") },
    }
}

/// True velocities of moving objects by world cell.
struct VelocityField {
    sums: HashMap<[i64; 2], ([f32; 2], f32)>,
    cell_m: f64,
}

impl VelocityField {
    /// Creates the field from the returns of a sweep, each placed by the vehicle's pose at its
    /// time.
    fn new(source: &Simulated, sweep: &SweepData, truth: &[Truth], cell_m: f64) -> VelocityField {
        let mut field = VelocityField { sums: HashMap::new(), cell_m };
        for (point, truth) in sweep.points.iter().zip(truth) {
            let [x, y, _] = truth.velocity_world;
            if x.hypot(y) < MOVING_MPS {
                continue;
            }
            let at = source.drive().world_from_vehicle(sweep.stamp_s + f64::from(point.offset_s));
            let world = at.transform(glam::Vec3::from_array(point.position).as_dvec3());
            let (sum, count) = field.sums.entry(field.cell([world.x, world.y])).or_default();
            *sum = [sum[0] + x, sum[1] + y];
            *count += 1.0;
        }
        field
    }

    fn cell(&self, place: [f64; 2]) -> [i64; 2] {
        place.map(|v| (v / self.cell_m).floor() as i64)
    }

    /// Mean velocity of the moving returns in the cell of a column.
    fn at(&self, column: &ColumnFlow) -> Option<[f32; 2]> {
        let (sum, count) = self.sums.get(&self.cell(column.position_world_m))?;
        Some(sum.map(|v| v / count))
    }
}

/// Errors of velocities.
#[derive(Default)]
struct SpeedErrors {
    speed_mps: Vec<f64>,
    velocity_mps: Vec<f64>,
}

impl SpeedErrors {
    /// Adds matched columns of moving objects whose tracklet is old enough.
    fn add(&mut self, truth: &VelocityField, flows: &PairFlows) {
        let old = |c: &&ColumnFlow| c.basis == FlowBasis::Matched && c.age >= AGE;
        for column in flows.columns.iter().filter(old) {
            let Some([x, y]) = truth.at(column) else { continue };
            let [u, v] = column.velocity_world_mps;
            self.speed_mps.push(f64::from((u.hypot(v) - x.hypot(y)).abs()));
            self.velocity_mps.push(f64::from((u - x).hypot(v - y)));
        }
    }

    fn line(&self) -> String {
        match (Spread::of(&self.speed_mps), Spread::of(&self.velocity_mps)) {
            (Some(speed), Some(velocity)) => format!(
                "accuracy   median speed error {:.2} m/s, median velocity error {:.2} m/s over {} \
                 columns of moving objects seen at least {AGE} times\n",
                speed.median,
                velocity.median,
                self.speed_mps.len()
            ),
            _ => "accuracy   no column of a moving object was tracked long enough\n".into(),
        }
    }
}
