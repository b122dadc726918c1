//! Findings over time, in memory that does not grow.

use super::fault::Fault;
use super::memory::resident_bytes;
use super::stretch::StretchEnd;
use crate::report::{Axis, Cell, Chart, Lines, Plot, Report, Results, Series, Table, TableRow};
use clap::ValueEnum;
use raywake::latency::Latencies;
use raywake_io::Error;
use std::path::Path;

/// Number of parts that the time is divided into.
pub const PERIODS: usize = 10;
/// Rounds after which most memory has been in use. Measured growth: 5.6 MiB in the second round,
/// 0.01 MiB in the next six.
const IN_USE: u32 = 3;
/// Allowed growth of memory after these, bytes. Measured: 0.02 MiB over 26,279 sweeps in stretches
/// of 100, 0 over two minutes with stretches of 30.
const GROWTH_MAX: i64 = 1 << 20;

/// A part of the time.
pub struct Period {
    /// Sweeps in it.
    pub sweeps: u64,
    /// Times of steps.
    pub times: Latencies,
    /// Memory at its end, bytes.
    pub resident: u64,
}

/// The findings of a soak.
pub struct Findings {
    /// Required digest of a stretch without a fault.
    pub expected: u64,
    /// In chronological order.
    pub periods: [Period; PERIODS],
    /// Stretches with each fault, and how many of the clean ones after them had the expected
    /// digest.
    pub of_fault: Vec<[u64; 2]>,
    /// Memory once all of it had been in use, bytes; 0 before that.
    pub start: u64,
    /// Devices that failed and were replaced by new ones.
    pub devices_failed: u64,
    /// Stretches in which a device failed, so that there is no digest to expect.
    pub not_compared: u64,
}

impl Findings {
    /// No findings yet.
    pub fn new(expected: u64) -> Findings {
        let period = || Period { sweeps: 0, times: Latencies::default(), resident: 0 };
        Findings {
            expected,
            periods: std::array::from_fn(|_| period()),
            of_fault: vec![[0; 2]; Fault::value_variants().len()],
            start: 0,
            devices_failed: 0,
            not_compared: 0,
        }
    }

    /// Counts a stretch with a fault and the clean one after it.
    pub fn count(&mut self, fault: Fault, clean: &StretchEnd) {
        let [stretches, as_expected] = &mut self.of_fault[fault as usize];
        *stretches += 1;
        self.not_compared += u64::from(clean.failed_over);
        *as_expected += u64::from(!clean.failed_over && clean.digest == self.expected);
    }

    /// Number of clean stretches with a different digest.
    fn wrong(&self) -> u64 {
        let others = self.of_fault.iter().map(|[stretches, as_expected]| stretches - as_expected);
        others.sum::<u64>() - self.not_compared
    }

    /// Records how much memory is in use, at the end of a round of all faults.
    pub fn record_memory(&mut self, period: usize, rounds: u32) {
        let resident = resident_bytes().unwrap_or(0);
        self.periods[period].resident = resident;
        if rounds == IN_USE {
            self.start = resident;
        }
    }

    /// Sweeps so far.
    pub fn sweeps(&self) -> u64 {
        self.periods.iter().map(|period| period.sweeps).sum()
    }

    /// Memory at the end minus that at the start, bytes.
    fn growth(&self) -> i64 {
        let last = self.periods.iter().rev().find(|period| period.resident > 0);
        let grown = |period: &Period| period.resident as i64 - self.start as i64;
        last.filter(|_| self.start > 0).map_or(0, grown)
    }

