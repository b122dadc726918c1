//! Parameters of the front end.

use crate::centroid_ekf::CentroidParams;
use crate::panorama::PassingParams;

raywake_core::params! {
    /// The front end: for cars, cyclists and people around a car with spinning sensors.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct FrontEndParams {
        /// Variance of z in a cell above which its returns belong to an object.
        pub variance_m2: f32 = 0.01, "m²", (above 0);
        /// Returns lower than this above the ground belong to the ground.
        pub ground_clearance_m: f32 = 0.2, "m", (0 to 2);
        /// Returns at least this high above the ground belong to an object in any cell.
        pub object_height_m: f32 = 0.5, "m", (0 to 10);
        /// Returns at least this high above the ground belong to no object.
        pub overhead_m: f32 = 4.0, "m", (0 to 20);
        /// Speed by the flow from which a return belongs to an object in any cell.
        pub moving_mps: f32 = 0.5, "m/s", (0 to 100);
        /// Maximum standard deviation of a velocity of the flow that is used.
        pub flow_sigma_max_mps: f32 = 0.7, "m/s", (above 0);
        /// A return joins a chunk whose first return is closer than this.
        pub chunk_radius_m: f32 = 0.25, "m", (0 to 2);
        /// And no farther from it in time than this.
        pub chunk_span_s: f32 = 0.05, "s", (0 to 1);
        /// Chunks no farther apart than this along the ground belong to one segment.
        pub link_m: f32 = 0.7, "m", (0 to 5);
        /// And no farther apart than this vertically.
        pub link_up_m: f32 = 1.0, "m", (0 to 20);
        /// Maximum difference between velocities of one object.
        pub velocity_tolerance_mps: f32 = 0.5, "m/s", (0 to 100);
        /// Additional difference, as a fraction of the speed.
        pub velocity_tolerance_ratio: f32 = 0.25, "", (0 to 1);
        /// Segments with fewer returns are not objects.
        pub returns_min: u32 = 15, "returns", (1 to 10000);
        /// Segments that extend farther along x or y are not objects.
        pub extent_max_m: f32 = 18.0, "m", (above 0);
        /// Gate of a segment's centroid: squared Mahalanobis distance.
        pub association_d2: f64 = 11.345, "", (above 0),
            "99 % quantile of chi-square with three degrees of freedom.";
        /// Gate of its centroid and velocity.
        pub association_with_flow_d2: f64 = 15.086, "", (above 0),
            "99 % quantile of chi-square with five degrees of freedom.";
        /// Standard deviation of a segment's velocity by the flow.
        pub segment_velocity_sigma_mps: f64 = 0.7, "m/s", (above 0);
        /// Distance along x or y from a track within which the gate is computed.
        pub coarse_gate_m: f64 = 5.0, "m", (above 0), "Only saves time: wider than any gate.";
        /// Growth of that distance since the track's last update.
        pub coarse_gate_mps: f64 = 45.0, "m/s", (above 0), "Only saves time: faster than any car.";
        /// Time without an observation after which a track ends.
        pub patience_s: f64 = 0.5, "s", (0 to 60);
        /// Mean P(moves) of its returns from which a track counts as moving.
        pub track_moves_min: f32 = 0.5, "", (0 to 1);
        /// Distance between its first and last positions from which a track that moved is an
        /// object.
        pub track_way_min_m: f64 = 1.0, "m", (0 to 100);
        /// Share of a track's classified returns that are vehicles, people or two-wheelers from
        /// which it is an object even if stationary.
        pub road_user_share_min: f32 = 0.5, "", (0 to 1);
        /// Tracks with fewer observations end with the first batch without one.
        pub observations_min: u32 = 3, "observations", (1 to 100);
    } and {
        /// The tracks' filters.
        pub centroid: CentroidParams = CentroidParams::DEFAULT;
        /// Rays that pass objects.
        pub passing: PassingParams = PassingParams::DEFAULT;
    }
}

impl FrontEndParams {
    /// Whether a return moves according to the flow.
    pub(super) fn is_moving(&self, velocity: Option<[f32; 2]>) -> bool {
        velocity.is_some_and(|[x, y]| x * x + y * y >= self.moving_mps * self.moving_mps)
    }

    /// Whether two velocities may belong to one object; an unknown one matches any.
    pub(super) fn is_similar(&self, a: Option<[f32; 2]>, b: Option<[f32; 2]>) -> bool {
        let (Some(a), Some(b)) = (a, b) else { return true };
        let square = |v: [f32; 2]| v[0] * v[0] + v[1] * v[1];
        let apart = square([a[0] - b[0], a[1] - b[1]]);
        let speed = libm::sqrtf(square(a).max(square(b)));
        let allowed = self.velocity_tolerance_mps + self.velocity_tolerance_ratio * speed;
        apart <= allowed * allowed
    }
}
