//! `raywake clean`: a recording without what moves.
//!
//! The flow of every sweep is found twice, forwards and backwards in time, and a return moves where
//! either says so: forwards a mover that has just come into view is known too little, backwards it
//! has been seen for long.

mod backwards;
mod judged;
mod still_map;

use std::ops::Range;
use std::path::Path;

use raywake_core::params::Profile;
use raywake_core::pose::{Pose, Twist};
use raywake_core::return_clock::ReturnClock;
use raywake_core::sweep::{Point, Rig};

use crate::args;
use crate::choose;
use crate::config;
use crate::console::{interrupted, note, say};
use crate::error::RunError;
use crate::progress::Progress;
use crate::session::each_sweep;
use crate::weight_files::WeightFiles;
use backwards::Backwards;
use judged::{Judged, SweepJudged, file};
use raywake_io::sink::{atomic, clouds};
use raywake_io::source::{self, Source, SweepData};
use still_map::StillMap;

/// Reads a recording twice and writes it without what moves. Returns whether it got to the end.
pub fn clean(args: &args::CleanArgs) -> Result<bool, RunError> {
    let mut source = source::open(&args.data, &args.recording.options())?;
    let profile = config::profile(&args.flow.profile)?;
    for folder in ["labels", "static", "moving"] {
        atomic::create_folder(&args.out.join(folder))?;
    }
    let weights = WeightFiles::read(&args.flow.learned, &profile)?;
    let mut cleaning = Cleaning {
        args,
        profile,
        weights,
        seen: Vec::new(),
        map: StillMap::new(args.voxel),
        clock: ReturnClock::new(),
        counts: [0; 4],
    };
    say(args.quiet, &format!("{}\n", source.describe()))?;
    let sweeps = args.part.range(source.len())?;
    let done = cleaning.forwards(source.as_mut(), sweeps.clone())?
        && cleaning.backwards(source.as_mut(), sweeps)?;
    if done {
        let points = cleaning.map.points();
        clouds::write_ply(&args.out.join("map.ply"), ["x", "y", "z", "intensity"], &points)?;
        say(args.quiet, &cleaning.text(points.len()))?;
    }
    Ok(done)
}

/// A sweep that was seen forwards.
struct Seen {
    world_from_vehicle: Pose,
    twist: Twist,
    judged: SweepJudged,
}

struct Cleaning<'a> {
    args: &'a args::CleanArgs,
    profile: Profile,
    weights: WeightFiles,
    seen: Vec<Seen>,
    map: StillMap,
    clock: ReturnClock,
    /// Returns by what is known of them.
    counts: [u64; 4],
}

