//! Runs of the program `raywake`, and their summaries.

use raywake_io::Error;
use raywake_io::source::whole;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// A build of the program, and the data it runs on.
pub struct ProgramBuild<'a> {
    /// The executable.
    pub path: &'a Path,
    /// Recording.
    pub data: &'a Path,
    /// Sweeps of a run.
    pub sweeps: u32,
    /// Folder its summary goes to.
    pub out: &'a Path,
}

/// Outcome of a run.
pub struct ProgramRun {
    /// Its summary.
    pub summary: Value,
    /// CPU time, s.
    pub cpu_s: f64,
    /// Time from its start to its end, s.
    pub wall_s: f64,
    file: PathBuf,
}

/// The program in the same folder as this one.
pub fn sibling_program() -> PathBuf {
    std::env::current_exe().map_or_else(|_| "raywake".into(), |own| own.with_file_name("raywake"))
}

impl ProgramBuild<'_> {
    /// Runs it once, with `before` in front of it on its command line. A shell in between reports
    /// the CPU time, by the POSIX `times`.
    ///
    /// # Errors
    /// If it cannot be run, fails, or writes an invalid summary.
    pub fn run(&self, before: &[&str], arguments: &[&str]) -> Result<ProgramRun, Error> {
        let failed = |what: String| Error::Usage(format!("{}: {what}", self.path.display()));
        let file = self.out.join("summary.json");
        let begin = Instant::now();
        let mut shell = Command::new("sh");
        shell.args(["-c", "\"$@\" && times", "sh"]).args(before).arg(self.path).arg("run");
        shell.arg(self.data).args(["--quiet", "-n", &self.sweeps.to_string(), "--summary"]);
        let done = shell.arg(&file).args(arguments).output();
        let done = done.map_err(|e| failed(format!("cannot be run: {e}")))?;
        let wall_s = begin.elapsed().as_secs_f64();
        if !done.status.success() {
            return Err(failed(String::from_utf8_lossy(&done.stderr).trim().to_owned()));
        }
        let times = String::from_utf8_lossy(&done.stdout).into_owned();
        let cpu_s = cpu_s(&times)
            .ok_or_else(|| failed(format!("unexpected output of `times`: {times}")))?;
        let summary = serde_json::from_str(&whole::read_text(&file)?)
            .map_err(|e| Error::input(&file, format!("line {}", e.line()), e.to_string()))?;
        Ok(ProgramRun { summary, cpu_s, wall_s, file })
    }
}

impl ProgramRun {
    /// A figure of the time of a sweep, ms: `median`, `mean`, `p99`.
    ///
    /// # Errors
    /// If there was no pair of sweeps.
    pub fn total_ms(&self, figure: &str) -> Result<f64, Error> {
        let none = || Error::input(&self.file, "", "no pair of sweeps, so no times");
        self.summary["total_ms"][figure].as_f64().ok_or_else(none)
    }

    /// Median time of a stage, ms; 0 if sweeps do not have that stage.
    pub fn stage_ms(&self, name: &str) -> f64 {
        self.summary["stage_ms"][name]["median"].as_f64().unwrap_or_default()
    }

    /// Median times of all stages, ms, by name.
    pub fn stages_ms(&self) -> impl Iterator<Item = (&str, f64)> {
        let stages = self.summary["stage_ms"].as_object().into_iter().flatten();
        stages.filter_map(|(name, of)| Some((name.as_str(), of["median"].as_f64()?)))
    }

    /// A string of the summary, empty if missing.
    pub fn text(&self, name: &str) -> &str {
        self.get(name).unwrap_or_default()
    }

    /// A string of the summary.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.summary[name].as_str()
    }
}

/// CPU time of a shell's children, s: the second line of `times`, user and system, like `0m1.25s`.
fn cpu_s(times: &str) -> Option<f64> {
    let seconds = |word: &str| {
        let (minutes, seconds) = word.strip_suffix('s')?.split_once('m')?;
        Some(60.0 * minutes.parse::<f64>().ok()? + seconds.parse::<f64>().ok()?)
    };
    let children = times.lines().last()?;
    children.split_whitespace().map(seconds).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_shell() {
        assert_eq!(cpu_s("0m0.00s 0m0.01s\n1m2.50s 0m0.25s\n"), Some(62.75));
        assert_eq!(cpu_s("nothing"), None);
    }
}
