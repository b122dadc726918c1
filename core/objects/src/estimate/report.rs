//! How a solve went.

use super::ITERATIONS_MAX;

/// What the terms of the cost are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// `J_m`.
    pub model: f64,
    /// `J_u`.
    pub process: f64,
    /// `J_z`.
    pub returns: f64,
    /// Mean distance of a return from its model point, m.
    pub residual_m: f64,
}

impl Cost {
    /// Their sum.
    pub fn total(&self) -> f64 {
        self.model + self.process + self.returns
    }
}

/// Why a solve stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stop {
    /// No return is sound: there is no estimate.
    #[default]
    NoReturns,
    /// The cost fell no more.
    Converged,
    /// It made as many iterations as it may.
    Iterations,
    /// A step had no finite solution; the estimate is that before it.
    NotFinite,
}

/// Where a solve starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// The tracker's history.
    #[default]
    History,
    /// The steady motion that lays all returns over each other.
    Steady,
    /// Motion that is steady for a second at a time.
    Unsteady,
}

/// How a solve went.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Why it stopped.
    pub stop: Stop,
    /// Iterations that led to the estimate.
    pub iterations: usize,
    /// Cost at the start and after each of them.
    pub costs: heapless::Vec<Cost, { ITERATIONS_MAX + 1 }>,
    /// Returns that took part.
    pub returns: usize,
    /// Returns left out because there were more.
    pub thinned: usize,
    /// Returns left out because they or their times are no numbers, or beyond 100 km and a day.
    pub unsound: usize,
    /// Returns that took part, and lie further from the object's origin than the prior's `extent_m`.
    pub outside: usize,
    /// Model points that were taken away because rays went through them.
    pub carved: usize,
    /// The knots are nearer together than asked for: the track is short.
    pub compressed: bool,
    /// They are further apart: the track is long.
    pub stretched: bool,
    /// There was no history: the start stands at the returns' mean.
    pub no_history: bool,
    /// Which start led to it.
    pub from: Start,
}
