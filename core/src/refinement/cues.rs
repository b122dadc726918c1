//! Cues to P(moves): whether what was found to move really does.
//!
//! The hypothesis test says what a cluster most likely did. How likely that is follows from cues of
//! the cluster and of the column ([`forest`](super::forest), fitted by `raywake-lab train moves`).
//! Three of them accumulate evidence over time: those of the tracklets.

/// The largest margin that counts: beyond it the case is clear.
const MARGIN_MAX: f32 = 0.5;

/// Pseudo-count added to the looks at voxels, so that few looks do not say much.
const FEW_LOOKS: f32 = 8.0;

/// The value of a cue: a number, or yes (1) or no (0) in a byte, as cues are kept for every column.
trait Cue {
    const NONE: Self;
}

impl Cue for f32 {
    const NONE: f32 = 0.0;
}

impl Cue for bool {
    const NONE: bool = false;
}

/// Declares cues.
macro_rules! cues {
    (
        $(#[$doc:meta])* pub struct $name:ident {
            $($(#[$field_doc:meta])* pub $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl $name {
            /// No cue at all.
            pub const NONE: $name = $name { $($field: <$type as Cue>::NONE),* };

            /// Their names, in order.
            pub const NAMES: &[&str] = &[$(stringify!($field)),*];

            /// Their values, in order.
            pub fn values(&self) -> [f32; $name::NAMES.len()] {
                [$(f32::from(self.$field)),*]
            }
        }
    };
}

cues! {
    /// Cues to whether a column moves.
    pub struct Cues {
        /// Evidence for the cluster's motion beyond what the test asked for, at most 0.5.
        pub margin: f32,
        /// Share of the cluster's columns whose tracklets moved, relative to the quorum.
        pub share: f32,
        /// Mean truncated residual of the motion, or of rest if none was tried, 0 to 1.
        pub residual: f32,
        /// Logarithm of the number of returns that were registered.
        pub returns: f32,
        /// Mean of log(1 + speed / its standard deviation) over the tracklets that moved.
        pub certainty: f32,
        /// Mean P(moves) of its tracklets when they were last observed, 0 if there are none.
        pub earlier: f32,
        /// Share of looks that hit something else, of those at the cluster's voxels in sweeps in
        /// which, by its motion, it was not there yet ([`Looks`]).
        pub worn: f32,
        /// Share of the same looks that found nothing.
        pub fresh: f32,
        /// By how much the column's own returns fit rest worse than the motion, -1 to 1.
        pub misfit: f32,
        /// The encoder's score of what could move, nats, cut to
        /// [`could_move_max`](crate::params::RefinementParams::could_move_max) either way; 0 if it
        /// is ignored.
        pub could_move: f32,
        /// There was at most one sweep before the pair: no tracklet predicts yet, and one look back
        /// hardly shows that it came.
        pub no_history: bool,
        /// The test found it static. Of the others only `share`, `earlier` and `could_move` are set
        /// then.
        pub stands: bool,
    }
}

/// Cues of a column, in addition to those of its cluster.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColumnCues {
    /// By how much its returns fit rest worse than its cluster's motion.
    pub misfit: f32,
    /// The encoder's score of what could move, cut as in [`Cues::could_move`].
    pub could_move: f32,
}

impl ColumnCues {
    /// No cue at all.
    pub const NONE: ColumnCues = ColumnCues { misfit: 0.0, could_move: 0.0 };
}

impl Cues {
    /// Cues of a cluster, without those of a column.
    pub(super) fn of_cluster(margin: f32, residual: f32, returns: usize, prior: &Prior) -> Cues {
        Cues {
            margin: margin.min(MARGIN_MAX),
            share: prior.share,
            residual,
            returns: libm::logf(returns.max(1) as f32),
            certainty: prior.certainty,
            earlier: prior.earlier,
            worn: 0.0,
            fresh: 0.0,
            misfit: 0.0,
            could_move: 0.0,
            no_history: false,
            stands: false,
        }
    }

    /// Cues of something static, given those of its cluster.
    pub(super) fn stationary(of_cluster: &Cues, could_move: f32) -> Cues {
        let &Cues { share, earlier, .. } = of_cluster;
        Cues { share, earlier, stands: true, ..Cues::NONE }
            .with(ColumnCues { could_move, ..ColumnCues::NONE })
    }

    /// The same with the cues of a column.
    pub(super) fn with(self, ColumnCues { misfit, could_move }: ColumnCues) -> Cues {
        Cues { misfit, could_move, ..self }
    }
}

/// Looks at voxels of a cluster, or of a part of it, in sweeps in which, by its motion, it was not
/// there yet. What they hit was something else, unless the cluster may have been at rest there
/// before it started: then they say neither that something else was there nor that nothing was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Looks {
    /// Number of looks: voxels times sweeps.
    pub made: u32,
    /// How many hit something else.
    pub hits: u32,
    /// How many found nothing.
    pub empty: u32,
}