impl Cleaning<'_> {
    /// Finds poses and flow in the order of time.
    fn forwards(
        &mut self,
        source: &mut dyn Source,
        sweeps: Range<usize>,
    ) -> Result<bool, RunError> {
        let (args, backend) = (self.args, &self.args.flow.backend);
        let chosen = choose::drive(backend, &self.weights, &self.profile, source.rig())?;
        note(args.quiet, source.notes().iter().chain(&chosen.note))?;
        say(args.quiet, "forwards\n")?;
        let mut drive = chosen.drive;
        let seen = &mut self.seen;
        let end = each_sweep(source, sweeps, args.quiet, |_, visit| {
            let before = visit.before.map_or(&[][..], |before| &before.points);
            let flows = drive.step(&visit.now.sweep(), before)?.output.flows;
            if let Some((last, flows)) = seen.last_mut().zip(flows) {
                last.judged = SweepJudged::of(flows.points.iter());
            }
            let &SweepData { world_from_vehicle, twist, .. } = visit.now;
            seen.push(Seen { world_from_vehicle, twist, judged: SweepJudged::default() });
            Ok(())
        })?;
        Ok(!end.interrupted)
    }

    /// Finds the flow against the order of time, and writes what comes of both.
    fn backwards(
        &mut self,
        source: &mut dyn Source,
        sweeps: Range<usize>,
    ) -> Result<bool, RunError> {
        let turned = Backwards::new(source.rig());
        let backend = &self.args.flow.backend;
        let mut drive = choose::drive(backend, &self.weights, &self.profile, &turned.rig())?.drive;
        say(self.args.quiet, "backwards\n")?;
        let mut progress = Progress::new(sweeps.len(), self.args.quiet);
        let (mut now, mut later) = (SweepData::default(), SweepData::default());
        for (done, index) in sweeps.clone().rev().enumerate() {
            if interrupted() {
                return Ok(false);
            }
            source.read(index, &mut now)?;
            let seen = &self.seen[index - sweeps.start];
            (now.world_from_vehicle, now.twist) = (seen.world_from_vehicle, seen.twist);
            turned.turn(&mut now);
            let before = if done > 0 { &later.points[..] } else { &[] };
            let flows = drive.step(&now.sweep(), before)?.output.flows;
            if done > 0 {
                let judged = flows.map(|flows| SweepJudged::of(flows.points.iter()));
                self.write(&turned.rig(), index + 1 - sweeps.start, &later, judged)?;
            }
            std::mem::swap(&mut now, &mut later);
            progress.update(done + 1);
        }
        progress.finish();
        self.write(&turned.rig(), 0, &later, None)?;
        Ok(true)
    }

    /// Writes a sweep that was turned around.
    fn write(
        &mut self,
        rig: &Rig,
        number: usize,
        sweep: &SweepData,
        backwards: Option<SweepJudged>,
    ) -> Result<(), RunError> {
        let (root, frame, points) = (&self.args.out, sweep.frame, &sweep.points);
        let [forwards, backwards] =
            [std::mem::take(&mut self.seen[number].judged), backwards.unwrap_or_default()];
        let judged: Vec<Judged> =
            (0..points.len()).map(|n| forwards.get(n).max(backwards.get(n))).collect();
        let labels: Vec<u32> = judged.iter().map(|judged| judged.label()).collect();
        clouds::write_labels(&file(root, "labels", frame, "label"), &labels)?;
        self.write_clouds(root, sweep, &judged)?;
        for (point, &judged) in points.iter().zip(&judged) {
            self.counts[judged as usize] += 1;
            self.map.add(place(&self.clock, rig, sweep, point), point.intensity, judged);
        }
        Ok(())
    }

    fn write_clouds(
        &self,
        root: &Path,
        sweep: &SweepData,
        judged: &[Judged],
    ) -> Result<(), RunError> {
        let of = |moving: bool| {
            let all = sweep.points.iter().zip(judged);
            let kept = all.filter(move |(_, judged)| match judged {
                Judged::None => false,
                Judged::Unknown | Judged::Static => !moving,
                Judged::Moving => moving,
            });
            kept.map(|(point, _)| point)
        };
        clouds::write_bin(&file(root, "static", sweep.frame, "bin"), of(false))?;
        Ok(clouds::write_bin(&file(root, "moving", sweep.frame, "bin"), of(true))?)
    }

    fn text(&self, points: usize) -> String {
        let [none, unknown, still, moving] = self.counts;
        format!(
            "{} sweeps: {moving} returns move, {still} are static, {unknown} were not looked at \
             (outside the window), {none} are no surface; {points} voxels of {} m in map.ply\n",
            self.seen.len(),
            self.args.voxel
        )
    }
}

/// Where a return was in the world, m.
fn place(clock: &ReturnClock, rig: &Rig, sweep: &SweepData, point: &Point) -> glam::DVec3 {
    let at = glam::DVec3::from_array(point.position.map(f64::from));
    let offset_s = if rig.distorted { clock.offset_s(rig, point) } else { 0.0 };
    sweep.world_from_vehicle.transform(sweep.twist.over(offset_s).transform(at))
}
