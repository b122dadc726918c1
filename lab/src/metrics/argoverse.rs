//! An Argoverse 2 log with its true scene flow, and estimates of it, in the files read by the
//! official grader: `FOLDER/LOG/NUMBER.feather`, one per pair of sweeps, one row per return of its
//! first sweep: `flow_tx_m flow_ty_m flow_tz_m` (m per pair, first sweep's vehicle frame, the
//! vehicle's motion removed), `is_valid`, and for the truth `classes_0` (-1 background).

use super::ground::Ground;
use super::{Category, Pair, Rules, TruePoint};
use glam::DVec3;
use raywake_io::Error;
use raywake_io::source::feather::FeatherTable;
use raywake_io::source::{self, Format, OpenOptions, Source, SweepData};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Columns of the flow.
const FLOW: [&str; 3] = ["flow_tx_m", "flow_ty_m", "flow_tz_m"];

/// A log and where its truth is.
pub struct Log {
    source: Box<dyn Source>,
    name: String,
    /// By the index of a pair's first sweep.
    truth: BTreeMap<usize, PathBuf>,
    /// `None` if returns from the ground are not to be distinguished.
    ground: Option<Ground>,
    /// Cached sweeps and their indices: consecutive pairs share one.
    sweeps: [(usize, SweepData); 2],
}

/// An estimate's flow, one row per return.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Motion over the pair, m, as in [`TruePoint::flow_m`].
    pub flow_m: Vec<[f32; 3]>,
    /// Whether the estimator vouches for it; the grader uses the flow either way.
    pub valid: Vec<bool>,
}

impl Log {
    /// Opens the log at `path` with the truth in `truth/LOG`, or if `truth` is `None` where the
    /// grader looks for it: in `SPLIT_sceneflow_feather` beside the folder `SPLIT` of the log. With
    /// `find_ground` the map is read, and returns from the ground are marked.
    ///
    /// Fails if `path` is not an Argoverse 2 log, or if truth or map are missing or damaged.
    pub fn open(path: &Path, truth: Option<&Path>, find_ground: bool) -> Result<Log, Error> {
        let (format, root) = source::recognise(path)?;
        if format != Format::Argoverse2 {
            return Err(Error::input(&root, "", "is not an Argoverse 2 log"));
        }
        let root = root.canonicalize().map_err(Error::reading(&root))?;
        let options = OpenOptions { format: Some(format), ..OpenOptions::default() };
        let source = source::open(&root, &options)?;
        let name = source.name().to_owned();
        let folder = match truth {
            Some(folder) => folder.join(&name),
            None => default_truth(&root)?,
        };
        let truth = by_sweep(&folder, source.as_ref())?;
        let ground = find_ground.then(|| Ground::read(&root)).transpose()?;
        let none = || (usize::MAX, SweepData::default());
        Ok(Log { source, name, truth, ground, sweeps: [none(), none()] })
    }

    /// Name of the log.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The first sweeps of all pairs with truth, ascending, and the files that hold it.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, &Path)> {
        self.truth.iter().map(|(&sweep, path)| (sweep, path.as_path()))
    }

    /// The files of an estimate of this log in `folder/LOG`, one for each of [`Log::pairs`]; files
    /// of other pairs are ignored. Fails if one is missing.
    pub fn estimates(&self, folder: &Path) -> Result<BTreeMap<usize, PathBuf>, Error> {
        let folder = folder.join(&self.name);
        let mut files = by_sweep(&folder, self.source.as_ref())?;
        files.retain(|sweep, _| self.truth.contains_key(sweep));
        if let Some((sweep, truth)) = self.pairs().find(|(sweep, _)| !files.contains_key(sweep)) {
            let stamp = self.source.frame(sweep);
            let what = format!("has no estimate of sweep {stamp}, but {} exists", truth.display());
            return Err(Error::input(&folder, "", what));
        }
        Ok(files)
    }

    /// Reads the pair whose first sweep is `sweep`, one of [`Log::pairs`].
    pub fn pair(&mut self, sweep: usize) -> Result<Pair, Error> {
        self.load(sweep)?;
        let [(_, first), (_, second)] = &self.sweeps;
        let path = &self.truth[&sweep];
        let table = FeatherTable::read(path, &[&FLOW[..], &["is_valid", "classes_0"]].concat())?;
        let flow = read_flow(&table)?;
        same_rows(path, flow.len(), first.points.len())?;
        let valid = table.booleans("is_valid")?;
        let classes = table.integers("classes_0")?;
        let mut points = Vec::with_capacity(flow.len());
        for (row, point) in first.points.iter().enumerate() {
            let category = Category::from_number(classes[row]).ok_or_else(|| {
                let what = format!("classes_0 {} is not in -1 to 29", classes[row]);
                Error::input(path, format!("row {row}"), what)
            })?;
            let city = first.world_from_vehicle.transform(position(point.position));
            points.push(TruePoint {
                position_m: point.position,
                flow_m: flow[row],
                category,
                valid: valid[row],
                ground: self.ground.as_ref().is_some_and(|ground| ground.holds(city)),
            });
        }
        let second_from_first = second.world_from_vehicle.inverse() * first.world_from_vehicle;
        Ok(Pair { points, second_from_first })
    }

    /// Loads sweeps `first` and the next; one shared with the previous pair is not read again.
    fn load(&mut self, first: usize) -> Result<(), Error> {
        if self.sweeps[1].0 == first {
            self.sweeps.swap(0, 1);
        }
        for (offset, (at, sweep)) in self.sweeps.iter_mut().enumerate() {
            if *at != first + offset {
                // Never keep a half-read sweep.
                *at = usize::MAX;
                self.source.read(first + offset, sweep)?;
                *at = first + offset;
            }
        }
        Ok(())
    }
}

