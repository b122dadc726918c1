//! P(moves): whether what was found to move does.
//!
//! The hypothesis test says what a cluster most likely did. How likely that is, is told by cues of
//! the cluster and of the column, weighed by logistic regression (`raywake-lab train moves`). What a
//! pair of sweeps tells adds up over time in two of them: the tracklets that moved before.

use crate::params::MovesParams;

/// The largest margin that counts: with more, it is plain.
const MARGIN_MAX: f32 = 0.5;

crate::cues! {
    /// What tells whether a column moves.
    pub struct Cues {
        /// Evidence of the cluster's motion beyond what the test asked for, at most 0.5.
        pub margin: moves_margin,
        /// Share of the cluster's columns whose tracklets moved, of the quorum.
        pub share: moves_share,
        /// Mean truncated residual of the motion, 0 to 1.
        pub residual: moves_residual,
        /// Logarithm of the number of returns that were registered.
        pub returns: moves_returns,
        /// Mean logarithm of 1 + speed over its standard deviation, of the tracklets that moved.
        pub certainty: moves_certainty,
        /// By how much the column's own returns fit rest worse than the motion, -1 to 1.
        pub misfit: moves_misfit,
    }
}

impl Cues {
    /// Of a cluster; those of a column are missing.
    pub(super) fn of_cluster(margin: f32, residual: f32, returns: usize, prior: &Prior) -> Cues {
        Cues {
            margin: margin.min(MARGIN_MAX),
            share: prior.share,
            residual,
            returns: libm::logf(returns.max(1) as f32),
            certainty: prior.certainty,
            misfit: 0.0,
        }
    }

    /// P(moves).
    pub fn probability(&self, params: &MovesParams) -> f32 {
        1.0 / (1.0 + libm::expf(-self.logit(params)))
    }
}

/// What the tracklet of a column predicts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prediction {
    /// Displacement, voxels.
    pub by: [f32; 2],
    /// Logarithm of 1 + speed over its standard deviation.
    pub certainty: f32,
}

/// What the tracklets of a cluster predict.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prior {
    /// Mean displacement, voxels, if that is one.
    pub by: Option<[f32; 2]>,
    /// Share of its columns whose tracklets moved, of the quorum: 0 to 1.
    pub share: f32,
    /// Mean certainty of those.
    pub certainty: f32,
}

impl Prior {
    /// Of `columns` columns with these predictions. Less than `least` is no displacement.
    pub fn of(
        columns: usize,
        quorum: f32,
        least: f32,
        predictions: impl Iterator<Item = Prediction>,
    ) -> Prior {
        let moves = |[x, y]: [f32; 2]| x * x + y * y > least * least;
        let (mut known, mut moving) = (0.0, 0.0);
        let (mut sum, mut certainty) = ([0.0; 2], 0.0);
        for Prediction { by, certainty: own } in predictions {
            known += 1.0;
            sum = [sum[0] + by[0], sum[1] + by[1]];
            if moves(by) {
                moving += 1.0;
                certainty += own;
            }
        }
        let mean = sum.map(|s| s / f32::max(known, 1.0));
        Prior {
            by: moves(mean).then_some(mean),
            share: (moving / (quorum * columns as f32)).min(1.0),
            certainty: certainty / f32::max(moving, 1.0),
        }
    }
}

/// Declares cues, each with the parameter that weighs it.
#[macro_export]
macro_rules! cues {
    (
        $(#[$doc:meta])* pub struct $name:ident {
            $($(#[$field_doc:meta])* pub $field:ident: $weight:ident,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: f32,)*
        }

        impl $name {
            /// Names of the parameters that weigh them, in order.
            pub const WEIGHTS: &[&str] = &[$(stringify!($weight)),*];

            /// Their values, in order.
            pub fn values(&self) -> [f32; $name::WEIGHTS.len()] {
                [$(self.$field),*]
            }

            fn logit(&self, params: &MovesParams) -> f32 {
                params.moves_bias $(+ params.$weight * self.$field)*
            }
        }
    };
}