    /// What is wrong; `None` if nothing is.
    pub fn verdict(&self) -> Option<String> {
        // What a driver allocates for a new device is its own business: observed to grow by 6 MiB
        // and to shrink again.
        let grown = self.devices_failed == 0 && self.growth() > GROWTH_MAX;
        let wrong = self.wrong();
        let wrong = (wrong > 0).then(|| format!("{wrong} stretches differ"));
        let grown = grown.then(|| format!("memory grew by {}", mebibytes(self.growth())));
        let all: Vec<String> = wrong.into_iter().chain(grown).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// A human-readable line on a period.
    pub fn line(&self, period: usize) -> String {
        let Period { sweeps, times, resident } = &self.periods[period];
        let times = times.figures().map_or(String::new(), |f| f.line());
        let memory = mebibytes(*resident as i64);
        format!("{} of {PERIODS}: {sweeps} sweeps, {times}; {memory}", period + 1)
    }

    /// Writes the report.
    pub fn report(&self, subject: &str, hours: f64, out: &Path) -> Result<Results, Error> {
        let mut report =
            Report::new("Soak", "Sweeps in a loop, with faults between clean stretches");
        report
            .fact("Sweeps", subject)
            .fact("Expected digest", &format!("{:016x}", self.expected))
            .fact("Time", &format!("{hours:.2} h"));
        let figures = [
            (self.sweeps().to_string(), "sweeps".into(), String::new()),
            (
                self.wrong().to_string(),
                "clean stretches with a different digest".into(),
                "0".into(),
            ),
            (
                mebibytes(self.growth()),
                format!("memory growth since round {IN_USE}"),
                format!("at most {}", mebibytes(GROWTH_MAX)),
            ),
        ];
        for (value, label, wanted) in figures {
            report.headline(&value, &label, &wanted);
        }
        report.section("Faults").table(self.faults());
        report.section("Over time").table(self.over_time()).chart(self.memory());
        report.write(out)
    }

    fn faults(&self) -> Table {
        let row = |(fault, counts): (&Fault, &[u64; 2])| {
            let counts = counts.map(Cell::from);
            TableRow::new([Cell::from(fault.name())].into_iter().chain(counts))
        };
        let met = |(_, [stretches, _]): &(&Fault, &[u64; 2])| *stretches > 0;
        let rows =
            Fault::value_variants().iter().zip(&self.of_fault).filter(met).map(row).collect();
        let mut table = Table::new(
            "faults",
            "Stretches with a fault in the middle, and the clean ones after them",
            &["fault", "stretches", "then with the expected digest"],
            rows,
        );
        let (failed, not_compared) = (self.devices_failed, self.not_compared);
        table.notes.push(format!(
            "Devices that failed (scalar backend until the end of the stretch, then a new device): \
             {failed}; of these in clean stretches, and hence not compared: {not_compared}."
        ));
        table
    }

    fn over_time(&self) -> Table {
        let row = |(n, period): (usize, &Period)| {
            let f = period.times.figures();
            let times = [f.map(|f| f.median), f.map(|f| f.p99), f.map(|f| f.max)];
            let times = times.map(|ms| Cell::Number(ms.unwrap_or(f64::NAN), 1));
            let memory = Cell::Number(period.resident as f64 / MEBIBYTE, 2);
            let counts = [Cell::from(n + 1), Cell::from(period.sweeps)];
            TableRow::new(counts.into_iter().chain(times).chain([memory]))
        };
        let known = self.periods.iter().enumerate().filter(|(_, period)| period.sweeps > 0);
        let rows = known.map(row).collect();
        let columns = ["part", "sweeps", "median, ms", "p99, ms", "max, ms", "memory, MiB"];
        Table::new(
            "time",
            "Time of a step, and memory at the end of each tenth of the run",
            &columns,
            rows,
        )
    }

    fn memory(&self) -> Chart {
        let known = self.periods.iter().enumerate().filter(|(_, period)| period.resident > 0);
        let at =
            |(n, period): (usize, &Period)| [n as f64 + 1.0, period.resident as f64 / MEBIBYTE];
        let mut lines = Lines::new(Axis::new("tenth"), Axis::new("memory, MiB"));
        lines.series.push(Series::line("resident", known.map(at).collect()));
        Chart::new("memory", "Memory of the process.", Plot::Lines(lines))
    }
}

const MEBIBYTE: f64 = (1 << 20) as f64;

fn mebibytes(bytes: i64) -> String {
    format!("{:.2} MiB", bytes as f64 / MEBIBYTE)
}