impl Estimate {
    /// Number of returns of the pair that count but that the estimator does not vouch for.
    pub fn marked_invalid(&self, pair: &Pair, rules: &Rules) -> u64 {
        let counts = |&(row, _): &(usize, &bool)| pair.counts(&pair.points[row], rules).is_some();
        self.valid.iter().enumerate().filter(|(_, valid)| !**valid).filter(counts).count() as u64
    }
}

/// Reads an estimate of a pair, one row per return.
pub fn read_estimate(path: &Path, pair: &Pair) -> Result<Estimate, Error> {
    let table = FeatherTable::read(path, &[&FLOW[..], &["is_valid"]].concat())?;
    let (flow_m, valid) = (read_flow(&table)?, table.booleans("is_valid")?);
    same_rows(path, flow_m.len(), pair.points.len())?;
    Ok(Estimate { flow_m, valid })
}

fn position(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// The flow of every row in f32, the precision of the files.
fn read_flow(table: &FeatherTable) -> Result<Vec<[f32; 3]>, Error> {
    table.vectors(FLOW)
}

fn same_rows(path: &Path, found: usize, points: usize) -> Result<(), Error> {
    if found == points {
        return Ok(());
    }
    let what = format!("{found} rows, but the sweep has {points} returns");
    Err(Error::input(path, "", what))
}

/// Where the grader looks for truth by default.
fn default_truth(root: &Path) -> Result<PathBuf, Error> {
    let place = || {
        let (split, log) = (root.parent()?, root.file_name()?);
        let name = format!("{}_sceneflow_feather", split.file_name()?.to_str()?);
        Some(split.with_file_name(name).join(log))
    };
    place().ok_or_else(|| Error::Usage("give the folder of the truth with --truth".into()))
}

/// Files of flow in a folder by the index of their first sweep: by name if all names are stamps of
/// the log's sweeps, which allows for gaps, and otherwise in the order of the names, as in the
/// grader.
fn by_sweep(folder: &Path, source: &dyn Source) -> Result<BTreeMap<usize, PathBuf>, Error> {
    let files = numbered(folder)?;
    let index: BTreeMap<u64, usize> = (0..source.len()).map(|i| (source.frame(i), i)).collect();
    let stamped = files.iter().filter(|(number, _)| index.contains_key(number)).count();
    if stamped != 0 && stamped != files.len() {
        let what = "some names are stamps of the log's sweeps, others are not";
        return Err(Error::input(folder, "", what));
    }
    let sweep = |n: usize, number: u64| if stamped > 0 { index[&number] } else { n };
    let files: BTreeMap<usize, PathBuf> =
        files.into_iter().enumerate().map(|(n, (number, f))| (sweep(n, number), f)).collect();
    match files.last_key_value() {
        Some((&last, path)) if last + 1 >= source.len() => {
            let what = format!("holds flow from sweep {last}, which has no successor");
            Err(Error::input(path, "", what))
        }
        _ => Ok(files),
    }
}

/// Feather files whose names consist of digits, in the order of the names.
fn numbered(folder: &Path) -> Result<Vec<(u64, PathBuf)>, Error> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::reading(folder))? {
        let path = entry.map_err(Error::reading(folder))?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let digits = stem.bytes().all(|b| b.is_ascii_digit());
        let number = stem.parse().ok().filter(|_| digits);
        if let Some(number) = number.filter(|_| path.extension().is_some_and(|e| e == "feather")) {
            files.push((number, path));
        }
    }
    files.sort_by(|a, b| a.1.cmp(&b.1));
    let numbers: BTreeSet<u64> = files.iter().map(|f| f.0).collect();
    if numbers.len() < files.len() {
        return Err(Error::input(folder, "", "two names denote the same number"));
    }
    if files.is_empty() {
        return Err(Error::input(folder, "", "no flow: no file NUMBER.feather"));
    }
    Ok(files)
}
