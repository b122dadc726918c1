//! One drive: the pipeline on one thread, rows and pictures on another.

use super::collect::{Collector, PairData};
use super::exact::Exact;
use super::facts::{Facts, Panel};
use super::moving::{ReturnCounts, ReturnVerdicts, Semantic};
use super::objects::Objects;
use super::pair_by_pair::PairByPair;
use super::panels::Panels;
use super::points::{PointScores, Points};
use super::row::Row;
use super::rows_file;
use crate::labels::{self, Labels, View};
use raywake::args::BackendChoice;
use raywake::batch::DEMO_DIGEST;
use raywake::engine::{self, RunPlan};
use raywake::error::RunError;
use raywake::inventory::inventory;
use raywake::outputs::RunFiles;
use raywake::weight_files::WeightFiles;
use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_io::Error;
use raywake_io::source::{self, OpenOptions, Source};
use serde_json::json;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

/// Pairs that may wait for their rows: the pipeline waits if rows take longer.
const WAITING: usize = 2;

/// Version of the meaning of rows and facts: those of another version are redone. Raise it with
/// every such change.
const ROWS: u32 = 5;

/// Settings shared by all drives of an evaluation.
#[derive(Clone)]
pub struct Settings {
    /// Checked.
    pub profile: Profile,
    /// Read and checked.
    pub weights: WeightFiles,
    /// Digest of the weights' text.
    pub weights_digest: String,
    /// Where the heavy half runs.
    pub backend: BackendChoice,
    /// How recordings are opened.
    pub open: OpenOptions,
    /// How far boxes are extended beyond their sides, m.
    pub margin_m: f64,
    /// Maximum number of sweeps per drive.
    pub sweeps: usize,
    /// Whether to also time the pipeline without its filter.
    pub all_columns: bool,
    /// Whether the pipeline keeps its history from one pair to the next.
    pub history: bool,
}

impl Settings {
    /// A run that writes nothing.
    fn plan(&self, sweeps: usize, weights: WeightFiles) -> RunPlan<'_> {
        RunPlan {
            profile: self.profile.clone(),
            weights,
            backend: &self.backend,
            sweeps: 0..sweeps,
            files: RunFiles::default(),
            summary: None,
            quiet: true,
        }
    }

    /// Everything that decides the rows of a drive. Of the drive itself: its files, its poses,
    /// stamps and rig, which also depend on how it is opened, and its labels.
    fn key(&self, files: &str, source: &dyn Source, labels: &Labels) -> serde_json::Value {
        let moments =
            (0..source.len()).map(|i| (source.frame(i), source.stamp_s(i), source.pose(i)));
        let drive = format!("{:?}{:?}{labels:?}", source.rig(), moments.collect::<Vec<_>>());
        json!({
            "rows": ROWS,
            "algorithms": format!("{DEMO_DIGEST:016x}"),
            "profile": format!("{:?}", self.profile),
            "weights": self.weights_digest,
            "backend": format!("{:?}", self.backend.backend),
            "margin_m": self.margin_m,
            "all_columns": self.all_columns,
            "history": self.history,
            "sweeps": self.sweeps.min(source.len()),
            "drive": format!("{:016x}", Digest::of(drive.as_bytes())),
            "files": files,
            "trusted": source.overview().trusted,
        })
    }
}

/// Total time of every pair with every solid column as foreground, ms.
fn unfiltered(source: &mut dyn Source, settings: &Settings) -> Result<Vec<f64>, RunError> {
    let mut totals = Vec::new();
    let sweeps = settings.sweeps.min(source.len());
    let plan = settings.plan(sweeps, settings.weights.clone().without_filter());
    let summary = engine::execute(&plan, source, &mut |_, pair| {
        totals.push(pair.laps.stages().map(|s| s.1).sum());
    })?;
    if summary.facts.interrupted {
        Err(Error::Usage("interrupted".into()).into())
    } else {
        Ok(totals)
    }
}

