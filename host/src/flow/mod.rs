//! `raywake flow`: scene flow between two clouds, without poses.
//!
//! The second cloud is registered to the first, then both go through the pipeline as the two sweeps
//! of a drive whose world is the first cloud's frame.

pub mod motion;
pub mod place;
pub mod rows;

use std::path::{Path, PathBuf};

use raywake_core::output::{FlowBasis, PairFlows, PointFlow};
use raywake_core::params::Profile;
use raywake_core::perceive::StageTimer;
use raywake_core::sweep::Rig;

use crate::args::{self, PictureFrame};
use crate::choose;
use crate::config;
use crate::console::{note, say};
use crate::error::RunError;
use crate::laps::Laps;
use crate::picture::{self, Subject};
use crate::statistics::{Dropped, describe_reset};
use crate::weight_files::WeightFiles;
use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::streams::{Content, StreamTargets};
use raywake_io::source::{BinFields, SweepData, pose_row, read_cloud, read_pose};

use place::Unplaced;
use rows::{Form, PointRow};

/// Minimum speed over ground of a moving point, m/s.
const MOVING_MPS: f64 = 0.5;

/// Reads and registers the clouds, computes the flow and writes it.
pub fn flow(args: &args::FlowArgs) -> Result<(), RunError> {
    let form = Form::of(&args.out)?;
    let profile = config::profile(&args.flow.profile)?;
    let weights = WeightFiles::read(&args.flow.learned, &profile)?;
    let say = |text: &str| say(args.quiet, text);
    let beside = |file: &Option<PathBuf>| file.clone().unwrap_or(args.out.with_extension("png"));
    let png = args.png.as_ref().map(beside);
    let mut laps = Laps::start();

    let dt_s = args.dt.as_secs_f64();
    let first = cloud(&args.first, args.bin_fields.as_ref(), 0.0)?;
    let mut second = cloud(&args.second, args.bin_fields.as_ref(), dt_s)?;
    let (rig, place) = rig(args, &first)?;
    say(&place)?;
    laps.lap("read");

    let (motion, text) = match &args.pose {
        Some(path) => motion::given(read_pose(path)?),
        None => motion::find([&first.points, &second.points], &rig)
            .map_err(|why| Error::input(&args.second, "", why))?,
    };
    second.world_from_vehicle = motion;
    say(&text)?;
    laps.lap("registration");

    let (flows, dropped) =
        points(args, &profile, &weights, &rig, [&first, &second], png.as_deref())?;
    let second_from_first = motion.inverse();
    let rows: Vec<PointRow> = first
        .points
        .iter()
        .zip(&flows)
        .map(|(point, flow)| PointRow::new(point, flow, &second_from_first, dt_s))
        .collect();
    say(&census(&rows, dt_s, &dropped))?;
    laps.lap("flow");

    let meta = [
        ("dt_s", dt_s.to_string()),
        ("ground_m", rig.ground_m.to_string()),
        ("a_from_b", pose_row(&motion)),
    ];
    form.write(&args.out, &rows, &meta)?;
    laps.lap("write");
    let times: Vec<_> = laps.stages().map(|(name, ms)| format!("{name} {ms:.0} ms")).collect();
    Ok(say(&format!("times      {}\n", times.join(", ")))?)
}

fn title(args: &args::FlowArgs) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().display().to_string();
    format!("from {} to {}", name(&args.first), name(&args.second))
}

/// Reads a cloud as a sweep. Fails if no return has finite coordinates.
fn cloud(path: &Path, fields: Option<&BinFields>, stamp_s: f64) -> Result<SweepData, Error> {
    let mut sweep = SweepData { stamp_s, ..SweepData::default() };
    read_cloud(path, fields, &mut sweep.points)?;
    let there = |p: &[f32; 3]| p.iter().all(|v| v.is_finite());
    match sweep.points.iter().any(|p| there(&p.position)) {
        true => Ok(sweep),
        false => {
            let what = format!("none of its {} points has finite coordinates", sweep.points.len());
            Err(Error::input(path, "", what))
        }
    }
}

fn rig(args: &args::FlowArgs, first: &SweepData) -> Result<(Rig, String), Error> {
    place::rig(&first.points, args.ground, args.sensor).map_err(|e| match e {
        Unplaced::NoGround => {
            Error::input(&args.first, "", format!("{e}: set its height with --ground"))
        }
        Unplaced::Implausible(what) => Error::Usage(what),
    })
}

/// Flow of every point of the first sweep, including those over the pipeline's capacity, and what
/// the pipeline dropped from both.
fn points(
    args: &args::FlowArgs,
    profile: &Profile,
    weights: &WeightFiles,
    rig: &Rig,
    [first, second]: [&SweepData; 2],
    png: Option<&Path>,
) -> Result<(Vec<PointFlow>, Dropped), RunError> {
    let chosen = choose::drive(&args.flow.backend, weights, profile, rig)?;
    note(args.quiet, &chosen.note)?;
    let mut drive = chosen.drive;
    let mut returns = drive.step(&first.sweep(), &[])?.output.dropped;
    let stepped = drive.step(&second.sweep(), &first.points)?;
    returns += stepped.output.dropped;
    if let Some(reset) = stepped.output.reset {
        let [a, b] = [&args.first, &args.second].map(|path| path.display());
        return Err(RunError::Io(Error::Usage(format!(
            "{b} does not follow {a}: {}",
            describe_reset(reset).1
        ))));
    }
    if let Some(flows) = &stepped.output.flows {
        show(args, png, profile, first, flows)?;
    }
    let flows = stepped.output.flows.as_ref();
    let flows: Vec<PointFlow> = flows.map_or_else(Vec::new, |f| f.points.iter().collect());
    // A device that fails between the two sweeps leaves nothing to output.
    if let Some(failure) = drive.failure().filter(|_| flows.len() < first.points.len()) {
        return Err(RunError::Device(failure.clone()));
    }
    Ok((flows, Dropped { returns, ..Dropped::default() }))
}

/// Writes the picture and the messages asked for.
fn show(
    args: &args::FlowArgs,
    png: Option<&Path>,
    profile: &Profile,
    first: &SweepData,
    flows: &PairFlows,
) -> Result<(), Error> {
    if let Some(png) = png {
        let (columns, frame) = (flows.columns, PictureFrame::World);
        picture::write_one(png, first, &Subject::Flow { columns, profile, frame }, &title(args))?;
    }
    let streams = StreamTargets { mcap: args.mcap.clone(), ..StreamTargets::default() };
    let Some(mut bag) = BagSink::create(&streams, 0, Content::Flow)? else { return Ok(()) };
    bag.pair(first, flows)?;
    bag.finish()
}

/// Lines on what was found.
fn census(rows: &[PointRow], dt_s: f64, dropped: &Dropped) -> String {
    let count = |of: &dyn Fn(&PointRow) -> bool| rows.iter().filter(|row| of(row)).count();
    let moving =
        |row: &PointRow| f64::from(row.motion[0].hypot(row.motion[1])) >= MOVING_MPS * dt_s;
    format!(
        "flow       {} points: {} foreground, {} of them matched, {} moving at {MOVING_MPS} m/s or \
         more\ndropped    {dropped}\n",
        rows.len(),
        count(&|row| row.basis != FlowBasis::Background),
        count(&PointRow::valid),
        count(&moving),
    )
}