impl core::ops::AddAssign for Looks {
    fn add_assign(&mut self, other: Looks) {
        self.made += other.made;
        self.hits += other.hits;
        self.empty += other.empty;
    }
}

impl Looks {
    /// Share of looks that hit something else: 0 to 1, below 0.5 if there were few.
    pub fn worn(&self) -> f32 {
        self.hits as f32 / (self.made as f32 + FEW_LOOKS)
    }

    /// The same for looks that found nothing.
    pub fn fresh(&self) -> f32 {
        self.empty as f32 / (self.made as f32 + FEW_LOOKS)
    }
}

/// Age from which a tracklet predicts: it has been observed again.
pub(crate) const PREDICTING_AGE: u32 = 1;

/// What the tracklet of a column predicts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prediction {
    /// Displacement, voxels.
    pub by: [f32; 2],
    /// log(1 + speed / its standard deviation).
    pub certainty: f32,
    /// P(moves), as last observed.
    pub probability: f32,
}

/// What the tracklets of a cluster predict.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prior {
    /// Mean displacement, voxels, if it is large enough to count as one.
    pub by: Option<[f32; 2]>,
    /// Share of its columns whose tracklets moved, relative to the quorum: 0 to 1.
    pub share: f32,
    /// Mean certainty of those tracklets.
    pub certainty: f32,
    /// Mean P(moves) of all its tracklets, as last observed.
    pub earlier: f32,
}

impl Prior {
    /// The prior of `columns` columns with these predictions. A displacement of less than `least`
    /// does not count as one.
    pub fn of(
        columns: usize,
        quorum: f32,
        least: f32,
        predictions: impl Iterator<Item = Prediction>,
    ) -> Prior {
        let moves = |[x, y]: [f32; 2]| x * x + y * y > least * least;
        let (mut known, mut moving) = (0.0, 0.0);
        let (mut sum, mut certainty, mut earlier) = ([0.0; 2], 0.0, 0.0);
        for Prediction { by, certainty: own, probability } in predictions {
            known += 1.0;
            earlier += probability;
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
            earlier: earlier / f32::max(known, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prior(moving: usize, resting: usize) -> Prior {
        let one = |x| Prediction { by: [x, 0.0], certainty: 2.0 * x, probability: x };
        let predictions = core::iter::repeat_n(one(1.0), moving);
        let all = predictions.chain(core::iter::repeat_n(one(0.0), resting));
        Prior::of(40, 0.5, 0.1, all)
    }

    #[test]
    fn a_prior_needs_a_quorum_of_columns() {
        let share = |moving| prior(moving, 0).share;
        assert_eq!(
            [share(0), share(1), share(10), share(20), share(40)],
            [0.0, 0.05, 0.5, 1.0, 1.0]
        );
        assert_eq!(prior(20, 0).by, Some([1.0, 0.0]));
        // One that moves among many at rest makes no displacement, and its certainty is its own.
        let one = prior(1, 39);
        assert_eq!((one.by, one.certainty), (None, 2.0));
        assert_eq!(prior(0, 40).certainty, 0.0);
        // P(moves) is the mean over all.
        assert_eq!([prior(20, 0).earlier, one.earlier, prior(0, 0).earlier], [1.0, 0.025, 0.0]);
    }
}
