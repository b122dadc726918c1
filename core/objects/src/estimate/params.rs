//! The choices of an estimate: the dissertation's and ours.

/// Objects beyond these lengths move like those of them, m.
const LENGTHS_M: [f64; 2] = [0.6, 30.0];

/// Basis functions of short objects are no shorter than this share.
const BASIS_LEAST: f64 = 2.0 / 3.0;

/// The choices of an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateParams {
    /// Returns that take part, evenly in time as far as there are as many.
    pub returns: usize,
    /// Model points (`n_m`).
    pub model: usize,
    /// Time for each basis function, s.
    pub basis_s: f64,
    /// Square root of the diagonal of `Q_u`: x, y, z (m), heading (rad), speed, climb (m/s), turn
    /// rate (rad/s).
    pub process: [f64; 7],
    /// Length of an object for which `basis_s`, `process` and `loose_m` hold, m: the turn rate of
    /// others varies in inverse proportion to theirs, and so does the speed of longer ones; bases of
    /// shorter ones are shorter, as somebody on foot turns within half a second, and they are less
    /// loose; no model point is expected further from the origin than an object is long. 0 where all
    /// holds for all.
    pub length_m: f64,
    /// Time in which a turn rate fades to a third, s; infinite where turns go on.
    pub turn_s: f64,
    /// Degrees of freedom of the turn rate's noise, which is then Student's; 0 for a Gaussian: steady
    /// motion with a few hard turns. It refines what a Gaussian finds.
    pub tails: f64,
    /// Scale of Student's noise as a share of the deviation in `process`.
    pub calm: f64,
    /// A manoeuvre's length, s: so long Student's noise has one variance.
    pub manoeuvre_s: f64,
    /// Standard deviation of a model point about the origin, m.
    pub extent_m: f64,
    /// Standard deviation of a return about its model point (`σ_z`), m.
    pub deviation_m: f64,
    /// Iterations at most.
    pub iterations: usize,
    /// A return further off than so many deviations counts for a quarter; 0 for no robust loss.
    pub robust: f64,
    /// Steps that raise the cost are taken back and damped (Levenberg and Marquardt).
    pub damping: bool,
    /// Returns weigh across the surface that their model point stands for, little along it.
    pub surfaces: bool,
    /// Additional deviation along a surface, m; with `surfaces`.
    pub loose_m: f64,
    /// The start is smoothed with the process model, and steady motions that lay the returns over each
    /// other are tried beside it.
    pub starts: bool,
    /// Deviation of a return at an end of the object, m; 0 to leave ends out. They lead the first
    /// iterations, as many again; then the returns know better. See [`ends`].
    pub ends_m: f64,
    /// Model points that rays went through are taken away, and the rest is estimated again.
    pub carves: bool,
    /// Rays that pass the object tell where it ends: [`crate::panorama`].
    pub passing: bool,
    /// The start grows from the middle of the track, over a sparse model.
    pub grows: bool,
}

impl EstimateParams {
    /// The dissertation's (2.6.2).
    pub const fn dissertation() -> EstimateParams {
        EstimateParams {
            returns: 5000,
            model: 300,
            basis_s: 0.5,
            process: [0.01, 0.01, 0.01, 0.001, 0.9, 0.1, 0.08165],
            length_m: 0.0,
            turn_s: f64::INFINITY,
            tails: 0.0,
            calm: 1.0,
            manoeuvre_s: 0.0,
            extent_m: 10.0,
            deviation_m: 0.5,
            iterations: 10,
            robust: 0.0,
            damping: false,
            surfaces: false,
            loose_m: 0.0,
            starts: false,
            ends_m: 0.0,
            carves: false,
            passing: false,
            grows: false,
        }
    }

    /// Those for an object so long, m; these where it is not known.
    pub(super) fn of(&self, length_m: f32) -> EstimateParams {
        let mut params = *self;
        if self.length_m > 0.0 && length_m > 0.0 {
            let [shortest, longest] = LENGTHS_M;
            let length_m = f64::from(length_m).clamp(shortest, longest);
            let shorter = self.length_m / length_m;
            params.process[6] *= shorter;
            params.process[4] *= shorter.min(1.0);
            params.basis_s *= shorter.recip().clamp(BASIS_LEAST, 1.0);
            params.loose_m *= shorter.recip().min(1.0);
            params.extent_m = params.extent_m.min(length_m);
        }
        params
    }

    /// The same with Gaussian noise alone.
    pub(super) fn plain(&self) -> EstimateParams {
        EstimateParams { tails: 0.0, ..*self }
    }
}

impl Default for EstimateParams {
    /// Ours.
    fn default() -> EstimateParams {
        let mut process = EstimateParams::dissertation().process;
        // Town traffic turns into a bend within a second.
        process[6] = 0.15;
        EstimateParams {
            basis_s: 0.3,
            deviation_m: 0.05,
            damping: true,
            surfaces: true,
            loose_m: 0.3,
            starts: true,
            ends_m: 0.2,
            carves: true,
            passing: true,
            grows: true,
            process,
            // A car's.
            length_m: 4.5,
            turn_s: 1.5,
            tails: 0.5,
            calm: 0.05,
            manoeuvre_s: 1.7,
            ..EstimateParams::dissertation()
        }
    }
}
