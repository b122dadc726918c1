//! `raywake-lab toy`: the dissertation's example of feature learning (section 4.3) on digits.
//!
//! An encoder maps a digit's picture to two numbers. It is trained twice: as half of an autoencoder
//! that should restore the picture (4.1), and with pairs of digits, equal ones close and different
//! ones apart (4.2). One linear layer then classifies the digits from those two numbers alone:
//! table 4.1, figures 4.2 and 4.3.

pub mod digits;
#[cfg(test)]
mod tests;
mod train;

use crate::report::{
    Axis, Cell, Chart, Lines, Plot, Report, Results, Series, Style, Table, TableRow,
};
use digits::{CLASSES, DigitSets, Digits};
use raywake_io::Error;
use std::path::PathBuf;
use train::{Objective, Training};

/// `raywake-lab toy`: report.html, table 4.1 and figures 4.2 and 4.3.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of MNIST's IDX files, gzipped or not; folder of 0.json to 9.json; or a .csv file of
    /// pixels from 0 to 16 and the digit
    #[arg(value_name = "DIGITS")]
    digits: PathBuf,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    training: Training,
}

/// Trains both ways, writes the report and prints it.
pub fn run(args: &Args) -> Result<(), Error> {
    let sets = digits::open(&args.digits, args.training.seed)?;
    let (both, seconds) = both(&sets, &args.training);
    let results = conclude(&sets, args, &both, seconds)?;
    results.print(&args.out);
    Ok(())
}

/// Outcome of training with an objective.
struct Learned {
    objective: Objective,
    /// Encodings of the test digits.
    encodings: Vec<[f32; 2]>,
    /// Share of test digits classified correctly, for each digit and for all.
    right: [f64; CLASSES + 1],
}

/// Trains with both objectives in parallel; also returns how long they took, s.
fn both(sets: &DigitSets, training: &Training) -> ([Learned; 2], f64) {
    let begin = std::time::Instant::now();
    let learned = |objective: Objective| {
        let encoder = training.encoder(objective, &sets.training);
        let classifier = training.classifier(&encoder.of(&sets.training), &sets.training.labels);
        let encodings = encoder.of(&sets.test);
        let right = shares(&sets.test, &classifier.classify(&encodings));
        Learned { objective, encodings, right }
    };
    let both = std::thread::scope(|scope| {
        let features = scope.spawn(|| learned(Objective::Features));
        [learned(Objective::Autoencoder), features.join().expect("a working thread panicked")]
    });
    (both, begin.elapsed().as_secs_f64())
}

/// Shares classified correctly.
fn shares(digits: &Digits, predicted: &[u8]) -> [f64; CLASSES + 1] {
    let right = |n: &usize| predicted[*n] == digits.labels[*n];
    let share = |all: &[usize]| all.iter().filter(|n| right(n)).count() as f64 / all.len() as f64;
    let by_class = digits.by_class();
    let all: Vec<usize> = (0..digits.count()).collect();
    std::array::from_fn(|n| share(by_class.get(n).unwrap_or(&all)))
}

/// Table 4.1 as published, per cent: autoencoder and features, by digit and for all.
const PUBLISHED: [[f64; 2]; CLASSES + 1] = [
    [87.7, 98.2],
    [97.7, 98.6],
    [80.8, 95.8],
    [74.1, 97.0],
    [39.3, 96.5],
    [1.9, 94.8],
    [52.8, 96.7],
    [58.3, 95.1],
    [47.3, 95.3],
    [40.7, 94.9],
    [59.3, 96.3],
];

fn conclude(
    sets: &DigitSets,
    args: &Args,
    both: &[Learned; 2],
    seconds: f64,
) -> Result<Results, Error> {
    let mut report = Report::new("Feature learning on digits", "Section 4.3 of the dissertation");
    report.fact("Digits", &sets.origin);
    report.fact("Training", &args.training.text());
    report.fact("Time", &format!("{seconds:.0} s for both, side by side"));
    let [autoencoder, features] = both.each_ref().map(|l| 100.0 * l.right[CLASSES]);
    report.headline(
        &format!("{features:.1} %"),
        "features",
        "of the test digits classified correctly",
    );
    report.headline(&format!("{autoencoder:.1} %"), "autoencoder", "with the same classifier");
    let section = report.section("Table 4.1");
    section.table(table(both));
    for (learned, id) in both.iter().zip(["figure-4-2", "figure-4-3"]) {
        let title = format!("Encodings of the test digits: {}", learned.objective);
        report.section(&title).chart(figure(id, learned, &sets.test));
    }
    report.write(&args.out)
}

fn table(both: &[Learned; 2]) -> Table {
    let rows = PUBLISHED.iter().enumerate().map(|(n, published)| {
        let digit = if n < CLASSES { n.to_string() } else { "all".into() };
        let ours = both.iter().map(|l| Cell::Number(100.0 * l.right[n], 1));
        let theirs = published.map(|v| Cell::Number(v, 1));
        TableRow::new([Cell::from(digit)].into_iter().chain(ours).chain(theirs))
    });
    let columns = ["digit", "autoencoder, %", "features, %"];
    let published = ["published: autoencoder, %", "published: features, %"];
    let columns: Vec<&str> = columns.into_iter().chain(published).collect();
    Table::new(
        "table-4-1",
        "Table 4.1: digits classified correctly from two numbers",
        &columns,
        rows.collect(),
    )
    .note("The dissertation trained with 60,000 digits and tested with 10,000.")
}

fn figure(id: &str, learned: &Learned, digits: &Digits) -> Chart {
    let mut plot = Lines::new(Axis::new("first number"), Axis::new("second number"));
    for (digit, indices) in digits.by_class().iter().enumerate() {
        let points = indices.iter().map(|n| learned.encodings[*n].map(f64::from)).collect();
        let name = digit.to_string();
        plot.series.push(Series { name, points, style: Style::Dots, marks: Vec::new() });
    }
    let caption = format!("One dot per test digit: {}", learned.objective);
    Chart::new(id, &caption, Plot::Lines(plot))
}
