//! The trackers compared, each run over one object.

use super::object::{Moment, Object, centroid, moment_at};
use crate::labels::turn;
use glam::DVec3;
use raywake_objects::centroid_ekf::{CentroidEkf, CentroidParams, Revision};
use raywake_objects::estimate::{EstimateParams, Estimator, FixedLag};
use raywake_objects::{ObjectReturn, ObjectState};

/// A tracker's result for an object.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Motion at the mean time of every batch.
    pub moments: Vec<Moment>,
    /// Every return in the object's frame, m, using the pose at its own time.
    pub cloud: Vec<[f32; 3]>,
}

impl Track {
    /// Samples a motion at the times of the object's batches, and of each of its returns.
    pub fn of(object: &Object, mut at: impl FnMut(f64) -> Moment) -> Track {
        let moments = object.batches().map(|batch| at(centroid(batch).0)).collect();
        let project = |r: &ObjectReturn| {
            let place = DVec3::from_array(r.position.map(f64::from));
            at(f64::from(r.time_s)).project(place).as_vec3().to_array()
        };
        let cloud = object.returns.iter().map(project).collect();
        Track { moments, cloud }
    }
}

/// The baseline of section 2.4: states after every batch, whose centroid the filter takes as the
/// object's position. If it later finds out which way the object faces, its earlier states are
/// revised, as for the start of the proposed tracker.
pub fn baseline(object: &Object, params: &CentroidParams) -> Vec<ObjectState> {
    let mut history = Vec::new();
    follow(object, params, |state, revision, _| {
        revision.revise(&state, &mut history);
        history.push(state);
    });
    history
}

/// The baseline without revisions: what it knows at the time.
pub fn baseline_live(object: &Object, params: &CentroidParams) -> Vec<ObjectState> {
    let mut history = Vec::new();
    follow(object, params, |state, _, _| history.push(state));
    history
}

/// The estimate over the last seconds after every batch, started from the baseline as it is at that
/// time.
pub fn fixed_lag(
    object: &Object,
    params: &EstimateParams,
    estimator: &mut Estimator,
) -> Vec<ObjectState> {
    let (mut filter, mut history) =
        (raywake_alloc_guard::boxed!(FixedLag, FixedLag::new()), Vec::new());
    follow(object, &CentroidParams::DEFAULT, |state, _, batch| {
        history.push(filter.push(estimator, params, batch, &state));
    });
    history
}

/// Passes on the baseline's state after every batch, and its revision of the earlier ones.
fn follow(
    object: &Object,
    params: &CentroidParams,
    mut show: impl FnMut(ObjectState, Revision, &[ObjectReturn]),
) {
    let mut filter: Option<CentroidEkf> = None;
    for batch in object.batches() {
        let (time_s, at) = centroid(batch);
        let at = at.to_array();
        match &mut filter {
            None => {
                let born = CentroidEkf::birth(params, time_s, at);
                show(born.state(), Revision::None, batch);
                filter = Some(born);
            }
            Some(filter) => {
                filter.predict(params, time_s);
                let revision = filter.update(params, at);
                show(filter.state(), revision, batch);
            }
        }
    }
}

/// The motion of a history of states, linearly interpolated.
pub fn motion(history: &[ObjectState]) -> impl Fn(f64) -> Moment + use<> {
    let mut moments: Vec<Moment> = history.iter().map(|s| Moment::from(*s)).collect();
    for n in 1..moments.len() {
        let last = moments[n - 1].heading;
        moments[n].heading = last + turn(last, moments[n].heading);
    }
    move |time_s| moment_at(&moments, time_s)
}
