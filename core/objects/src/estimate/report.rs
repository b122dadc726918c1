//! How a solve went.

use super::ITERATIONS_MAX;

/// The terms of the cost.
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
    /// Sum of the terms.
    pub fn total(&self) -> f64 {
        self.model + self.process + self.returns
    }
}

/// Why a solve stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Termination {
    /// No return is sound: there is no estimate.
    #[default]
    NoReturns,
    /// The cost has converged.
    Converged,
    /// The iterations allowed are used up.
    Iterations,
    /// A step had no finite solution; the estimate is the previous one.
    NotFinite,
}

/// Where a solve starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InitialGuess {
    /// The tracker's history.
    #[default]
    History,
    /// The one velocity that makes the cloud of all returns crispest.
    Steady,
    /// Such velocities for parts of the track.
    Unsteady,
}

/// How a solve went.
#[derive(Clone, Debug, Default)]
pub struct EstimateReport {
    /// Why it stopped.
    pub termination: Termination,
    /// Iterations that led to the estimate.
    pub iterations: usize,
    /// Cost at the start and after each of them.
    pub costs: heapless::Vec<Cost, { ITERATIONS_MAX + 1 }>,
    /// Returns that took part.
    pub returns: usize,
    /// Returns left out because there were more.
    pub thinned: usize,
    /// Returns left out because they or their times are not finite, or beyond 100 km and a day.
    pub unsound: usize,
    /// Model points removed because rays went through them.
    pub carved: usize,
    /// The start that led to the estimate.
    pub from: InitialGuess,
}
