//! How a column moved, and how certain that is.
//!
//! A static column gets a displacement of exactly zero rather than a small residual motion. The
//! uncertainty about that goes into its covariance, which grows with the residual at rest and if
//! the column's match disagrees.

use super::cues::Cues;
use super::hypothesis::{Hypothesis, variance_inflation};
use super::scaled::Scaled;

/// How a column moved over the pair, voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refined {
    /// Displacement; zero if it is static.
    pub by: [f32; 2],
    /// Its covariance (xx, xy, yy).
    pub covariance: [f32; 3],
    /// Whether it is part of a cluster that moves.
    pub is_dynamic: bool,
    /// Cues to whether it does.
    pub cues: Cues,
}

impl Refined {
    /// How a column moved as part of a cluster.
    pub fn of(scaled: &Scaled, cluster: &Hypothesis, at: [f32; 2]) -> Refined {
        let by = cluster.motion.of(at);
        let ratio = scaled.params.motion_sigma_ratio;
        let variance = cluster.variance + if cluster.is_dynamic { ratio * ratio } else { 0.0 };
        let own = match cluster.is_dynamic {
            true => Refined {
                by,
                covariance: cluster.motion.covariance_of(at),
                is_dynamic: true,
                cues: Cues::NONE,
            },
            false => Refined::at_rest(scaled, cluster.static_residual),
        };
        own.with_alternative(by, variance)
    }

    /// The same with the uncertainty about which of two motions, that far apart, is right;
    /// `variance` is that of the choice.
    fn with_alternative(self, [x, y]: [f32; 2], variance: f32) -> Refined {
        let apart = [x * x, x * y, y * y];
        let covariance = [0, 1, 2].map(|n| self.covariance[n] + variance * apart[n]);
        Refined { covariance, ..self }
    }

    /// The same, static, although its column's match, cells, may say otherwise.
    pub fn as_static(self, scaled: &Scaled, matched: Option<[f32; 2]>) -> Refined {
        self.with_alternative(matched.unwrap_or_default(), scaled.params.mismatch_variance)
    }

    /// A column that nothing is known about.
    pub fn nothing() -> Refined {
        let cues = Cues::stationary(&Cues::NONE, 0.0);
        Refined { by: [0.0; 2], covariance: [0.0; 3], is_dynamic: false, cues }
    }

    pub fn at_rest(scaled: &Scaled, residual: f32) -> Refined {
        let sigma = scaled.static_sigma;
        let variance = sigma * sigma * variance_inflation(scaled, residual);
        let covariance = [variance, 0.0, variance];
        Refined { covariance, ..Refined::nothing() }
    }
}
