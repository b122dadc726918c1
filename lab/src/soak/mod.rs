//! `raywake-lab soak`: sweeps in a loop for hours, with faults between clean stretches.
//!
//! Every round has a stretch for each fault, which strikes in its middle, each followed by a clean
//! stretch, which begins with the clock set back. The digest of a clean stretch must be that of a
//! pipeline that has seen nothing else; memory must not grow once all of it has been in use.

mod device;
mod fault;
mod findings;
mod memory;
mod stretch;
#[cfg(test)]
mod tests;

use clap::ValueEnum;
use device::PipelineConfig;
use fault::{Fault, GAP};
use findings::{Findings, PERIODS};
use raywake::args::FlowChoice;
use raywake::config;
use raywake::console::{interrupted, listen};
use raywake::drive::Drive;
use raywake::error::RunError;
use raywake::latency::Latencies;
use raywake::team;
use raywake::weight_files::WeightFiles;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, Source, SweepData, open};
use raywake_sim::Rng;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;
use stretch::Stretches;

/// Options of `soak`.
#[derive(clap::Args)]
pub struct Args {
    /// Recording with poses, in any format that `raywake run` reads [default: a simulated street]
    #[arg(value_name = "DATA")]
    data: Option<PathBuf>,
    /// Duration
    #[arg(long, value_name = "HOURS", required_unless_present = "sweeps")]
    hours: Option<f64>,
    /// Number of sweeps, if reached earlier
    #[arg(long, value_name = "COUNT")]
    sweeps: Option<u64>,
    /// Sweeps of a stretch
    #[arg(short = 'n', value_name = "COUNT", default_value = "40")]
    #[arg(value_parser = clap::value_parser!(u16).range(3 * GAP as i64..))]
    stretch: u16,
    /// A folder on a full or nearly full disk: results are written there, too
    #[arg(long, value_name = "DIR")]
    full_disk: Option<PathBuf>,
    /// The layer that makes calls fail, as built by cargo: the device is lost every thousandth
    /// sweep
    #[arg(long, value_name = "LIBRARY")]
    faulty_layer: Option<PathBuf>,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    flow: FlowChoice,
}

/// Runs, reports, and fails if anything was not as it must be.
///
/// # Errors
/// Any error of a step, at once; at the end if digests differ or memory grew.
pub fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    if let Some(layer) = args.faulty_layer.as_ref().filter(|_| !device::is_under_layer()) {
        return device::under_layer(layer, &args.out);
    }
    team::lead(team::available(), || soak(args))
}

fn soak(args: &Args) -> Result<(), Box<dyn Error>> {
    listen();
    let mut source = source(args)?;
    let mut soak = Soak::new(args, source.as_mut())?;
    println!("{}, {} of its sweeps", source.describe(), soak.stretches.sweeps.len());
    soak.run()?;
    let subject = format!("{}, {}", source.describe(), soak.drive.backend().device());
    let (hours, findings) = (soak.hours(), &soak.findings);
    findings.report(&subject, hours, &args.out)?.print(&args.out);
    if args.faulty_layer.is_some() && findings.devices_failed == 0 {
        return Err("too short: no device was lost".into());
    }
    findings.verdict().map_or(Ok(()), |what| Err(what.into()))
}

fn source(args: &Args) -> Result<Box<dyn Source>, raywake_io::Error> {
    match &args.data {
        Some(data) => open(data, &OpenOptions { trusted: true, ..OpenOptions::default() }),
        None => Ok(Box::new(Simulated::new(1, usize::from(args.stretch)))),
    }
}

/// A soak under way.
struct Soak<'a> {
    args: &'a Args,
    stretches: Stretches,
    config: PipelineConfig<'a>,
    drive: Drive,
    findings: Findings,
    began: Instant,
    /// The part of the time it is in.
    period: usize,
}

impl<'a> Soak<'a> {
    fn new(args: &'a Args, source: &mut dyn Source) -> Result<Soak<'a>, RunError> {
        let profile = config::profile(&args.flow.profile)?;
        let weights = WeightFiles::read(&args.flow.learned, &profile)?;
        let mut stretches = Stretches {
            overview: source.overview().clone(),
            sweeps: sweeps(source, args.stretch.into())?,
            full_disk: args.full_disk.clone(),
            rng: Rng::new(1),
            sides: stretch::sides(&profile),
            profile: profile.clone(),
        };
        let rig = source.rig().clone();
        let config = PipelineConfig { backend: &args.flow.backend, weights, profile, rig };
        // From a separate pipeline, on the CPU.
        let expected = stretches.run(&mut config.scalar()?, None, &mut Latencies::default())?;
        let (drive, began) = (config.drive()?, Instant::now());
        let findings = Findings::new(expected.digest);
        Ok(Soak { args, stretches, config, drive, findings, began, period: 0 })
    }

    /// Runs rounds of all faults until the time is over or a signal arrives.
    fn run(&mut self) -> Result<(), RunError> {
        let met = |fault: &Fault| *fault != Fault::FullDisk || self.args.full_disk.is_some();
        let faults: Vec<Fault> = Fault::value_variants().iter().copied().filter(met).collect();
        let mut rounds = 0;
        while self.part() < 1.0 && !interrupted() {
            for fault in &faults {
                self.stretch(Some(*fault))?;
                let clean = self.stretch(None)?;
                self.findings.count(*fault, &clean);
            }
            rounds += 1;
            self.findings.record_memory(self.period, rounds);
            let now = ((self.part() * PERIODS as f64) as usize).min(PERIODS - 1);
            if now > self.period || self.part() >= 1.0 {
                println!("{}", self.findings.line(self.period));
                self.period = now;
            }
        }
        Ok(())
    }

    /// Runs one stretch; if the device fails in it, replaces it afterwards.
    fn stretch(&mut self, fault: Option<Fault>) -> Result<stretch::StretchEnd, RunError> {
        let period = &mut self.findings.periods[self.period];
        let end = self.stretches.run(&mut self.drive, fault, &mut period.times)?;
        period.sweeps += end.sweeps;
        if end.failed_over {
            self.findings.devices_failed += 1;
            self.drive = self.config.drive()?;
        }
        Ok(end)
    }

    fn hours(&self) -> f64 {
        self.began.elapsed().as_secs_f64() / 3600.0
    }

    /// The completed part of it, 0 to 1.
    fn part(&self) -> f64 {
        let of_time = self.args.hours.map_or(0.0, |hours| self.hours() / hours);
        let done = self.findings.sweeps() as f64;
        let of_sweeps = self.args.sweeps.map_or(0.0, |count| done / count as f64);
        of_time.max(of_sweeps)
    }
}

fn sweeps(source: &mut dyn Source, wanted: usize) -> Result<Vec<SweepData>, RunError> {
    if !source.is_located() || source.len() < wanted {
        let what = format!("{}: {wanted} sweeps with poses are needed", source.name());
        return Err(raywake_io::Error::Usage(what).into());
    }
    let read = |index| {
        let mut sweep = SweepData::default();
        source.read(index, &mut sweep).map(|()| sweep)
    };
    Ok((0..wanted).map(read).collect::<Result<_, _>>()?)
}