/// Files of a drive's results.
pub struct Files {
    /// Rows.
    pub rows: PathBuf,
    /// Facts, written last.
    pub facts: PathBuf,
    /// Folder of pictures.
    pub panels: PathBuf,
}

impl Files {
    /// Files of a drive in a folder of results.
    pub fn of(out: &Path, drive: &str) -> Files {
        Files {
            rows: out.join("rows").join(format!("{drive}.parquet")),
            facts: out.join("drives").join(format!("{drive}.json")),
            panels: out.join("panels"),
        }
    }

    /// Removes facts and rows of an earlier run.
    fn forget(&self) -> Result<(), Error> {
        for file in [&self.facts, &self.rows] {
            match std::fs::remove_file(file) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::writing(file)(e)),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Evaluates the drive at `path` unless that was done with the same settings. Returns its facts and
/// whether they existed already.
pub fn evaluate(
    path: &Path,
    name: &str,
    settings: &Settings,
    out: &Path,
) -> Result<(Facts, bool), RunError> {
    let begin = Instant::now();
    let mut source = source::open(path, &settings.open)?;
    if !source.is_located() {
        let what = "labels are placed by poses: `raywake odometry` computes them, for --poses FILE";
        return Err(Error::input(path, "", what).into());
    }
    let files = Files::of(out, name);
    let semantic = Semantic::of(path, source.as_ref());
    let labels = labels(path, source.as_ref(), semantic.is_some())?;
    let key = settings.key(&inventory(path)?, source.as_ref(), &labels);
    if files.rows.is_file()
        && let Ok(facts) = Facts::read(&files.facts)
        && facts.settings == key
    {
        return Ok((facts, true));
    }
    // Rows of other settings must not pass for those of the existing facts.
    files.forget()?;
    let objects = Objects::new(&labels, source.as_ref());
    let mut facts = known(name, key, source.as_ref(), &labels);
    let judges = Judges::new(path, source.as_ref(), settings, &labels, &objects, semantic)?;
    let sweeps = settings.sweeps.min(source.len());
    if settings.history {
        run(source.as_mut(), sweeps, settings, &files, judges, &mut facts)?;
    } else {
        let mut pairs = PairByPair::of(source.as_mut(), sweeps);
        let sweeps = pairs.len();
        run(&mut pairs, sweeps, settings, &files, judges, &mut facts)?;
    }
    if settings.all_columns {
        facts.unfiltered = unfiltered(source.as_mut(), settings)?;
    }
    facts.seconds = begin.elapsed().as_secs_f64();
    facts.write(&files.facts)?;
    Ok((facts, false))
}

/// What is known about a drive before it is run.
fn known(name: &str, key: serde_json::Value, source: &dyn Source, labels: &Labels) -> Facts {
    Facts {
        drive: name.to_string(),
        settings: key,
        view: view(labels.view).into(),
        exact: labels.exact,
        tracks: labels.tracks.len(),
        boxes: labels.tracks.iter().map(|t| t.boxes.len()).sum(),
        notes: [source.notes(), &labels.notes].concat(),
        ..Facts::default()
    }
}

/// Boxes of the drive; there may be none if its returns are labelled.
fn labels(path: &Path, source: &dyn Source, semantic: bool) -> Result<Labels, Error> {
    match labels::find(path, source)? {
        None if semantic => Ok(Labels::none()),
        Some(labels) => Ok(labels),
        None => labels::open(path, source),
    }
}

fn view(view: View) -> &'static str {
    match view {
        View::All => "all round",
        View::Camera => "the front camera's view",
        View::Nowhere => "",
    }
}

/// Everything that judges the pairs of one drive.
struct Judges<'a> {
    collector: Collector<'a>,
    points: Points,
    returns: ReturnVerdicts,
    exact: Option<Exact>,
    panels: Panels,
}

