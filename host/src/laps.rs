//! Milliseconds per stage of one sweep, without allocation.

use std::time::Instant;

use raywake_core::perceive::StageTimer;

/// Time since an instant, ms.
pub fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Maximum number of stages of a sweep.
const LAPS_MAX: usize = 24;

/// Stage names and times in the order they first finished.
#[derive(Clone, Copy, Debug)]
pub struct Laps {
    last: Instant,
    names: [&'static str; LAPS_MAX],
    milliseconds: [f64; LAPS_MAX],
    count: usize,
}

impl Laps {
    /// Starts the clock.
    pub fn start() -> Laps {
        Laps {
            last: Instant::now(),
            names: [""; LAPS_MAX],
            milliseconds: [0.0; LAPS_MAX],
            count: 0,
        }
    }

    /// Stage names and milliseconds.
    pub fn stages(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.names[..self.count].iter().copied().zip(self.milliseconds)
    }

    /// Adds milliseconds to a stage; names beyond the capacity share the last entry.
    fn add(&mut self, name: &'static str, milliseconds: f64) {
        let known = self.names[..self.count].iter().position(|n| *n == name);
        let at = known.unwrap_or(self.count.min(LAPS_MAX - 1));
        self.names[at] = name;
        self.milliseconds[at] += milliseconds;
        self.count = self.count.max(at + 1);
    }

    /// Milliseconds since the last call.
    fn elapsed(&mut self) -> f64 {
        let now = Instant::now();
        let milliseconds = (now - self.last).as_secs_f64() * 1e3;
        self.last = now;
        milliseconds
    }
}

impl StageTimer for Laps {
    fn lap(&mut self, stage: &'static str) {
        let milliseconds = self.elapsed();
        self.add(stage, milliseconds);
    }

    fn measured(
        &mut self,
        stages: &mut dyn Iterator<Item = (&'static str, f64)>,
        rest: &'static str,
    ) {
        let mut left = self.elapsed();
        for (stage, milliseconds) in stages {
            self.add(stage, milliseconds);
            left -= milliseconds;
        }
        self.add(rest, left.max(0.0));
    }
}
