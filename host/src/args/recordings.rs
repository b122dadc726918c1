//! One recording, or many distributed over machines.

use std::path::{Path, PathBuf};

use raywake_io::Error;

#[derive(Clone, Debug, Default, clap::Args)]
pub struct Recordings {
    /// Recording: an MCAP or pcap file, or a folder: KITTI, Argoverse 2, nuScenes, Waymo or clouds
    #[arg(required_unless_present = "list")]
    pub data: Option<PathBuf>,
    /// Process every recording of a list, one path per line; results of PATH go to DIR/PATH.
    /// Results already finished with the same settings, weights and files are kept
    #[arg(long, value_name = "FILE", conflicts_with = "data", requires = "out")]
    #[arg(help_heading = "Many recordings")]
    pub list: Option<PathBuf>,
    /// Process only every N-th recording of the list, from the I-th on (0 to N-1) [default: taken
    /// from Slurm's array or step, or from JOB_COMPLETION_INDEX of Kubernetes and RAYWAKE_SHARDS]
    #[arg(long, value_name = "I/N", requires = "list", value_parser = Shard::parse)]
    #[arg(help_heading = "Many recordings")]
    pub shard: Option<Shard>,
}

impl Recordings {
    /// A single recording.
    pub fn one(data: PathBuf) -> Recordings {
        Recordings { data: Some(data), ..Recordings::default() }
    }

    /// The single recording; empty if there is a list instead.
    pub fn path(&self) -> &Path {
        self.data.as_deref().unwrap_or(Path::new(""))
    }
}

/// A part of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: usize,
    /// Number of parts, at least one.
    pub of: usize,
}

/// Names of the environment variables by which a scheduler assigns a process its part.
struct Scheduler {
    /// Set if there are parts.
    shared: &'static str,
    /// Number of this part.
    index: &'static str,
    /// Number of the first part; 0 if none.
    first: Option<&'static str>,
    /// Step from one number to the next; 1 if none.
    step: Option<&'static str>,
    /// Number of parts.
    count: &'static str,
}

/// In order of preference: array tasks come before the processes of a task.
const SCHEDULERS: [Scheduler; 3] = [
    Scheduler {
        shared: "SLURM_ARRAY_TASK_ID",
        index: "SLURM_ARRAY_TASK_ID",
        first: Some("SLURM_ARRAY_TASK_MIN"),
        step: Some("SLURM_ARRAY_TASK_STEP"),
        count: "SLURM_ARRAY_TASK_COUNT",
    },
    // Not `SLURM_NTASKS`: a batch script has that too, but runs once.
    Scheduler {
        shared: "SLURM_STEP_NUM_TASKS",
        index: "SLURM_PROCID",
        first: None,
        step: None,
        count: "SLURM_STEP_NUM_TASKS",
    },
    Scheduler {
        shared: "JOB_COMPLETION_INDEX",
        index: "JOB_COMPLETION_INDEX",
        first: None,
        step: None,
        count: "RAYWAKE_SHARDS",
    },
];

impl Shard {
    /// Parses `I/N`.
    pub fn parse(text: &str) -> Result<Shard, String> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let (index, of) = numbers.ok_or("expected I/N, for example 0/16")?;
        Shard::new(index, of).ok_or_else(|| format!("I of {text} must be 0 to N-1"))
    }

    fn new(index: usize, of: usize) -> Option<Shard> {
        (index < of).then_some(Shard { index, of })
    }

    /// The part assigned by a scheduler through environment variables; the whole if there is none.
    ///
    /// # Errors
    /// The variables are missing or inconsistent.
    pub fn of_environment() -> Result<Shard, Error> {
        Shard::of_scheduler(|name| std::env::var(name).ok()).map_err(Error::Usage)
    }

    fn of_scheduler(variable: impl Fn(&str) -> Option<String>) -> Result<Shard, String> {
        let scheduler = SCHEDULERS.iter().find(|of| variable(of.shared).is_some());
        scheduler.map_or(Ok(Shard { index: 0, of: 1 }), |scheduler| scheduler.shard(&variable))
    }
}

impl Scheduler {
    fn shard(&self, variable: &impl Fn(&str) -> Option<String>) -> Result<Shard, String> {
        let number = |name: &str| {
            let text = variable(name).ok_or_else(|| format!("{name} is not set"))?;
            text.parse().map_err(|_| format!("{name} is `{text}`"))
        };
        let or = |name: Option<&str>, unless: usize| name.map_or(Ok(unless), number);
        let read = || {
            let index: usize = number(self.index)?;
            Ok((index, or(self.first, 0)?, or(self.step, 1)?, number(self.count)?))
        };
        let wrong = |what: String| format!("{} is set, but {what}: use --shard I/N", self.shared);
        let (index, first, step, of): (usize, usize, usize, usize) = read().map_err(wrong)?;
        let ahead = index.checked_sub(first).and_then(|ahead| ahead.checked_div(step));
        let shard = ahead.and_then(|ahead| Shard::new(ahead, of));
        shard.ok_or_else(|| wrong(format!("it is {index} of {of}, from {first}, step {step}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shard(variables: &[(&str, &str)]) -> Result<(usize, usize), String> {
        let of = |name: &str| variables.iter().find(|v| v.0 == name).map(|v| v.1.to_string());
        Shard::of_scheduler(of).map(|shard| (shard.index, shard.of))
    }

    #[test]
    fn of_the_command_line() {
        let parse = |text: &str| Shard::parse(text).map(|s| (s.index, s.of));
        assert_eq!((parse("0/1"), parse("15/16")), (Ok((0, 1)), Ok((15, 16))));
        for wrong in ["1/1", "0/0", "3", "-1/2", "a/2", "1/b", "1/2/3", ""] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn of_schedulers() {
        assert_eq!(shard(&[]), Ok((0, 1)));
        let array = |id, min, step, count| {
            shard(&[
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_STEP", step),
                ("SLURM_ARRAY_TASK_COUNT", count),
                ("SLURM_PROCID", "0"),
                ("SLURM_STEP_NUM_TASKS", "1"),
            ])
        };
        assert_eq!(array("7", "1", "2", "4"), Ok((3, 4)));
        assert_eq!(array("0", "0", "1", "8"), Ok((0, 8)));
        assert!(array("9", "0", "1", "8").unwrap_err().contains("9 of 8"));
        assert!(array("0", "1", "1", "8").is_err() && array("1", "0", "0", "8").is_err());
        assert!(array("x", "0", "1", "8").unwrap_err().contains("is `x`"));
        let process = ("SLURM_PROCID", "2");
        assert_eq!(shard(&[process, ("SLURM_STEP_NUM_TASKS", "4")]), Ok((2, 4)));
        assert!(shard(&[("SLURM_STEP_NUM_TASKS", "4")]).unwrap_err().contains("PROCID is not set"));
        // A batch script for four tasks, which it starts itself.
        assert_eq!(shard(&[("SLURM_PROCID", "0"), ("SLURM_NTASKS", "4")]), Ok((0, 1)));
        let index = ("JOB_COMPLETION_INDEX", "5");
        assert_eq!(shard(&[index, ("RAYWAKE_SHARDS", "6")]), Ok((5, 6)));
        assert!(shard(&[index]).unwrap_err().contains("RAYWAKE_SHARDS is not set"));
    }
}