impl<'a> Judges<'a> {
    fn new(
        path: &Path,
        source: &dyn Source,
        settings: &Settings,
        labels: &Labels,
        objects: &'a Objects,
        semantic: Option<Semantic>,
    ) -> Result<Judges<'a>, Error> {
        let (profile, view, margin_m) = (&settings.profile, labels.view, settings.margin_m);
        let tables = settings.weights.tables(profile)?;
        let (rig, start) = (source.rig().clone(), source.pose(0));
        Ok(Judges {
            points: Points::new(view, rig.ground_m, margin_m, profile.voxel_m),
            collector: Collector::new(profile.clone(), rig, start, tables, objects, view, margin_m),
            returns: ReturnVerdicts::new(view, margin_m, semantic),
            exact: Exact::of(path),
            panels: Panels::default(),
        })
    }

    /// The rows of a pair.
    fn pair(&mut self, seen: &PairData) -> Result<Vec<Row>, Error> {
        let present = self.collector.present(seen);
        let exact = self.exact.as_ref().map(|e| e.returns(&seen.first)).transpose()?;
        self.points.pair(seen, present, exact.as_deref())?;
        let rows = self.collector.rows(seen, exact.as_deref());
        let reported = self.collector.returns_reported_moving(seen);
        let mover_m = |at| self.collector.mover_m(seen, at);
        self.returns.pair(seen, present, exact.as_deref(), &reported, mover_m)?;
        self.panels.consider(seen, &rows, present);
        Ok(rows)
    }
}

/// Runs the pipeline here and makes rows on a thread of their own.
fn run(
    source: &mut dyn Source,
    sweeps: usize,
    settings: &Settings,
    files: &Files,
    judges: Judges,
    facts: &mut Facts,
) -> Result<(), RunError> {
    let plan = settings.plan(sweeps, settings.weights.clone());
    let (send, receive) = sync_channel(WAITING);
    let (drive, history) = (facts.drive.clone(), settings.history);
    let (summary, written) = std::thread::scope(|scope| {
        let rows = scope.spawn(move || collect(&drive, judges, &receive, files));
        let summary = engine::execute(&plan, source, &mut |_, pair| {
            facts.pair(pair.first.points.len(), pair.laps);
            // Fails if the other thread has failed; that thread reports why.
            let index = if history { pair.index } else { PairByPair::sweep(pair.index) };
            let _ = send.send(Some(PairData { index, ..PairData::of(pair) }));
        });
        if summary.as_ref().is_ok_and(|s| !s.facts.interrupted) {
            let _ = send.send(None);
        }
        drop(send);
        (summary, rows.join().expect("the thread that makes rows panicked"))
    });
    let summary = summary?;
    if summary.facts.interrupted {
        return Err(Error::Usage("interrupted".into()).into());
    }
    let collected = written?;
    (facts.scores, facts.returns) = (collected.scores, collected.returns);
    facts.panels = collected.panels;
    facts.sweeps = summary.sweeps;
    facts.pairs = summary.pairs;
    facts.digest = summary.digest;
    if history {
        let resets = summary.resets.iter().skip(1);
        facts.notes.extend(resets.map(|r| format!("frame {}: {}", r.frame, r.text)));
    }
    let dropped = summary.dropped.to_string();
    facts.notes.push(format!("dropped by the pipeline: {dropped}"));
    Ok(())
}

/// Collects rows and scores of all pairs as they arrive; `None` marks the end. Without it no file
/// of rows is written.
fn collect(
    drive: &str,
    mut judges: Judges,
    pairs: &Receiver<Option<PairData>>,
    files: &Files,
) -> Result<Collected, Error> {
    rows_file::write(&files.rows, drive, || match pairs.recv() {
        Ok(Some(seen)) => judges.pair(&seen).map(Some),
        Ok(None) => Ok(None),
        Err(_) => Err(Error::Usage("interrupted".into())),
    })?;
    let panels = judges.panels.write(&files.panels, drive, judges.collector.cell_m())?;
    Ok(Collected { scores: judges.points.scores, returns: judges.returns.counts, panels })
}

/// What the thread that makes rows returns.
struct Collected {
    scores: [PointScores; 3],
    returns: ReturnCounts,
    panels: Vec<Panel>,
}
