//! Process noise of the unicycle (2.6), for the centroid filter and for the estimate.

raywake_core::params! {
    /// Square root of the diagonal of `Q_u`: standard deviations after one second.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ProcessNoise {
        /// Along each axis of the position.
        pub position_sigma_m: f64 = 0.01, "m", (above 0), "Dissertation, section 2.6.2.";
        /// Of the heading.
        pub heading_sigma_rad: f64 = 0.001, "rad", (above 0), "Dissertation, section 2.6.2.";
        /// Of the speed.
        pub speed_sigma_mps: f64 = 0.9, "m/s", (above 0), "Dissertation, section 2.6.2.";
        /// Of the climb.
        pub climb_sigma_mps: f64 = 0.1, "m/s", (above 0), "Dissertation, section 2.6.2.";
        /// Of the turn rate.
        pub turn_rate_sigma_radps: f64 = 0.08165, "rad/s", (above 0),
            "Dissertation, section 2.6.2; the estimate uses 0.15: town traffic enters a bend \
             within a second.";
    }
}

impl ProcessNoise {
    /// Sigmas in the order of the state's elements: x, y, z, heading, speed, climb, turn rate.
    pub const fn sigmas(&self) -> [f64; 7] {
        let position = self.position_sigma_m;
        let [heading, speed] = [self.heading_sigma_rad, self.speed_sigma_mps];
        let [climb, turn_rate] = [self.climb_sigma_mps, self.turn_rate_sigma_radps];
        [position, position, position, heading, speed, climb, turn_rate]
    }
}
