//! The trackers that are compared, each run over one object.

use super::object::{Moment, Object, centroid, moment_at};
use glam::DVec3;
use raywake_core::objects::ObjectState;
use raywake_core::objects::centroid_ekf::{CentroidEkf, CentroidParams};

/// What a tracker makes of an object.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// At the mean time of every batch.
    pub moments: Vec<Moment>,
    /// Every return in the object's frame, m, by the pose at its own time.
    pub cloud: Vec<[f32; 3]>,
}

impl Track {
    /// Of a motion: at the times of the object's batches, and of each of its returns.
    pub fn of(object: &Object, mut at: impl FnMut(f64) -> Moment) -> Track {
        let moments = object.batches().map(|batch| at(centroid(batch).0)).collect();
        let project = |r: &raywake_core::objects::ObjectReturn| {
            let place = DVec3::from_array(r.position.map(f64::from));
            at(f64::from(r.time_s)).project(place).as_vec3().to_array()
        };
        let cloud = object.returns.iter().map(project).collect();
        Track { moments, cloud }
    }
}

/// The baseline of section 2.4: states after every batch, the centroid of which the filter takes for
/// the object's position. Where it finds out later which way the object looks, its earlier states
/// are revised, as they are for the proposed tracker's start.
pub fn baseline(object: &Object, params: &CentroidParams) -> Vec<ObjectState> {
    let mut centroids = object.batches().map(centroid);
    let Some((time_s, at)) = centroids.next() else { return Vec::new() };
    let mut filter = CentroidEkf::birth(params, time_s, at.to_array());
    let mut history = vec![filter.state()];
    for (time_s, at) in centroids {
        filter.predict(params, time_s);
        let revision = filter.update(params, at.to_array());
        let now = filter.state();
        revision.revise(&now, &mut history);
        history.push(now);
    }
    history
}

/// The motion of a history of states, between two of them on the line that joins them.
pub fn motion(history: &[ObjectState]) -> impl Fn(f64) -> Moment {
    let moments: Vec<Moment> = history.iter().map(|s| Moment::from(*s)).collect();
    move |time_s| moment_at(&moments, time_s)
}
