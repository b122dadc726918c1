//! Milliseconds per stage of one sweep, without allocation.

use std::time::Instant;

/// Time since a moment, ms.
pub fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Stages a sweep may have.
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

    /// Books the time since the last lap to `name`.
    pub fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        self.add(name, (now - self.last).as_secs_f64() * 1e3);
        self.last = now;
    }

    /// Books time measured elsewhere; names beyond the capacity share the last entry.
    pub fn add(&mut self, name: &'static str, milliseconds: f64) {
        let known = self.names[..self.count].iter().position(|n| *n == name);
        let at = known.unwrap_or(self.count.min(LAPS_MAX - 1));
        self.names[at] = name;
        self.milliseconds[at] += milliseconds;
        self.count = self.count.max(at + 1);
    }

    /// Books to `name` what has passed since the last lap beyond `booked` milliseconds.
    pub fn rest(&mut self, name: &'static str, booked: f64) {
        let now = Instant::now();
        self.add(name, ((now - self.last).as_secs_f64() * 1e3 - booked).max(0.0));
        self.last = now;
    }

    /// Names and milliseconds.
    pub fn stages(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.names[..self.count].iter().copied().zip(self.milliseconds)
    }
}
