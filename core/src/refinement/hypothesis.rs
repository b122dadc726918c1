//! Static or dynamic: the motion that explains a cluster best, against rest.
//!
//! Two or three sweeps are thin evidence for the motion of a truck driving alongside, because its
//! side slides along itself. The prediction of its tracklets therefore acts as a prior: a cluster
//! that keeps moving as predicted needs only a share of the evidence required to start moving
//! (`evidence_prior_ratio` of [`RefinementParams`](crate::params::RefinementParams)), and even less
//! if it is long.

use super::cluster::Cluster;
use super::cues::{Cues, Looks, Prediction, Prior};
use super::footprint::Footprint;
use super::motion::Motion;
use super::scaled::Scaled;
use super::scans::Scans;
use super::search::search;
use super::slide::slide;
use super::starts::{TRAFFIC_MAX, Votes};
use crate::column_set::ColumnSet;
use crate::record::{Flow, VALID, flow_displacement};

/// Number of displacements many columns voted for that are tried as starts. Limited to save time:
/// each start costs a registration.
const VOTED_STARTS: usize = 3;
/// In addition to those: rest, the prediction, the search and traffic.
const STARTS_MAX: usize = VOTED_STARTS + 3 + TRAFFIC_MAX;
/// A motion that fits badly is left to the parts of its cluster unless it has this many times the
/// evidence.
const BAD_FIT_EVIDENCE: f32 = 2.0;

/// A cluster without a predicted displacement whose residual at rest in the earliest sweep, by far
/// the longest time to move in, is below this share of `residual_static` is not examined further.
const STATIC_RATIO: f32 = 0.5;

/// Share of looks that found nothing from which a cluster counts as seen to come. It is 0.9 in the
/// median for clusters that move; for static ones far from any of those it is 0.2, and above 0.75
/// for a tenth of them (simulated drives).
const FRESH_MIN: f32 = 0.85;

/// What was found about a cluster.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hypothesis {
    /// The motion that explains it best.
    pub motion: Motion,
    /// Whether it moved like that, rather than being static.
    pub is_dynamic: bool,
    /// Variance of that decision: p (1 - p), where p is the probability that it moved.
    pub variance: f32,
    /// Residual at rest.
    pub static_residual: f32,
    /// Largest extent along an axis, voxels.
    pub extent: f32,
    /// The cluster it is a part of, or itself.
    pub parent: u32,
    /// Cues to whether it moves, without those of its columns.
    pub cues: Cues,
    /// How many more of its columns could move than could not, if it is dynamic.
    pub similarity: i32,
    /// What was there before it came, if it is dynamic.
    pub looks: Looks,
    /// The ground it stands on, if it is dynamic.
    pub footprint: Footprint,
}

impl Hypothesis {
    /// Whether it was seen to come from elsewhere.
    pub fn came(&self) -> bool {
        self.cues.fresh >= FRESH_MIN
    }

    /// Whether it was seen to come and resembles nothing that could move: the encoder, which
    /// learned nothing like it, is ignored then.
    fn is_unfamiliar(&self) -> bool {
        self.similarity < 0 && self.came()
    }

    /// Whether a column may go with it.
    pub fn may_include(&self, scans: &Scans, column: usize) -> bool {
        self.is_unfamiliar() || !scans.stays(column)
    }

    /// The encoder's score of what could move for one of its columns, nats; 0 if it is ignored.
    pub fn could_move(&self, scans: &Scans, column: usize) -> f32 {
        if self.is_unfamiliar() { 0.0 } else { scans.could_move(column) }
    }
}

/// Evidence for a motion against rest, from the residuals of both: 0 to 1.
pub fn evidence(rest: f32, moved: f32) -> f32 {
    if moved < rest { (1.0 - moved / rest) * libm::sqrtf(rest - moved) } else { 0.0 }
}

/// Factor by which the variance of a motion is larger than its returns suggest, given how badly it
/// fits them.
pub fn variance_inflation(scaled: &Scaled, residual: f32) -> f32 {
    let ratio = residual / scaled.params.inflation_residual;
    1.0 + ratio * ratio
}

/// Whether two displacements count as the same start.
fn is_same(scaled: &Scaled, a: &[f32; 2], b: [f32; 2]) -> bool {
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < scaled.start_spacing
}

