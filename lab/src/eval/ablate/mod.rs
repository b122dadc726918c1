//! `raywake-lab ablate`: what every choice in a profile is worth, in one table.

mod table;
mod variants;

use super::drive::Settings;
use super::moving::ColumnVerdicts;
use super::tally::Tally;
use super::{Inputs, all, failures, names, read_rows};
use crate::report::{self, Report, Results};
use clap::builder::PossibleValuesParser;
use raywake::args::Learned;
use raywake::console::interrupted;
use raywake::weight_files::WeightFiles;
use raywake_io::Error;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use variants::{AUTHOR, BASE, VARIANTS, Variant, WeightSource};

/// `raywake-lab ablate`.
#[derive(clap::Args)]
pub struct Args {
    /// Labelled drives: simulated, KITTI or Argoverse 2
    #[arg(required = true, value_name = "DRIVE")]
    drives: Vec<PathBuf>,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    inputs: Inputs,
    /// Evaluate only these variants, in the order of the table
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    #[arg(value_parser = PossibleValuesParser::new(table::names()))]
    only: Vec<String>,
}

/// Evaluates every variant, then writes and prints the table. Variants that fail are named at the
/// end; the others are in the table.
pub fn run(args: &Args) -> Result<(), Error> {
    let base = args.inputs.settings()?;
    let names = names(&args.drives)?;
    let (mut rows, mut failed) = (Vec::new(), Vec::new());
    let wanted = |v: &&Variant| args.only.is_empty() || args.only.iter().any(|n| n == v.name);
    for variant in VARIANTS.iter().filter(wanted) {
        eprintln!("{}: {}", variant.name, variant.what);
        let name = if variant.is_base(&base.profile) { BASE } else { variant.name };
        let out = args.out.join(name);
        let row =
            settings(variant, &base).and_then(|settings| row(variant, &settings, &names, &out));
        match row {
            Ok(row) => rows.push(row),
            Err(e) if interrupted() => return Err(e),
            Err(e) => {
                eprintln!("{}: failed: {e}", variant.name);
                rows.push(table::failed(variant));
                failed.push((variant.name.to_string(), e));
            }
        }
    }
    let why: Vec<String> = failed.iter().map(|(name, e)| format!("`{name}`: {e}")).collect();
    let table = table::table(rows, &why);
    write(&base, &names, table, &args.out)?.print(&args.out);
    failures("variants", &failed)
}

/// The base with a variant's change applied.
fn settings(variant: &Variant, base: &Settings) -> Result<Settings, Error> {
    let profile = variant.profile(&base.profile);
    profile.check().map_err(|e| Error::Usage(format!("{} must be {}", e.field, e.requirement)))?;
    let weights = match variant.numbers {
        WeightSource::Base => base.weights.clone(),
        WeightSource::NoFilter => base.weights.clone().without_filter(),
        WeightSource::NoEncoder => base.weights.clone().without_encoder(),
        WeightSource::Author => base.weights.clone().with_constancy(AUTHOR),
        WeightSource::AsPrinted => WeightFiles::read(&Learned::default(), &profile)?,
        WeightSource::AsPrintedAuthor => {
            WeightFiles::read(&Learned::default(), &profile)?.with_constancy(AUTHOR)
        }
    };
    Ok(Settings { weights_digest: weights.digest(), weights, profile, ..base.clone() })
}

/// Evaluates a variant into a folder of its own and reads its rows.
fn row(
    variant: &Variant,
    settings: &Settings,
    names: &BTreeMap<String, PathBuf>,
    out: &Path,
) -> Result<report::TableRow, Error> {
    let (done, failed) = all(names, settings, out, 1)?;
    failures("drives", &failed)?;
    let (mut tally, mut verdicts) = (Tally::new(), ColumnVerdicts::default());
    read_rows(&done, out, |facts, row| {
        tally.row(row);
        verdicts.row(row, facts.exact);
    })?;
    Ok(table::row(variant, &settings.profile, (&tally, &verdicts), &done))
}

fn write(
    base: &Settings,
    names: &BTreeMap<String, PathBuf>,
    table: report::Table,
    out: &Path,
) -> Result<Results, Error> {
    let mut report = Report::new("Ablations", "What each choice is worth");
    report.fact("Base", &base.profile.name);
    report.fact("Weights", &base.weights_digest);
    report.fact("Backend", &format!("{:?}", base.backend.backend).to_lowercase());
    report.fact("Drives", &names.keys().cloned().collect::<Vec<_>>().join(", "));
    report.section("Variants").table(table);
    report.write(out)
}
