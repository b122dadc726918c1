//! `raywake-lab eval clean`: the output of `raywake clean` for a recording, against its truth.
//!
//! Returns are counted as in the dynamic map benchmark (Zhang et al. 2023): the share of static
//! ones kept (SA), that of moving ones removed (DA), the geometric mean of both, and the IoU of
//! moving object segmentation.

use super::exact::Exact;
use super::moving::Semantic;
use raywake_io::Error;
use raywake_io::source::{OpenOptions, Source, SweepData, Unlocated, open};
use std::path::{Path, PathBuf};

/// Returns whose surface moves less than this in a tenth of a second are neither static nor moving,
/// unless they do not move at all, m.
const MOVING_M: f32 = 0.05;
/// Labels that `raywake clean` writes.
const MOVING: u32 = 251;
const UNLABELLED: u32 = 0;

/// Options of `eval clean`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Recording: a simulated drive, or one with SemanticKITTI's labels of moving classes.
    drive: PathBuf,
    /// What `raywake clean --out` wrote for it.
    cleaned: PathBuf,
}

/// Returns of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counted {
    all: u64,
    examined: u64,
    removed: u64,
}

/// Static and moving returns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Tally([Counted; 2]);

impl Tally {
    fn add(&mut self, moves: bool, label: u32) {
        let counted = &mut self.0[usize::from(moves)];
        counted.all += 1;
        counted.examined += u64::from(label != UNLABELLED);
        counted.removed += u64::from(label == MOVING);
    }

    /// Shares of examined returns: static kept, dynamic removed, IoU.
    fn shares(&self) -> [f64; 3] {
        let [still, moving] = self.0;
        let share = |part: u64, of: u64| part as f64 / of.max(1) as f64;
        [
            share(still.examined - still.removed, still.examined),
            share(moving.removed, moving.examined),
            share(moving.removed, moving.examined + still.removed),
        ]
    }

    fn text(&self) -> String {
        let [still, moving] = self.0;
        let [kept, removed, iou] = self.shares().map(|share| 100.0 * share);
        let mean = (kept * removed).sqrt();
        let all = 100.0 * moving.removed as f64 / moving.all.max(1) as f64;
        format!(
            "{} static and {} moving returns, {} and {} of them examined\n\
             static kept {kept:.2} %, dynamic removed {removed:.2} %, geometric mean {mean:.2} %, \
             IoU {iou:.2} %\nof all moving returns, removed: {all:.2} %\n",
            still.all, moving.all, still.examined, moving.examined
        )
    }
}

/// Compares and prints.
pub fn run(args: &Args) -> Result<(), Error> {
    print!("{}", tally(&args.drive, &args.cleaned)?.text());
    Ok(())
}

fn tally(drive: &Path, cleaned: &Path) -> Result<Tally, Error> {
    let options = OpenOptions { unlocated: Unlocated::Accept, ..OpenOptions::default() };
    let mut source = open(drive, &options)?;
    let truth = Truth::of(drive, source.as_ref())?;
    let (mut tally, mut sweep) = (Tally::default(), SweepData::default());
    for index in 0..source.len() {
        let path = cleaned.join(format!("labels/{:06}.label", source.frame(index)));
        if !path.is_file() {
            continue;
        }
        source.read(index, &mut sweep)?;
        let bytes = std::fs::read(&path).map_err(Error::reading(&path))?;
        let labels = bytes.as_chunks::<4>().0.iter().map(|l| u32::from_le_bytes(*l));
        if bytes.len() != 4 * sweep.points.len() {
            let what = format!("{} bytes for {} returns", bytes.len(), sweep.points.len());
            return Err(Error::input(&path, "", what));
        }
        for (moves, label) in truth.moves(&sweep)?.into_iter().zip(labels) {
            moves.into_iter().for_each(|moves| tally.add(moves, label));
        }
    }
    if tally == Tally::default() {
        return Err(Error::input(cleaned, "", "no labels of this recording's sweeps"));
    }
    Ok(tally)
}

/// Source of whether returns move.
enum Truth {
    Exact(Exact),
    Semantic(Semantic),
}

impl Truth {
    fn of(drive: &Path, source: &dyn Source) -> Result<Truth, Error> {
        let exact = Exact::of(drive).map(Truth::Exact);
        let labelled = || Semantic::of(drive, source).map(Truth::Semantic);
        let what = "neither a simulated drive nor one with SemanticKITTI's labels";
        exact.or_else(labelled).ok_or_else(|| Error::input(drive, "", what))
    }

    /// Whether each return moves; `None` if unknown.
    fn moves(&self, sweep: &SweepData) -> Result<Vec<Option<bool>>, Error> {
        Ok(match self {
            Truth::Exact(exact) => {
                let moves = |[x, y, z]: [f32; 3]| match x * x + y * y + z * z {
                    0.0 => Some(false),
                    square => (square >= MOVING_M * MOVING_M).then_some(true),
                };
                exact.returns(sweep)?.iter().map(|truth| moves(truth.flow)).collect()
            }
            Truth::Semantic(semantic) => {
                let told = |label: &crate::labels::semantic_kitti::PointLabel| {
                    (!label.is_unlabelled()).then(|| label.moving())
                };
                semantic.returns(sweep)?.iter().map(told).collect()
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;
    use crate::simulate::{Recipe, write};
    use clap::Parser;

    #[test]
    fn shares_of_counts() {
        let mut tally = Tally::default();
        for (moves, label, times) in
            [(false, 9, 90), (false, 251, 10), (false, 0, 50), (true, 251, 8), (true, 9, 2)]
        {
            (0..times).for_each(|_| tally.add(moves, label));
        }
        assert_eq!(tally.shares(), [0.9, 0.8, 0.4]);
        let text = tally.text();
        assert!(text.contains("150 static and 10 moving returns, 100 and 10"), "{text}");
        assert!(text.contains("geometric mean 84.85 %"), "{text}");
    }

    #[test]
    fn a_simulated_drive_is_cleaned() {
        let [scratch, results] = [Scratch::new(), Scratch::new()];
        let recipe = Recipe { sweeps: 12, seed: 21, sensor: "vlp32x2".into(), ..Recipe::default() };
        write(scratch.path(), &recipe, 1, 1, false).unwrap();
        let cleaned = results.path().to_path_buf();
        let line = ["raywake", "clean", "-q", "--backend", "scalar", "--out"].map(Into::into);
        let line = line.into_iter().chain([cleaned.clone().into(), scratch.path().into()]);
        let args = raywake::args::Args::parse_from::<_, std::ffi::OsString>(line);
        assert!(raywake::execute(args.command).unwrap());
        let tally = tally(scratch.path(), &cleaned).unwrap();
        let [kept, removed, _] = tally.shares();
        eprintln!("{tally:?}");
        assert!(kept > 0.99 && removed > 0.9, "{}", tally.text());
        // The clouds hold every surface, and the map is where the drive was.
        let size = |name: &str| -> u64 {
            let files = std::fs::read_dir(cleaned.join(name)).unwrap();
            files.map(|f| f.unwrap().metadata().unwrap().len()).sum()
        };
        let returns = size("labels") / 4;
        assert!(size("static") / 16 + size("moving") / 16 <= returns);
        assert!(size("static") / 16 > returns / 2 && size("moving") > 0);
        let mut map = Vec::new();
        raywake_io::source::read_cloud(&cleaned.join("map.ply"), None, &mut map).unwrap();
        assert!(map.len() > 5000, "{} voxels", map.len());
        let error = super::tally(scratch.path(), scratch.path()).unwrap_err().to_string();
        assert!(error.contains("no labels"), "{error}");
    }
}