/// The best motion so far.
struct Trials<'a> {
    cluster: &'a Cluster<'a>,
    visited: &'a mut ColumnSet,
    tried: heapless::Vec<[f32; 2], STARTS_MAX>,
    residual: f32,
    motion: Motion,
}

impl<'a> Trials<'a> {
    /// Nothing tried yet: rest, with this residual.
    fn new(cluster: &'a Cluster<'a>, residual: f32, visited: &'a mut ColumnSet) -> Trials<'a> {
        let motion = Motion::around(cluster.centre);
        Trials { cluster, visited, tried: heapless::Vec::new(), residual, motion }
    }

    /// Registers the cluster from a start, with few returns, then with all of them if that leads to
    /// a better fit than the best so far.
    fn start(&mut self, by: [f32; 2]) {
        let (cluster, scaled) = (self.cluster, self.cluster.scans.scaled);
        if self.tried.iter().any(|t| is_same(scaled, t, by)) {
            return;
        }
        // There is room for every start.
        let _ = self.tried.push(by);
        let start = Motion::around(cluster.centre).displaced(by);
        let motion = cluster.align(start, scaled.params.start_stride as usize, self.visited);
        if cluster.residual_below(self.residual, &motion, self.visited).is_some() {
            let motion = cluster.align(motion, 1, self.visited);
            self.consider(motion);
        }
    }

    /// Takes a motion if it fits better than the best so far.
    fn consider(&mut self, motion: Motion) {
        let better = self.cluster.residual_below(self.residual, &motion, self.visited);
        if let Some(residual) = better {
            (self.residual, self.motion) = (residual, motion);
        }
    }

    /// Tries rest, the prediction, what the columns voted for and, if nothing fits, a search; then,
    /// if it moves, how traffic moves: in a row of cars each may fit the next one about as well. It
    /// then slides the cluster along itself from the best of these. Returns the best motion and its
    /// residual.
    fn run(mut self, predicted: Option<[f32; 2]>, flow: impl Fn(usize) -> Flow) -> (Motion, f32) {
        let cluster = self.cluster;
        let params = &cluster.scans.scaled.params;
        let static_residual = self.residual;
        self.start([0.0; 2]);
        if let Some(by) = predicted {
            self.start(by);
        }
        let matches = cluster.columns.iter().map(|c| flow(*c as usize));
        let mut votes = Votes::new(matches.filter(|f| f & VALID != 0).map(flow_displacement));
        for _ in 0..VOTED_STARTS {
            let wanted = self.residual > params.residual_good;
            let Some(by) = votes.take_mode().filter(|_| wanted) else { break };
            self.start(by);
        }
        let enough = cluster.samples.len() >= params.search_returns_min as usize;
        if self.residual > params.residual_bad && enough {
            self.start(search(cluster));
        }
        if evidence(static_residual, self.residual) > params.evidence_min {
            for by in cluster.scans.traffic {
                if self.residual > params.residual_good {
                    self.start(*by);
                }
            }
        }
        if self.residual > params.residual_good
            && let Some(slid) = slide(cluster, &self.motion, self.residual, self.visited)
        {
            self.consider(slid);
            let motion = cluster.align(slid, 1, self.visited);
            self.consider(motion);
        }
        (self.motion, self.residual)
    }
}

/// Tests whether a cluster is dynamic. `predicted` gives what the tracklet of a column predicts,
/// `flow` the match of a column.
pub fn test(
    mut cluster: Cluster,
    flow: impl Fn(usize) -> Flow,
    predicted: impl Fn(usize) -> Option<Prediction>,
    visited: &mut ColumnSet,
) -> Hypothesis {
    let scaled = cluster.scans.scaled;
    let params = &scaled.params;
    let prior = prior_of(&cluster, predicted);
    // What moved before can move.
    cluster.could_move |= prior.share >= 1.0;
    let cluster = &cluster;
    let at_rest = |static_residual: f32| Hypothesis {
        static_residual,
        extent: cluster.extent,
        cues: Cues::of_cluster(
            -params.evidence_min,
            static_residual,
            cluster.samples.len(),
            &prior,
        ),
        ..Hypothesis::default()
    };
    // Too large or too small to move by itself: the fit only determines how certain that is.
    if cluster.extent > scaled.extent_max || cluster.samples.len() < params.returns_min as usize {
        return at_rest(cluster.second_residual());
    }
    let in_earliest = cluster.seen_in_earliest();
    if prior.by.is_none()
        && let Some(residual) = in_earliest.and_then(|seen| cluster.residual_at_rest(seen))
        && residual < STATIC_RATIO * params.residual_static
    {
        return at_rest(residual);
    }
    let seen_at_rest = cluster.seen_at_rest(in_earliest, visited);
    let static_residual = seen_at_rest.value();
    let prior_ratio =
        params.evidence_prior_ratio * (scaled.evidence_length / cluster.extent).min(1.0);
    let prior_ratio = 1.0 - prior.share * (1.0 - prior_ratio);
    let ease = if prior.by.is_some() { prior_ratio } else { 1.0 };
    if static_residual < params.residual_static * ease {
        return at_rest(static_residual);
    }
    let (motion, residual) = Trials::new(cluster, static_residual, visited).run(prior.by, flow);
    // For all others, returns that are not seen count as missed.
    let static_residual = if cluster.could_move {
        cluster.compared_residual(&seen_at_rest, &motion)
    } else {
        static_residual
    };
    let as_predicted =
        prior.by.is_some_and(|e| is_same(scaled, &e, [motion.delta.x, motion.delta.y]));
    let needed = params.evidence_min * if as_predicted { prior_ratio } else { 1.0 };
    let margin = evidence(static_residual, residual) - needed;
    let cues = Cues::of_cluster(margin, residual, cluster.samples.len(), &prior);
    let found = Hypothesis { cues, ..at_rest(static_residual) };
    decide(cluster, found, motion, residual, needed)
}

/// What the tracklets of a cluster's columns predict.
fn prior_of(cluster: &Cluster, predicted: impl Fn(usize) -> Option<Prediction>) -> Prior {
    let scaled = cluster.scans.scaled;
    let predictions = cluster.columns.iter().filter_map(|c| predicted(*c as usize));
    let count = cluster.columns.len();
    Prior::of(count, scaled.params.prior_quorum, scaled.displacement_min, predictions)
}

/// The rest of a moving body, if it fits the body's motion about as well as being at rest, whose
/// residual is `static_residual`.
pub fn along_with(
    rest: &Cluster,
    static_residual: f32,
    body: &Hypothesis,
    predicted: impl Fn(usize) -> Option<Prediction>,
    visited: &mut ColumnSet,
) -> Option<Hypothesis> {
    let scaled = rest.scans.scaled;
    let motion = rest.align(body.motion.about(rest.centre), 1, visited);
    let residual = rest.seen(&motion, visited).value();
    let fits = residual < static_residual + scaled.params.remainder_residual
        && motion.is_near(&body.motion, scaled.start_spacing);
    fits.then(|| Hypothesis {
        motion: with_confidence(rest, motion, residual),
        static_residual,
        extent: rest.extent,
        cues: Cues::of_cluster(
            body.cues.margin,
            residual,
            rest.samples.len(),
            &prior_of(rest, predicted),
        ),
        footprint: Footprint::along(&motion),
        ..*body
    })
}

/// Decides whether a motion is accepted, which takes `needed` evidence, and how uncertain it is.
fn decide(
    cluster: &Cluster,
    found: Hypothesis,
    motion: Motion,
    residual: f32,
    needed: f32,
) -> Hypothesis {
    let scaled = cluster.scans.scaled;
    let params = &scaled.params;
    let evidence = evidence(found.static_residual, residual);
    let fits = residual < params.residual_bad;
    let convinces = evidence > if fits { needed } else { BAD_FIT_EVIDENCE * needed };
    let likely = 1.0 / (1.0 + libm::expf((needed - evidence) / params.evidence_scale));
    Hypothesis {
        is_dynamic: convinces && motion.delta.xy().norm() > scaled.displacement_min,
        variance: likely * (1.0 - likely),
        footprint: Footprint::along(&motion),
        motion: with_confidence(cluster, motion, residual),
        ..found
    }
}

/// A motion with the covariance that is output, given how well it fits.
fn with_confidence(cluster: &Cluster, motion: Motion, residual: f32) -> Motion {
    let scaled = cluster.scans.scaled;
    let footprint = libm::sqrtf(cluster.columns.len() as f32);
    let confidence = scaled.confidence / (cluster.range() * footprint);
    let covariance = motion.covariance * (confidence * variance_inflation(scaled, residual));
    Motion { covariance, ..motion }
}
