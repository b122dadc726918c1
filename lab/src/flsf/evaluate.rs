//! `raywake-lab eval flsf`: table 4.2, figures 4.5 to 4.8, comparing occupancy constancy and
//! learned features by one protocol on the same drives.

use super::conclude::conclude;
use super::matching::{Constancy, Features};
use super::network::Flsf;
use super::outcome::{Compared, Outcome, walk};
use super::weights::TrainedWeights;
use crate::train::recorded::Recorded;
use raywake::args::Learned;
use raywake::weight_files::WeightFiles;
use raywake_core::params::Profile;
use raywake_io::Error;
use raywake_sim::Rng;
use std::path::PathBuf;

/// Options of `eval flsf`.
#[derive(clap::Args)]
pub struct Args {
    /// Labelled drives, recorded or simulated, that were not used to train the weights
    #[arg(value_name = "DRIVE", required = true)]
    drives: Vec<PathBuf>,
    /// Weights file written by `train flsf`
    #[arg(long, value_name = "FILE")]
    weights: PathBuf,
    /// Occupancy constancy to compare with [default: as trained by section 3.5.1]
    #[arg(long, value_name = "FILE")]
    constancy: Option<PathBuf>,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Stop after this many sweeps of every drive
    #[arg(short = 'n', value_name = "COUNT")]
    count: Option<usize>,
}

/// Pairs of cells, one per source, behind figure 4.8 (section 4.5.2).
const SOURCES: usize = 5000;

/// Evaluates, writes and prints.
pub fn run(args: &Args) -> Result<(), Error> {
    let profile = Profile::dissertation();
    let learned = Learned { constancy: args.constancy.clone(), ..Learned::default() };
    let tables = WeightFiles::read(&learned, &profile)?.tables(&profile)?;
    let trained = TrainedWeights::read(&args.weights, Flsf::new(false).numbers())?;
    let methods = (Constancy::new(tables), Features::new(trained.numbers));
    let mut outcome = Outcome::default();
    let mut rng = Rng::new(48);
    for path in &args.drives {
        let mut drive = Recorded::open(path)?;
        walk(&mut drive, args.count, &methods, &mut rng, &mut outcome)?;
        eprintln!("{}: {} pairs so far", path.display(), outcome.pairs);
    }
    thin(&mut outcome.compared, &mut rng);
    let names: Vec<_> = args.drives.iter().map(|d| d.display().to_string()).collect();
    let facts = [("Drives", names.join(", ")), ("Weights", trained.provenance)];
    conclude(&outcome, &facts, &args.out)?.print(&args.out);
    Ok(())
}

/// Keeps a uniform random sample of at most [`SOURCES`].
fn thin(compared: &mut Vec<Compared>, rng: &mut Rng) {
    for n in 0..SOURCES.min(compared.len()) {
        let other = n + rng.bits() as usize % (compared.len() - n);
        compared.swap(n, other);
    }
    compared.truncate(SOURCES);
}
