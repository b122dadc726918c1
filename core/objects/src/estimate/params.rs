//! Parameters of the estimate of trajectory and shape: the dissertation's and ours.

use crate::noise::ProcessNoise;

raywake_core::params! {
    /// The estimate of trajectory and shape.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EstimateParams {
        /// Maximum number of returns used, evenly spaced in time.
        pub returns: usize = 5000, "returns", (1 to 8192), "Dissertation, section 2.6.2.";
        /// Number of model points (`n_m`).
        pub model_points: usize = 300, "points", (1 to 3000), "Dissertation, section 2.6.2.";
        /// Time between knots.
        pub basis_s: f64 = 0.3, "s", (0.05 to 10), "The dissertation uses 0.5 s.";
        /// Standard deviation of a model point about the origin.
        pub shape_sigma_m: f64 = 10.0, "m", (above 0), "Dissertation, section 2.6.2.";
        /// Standard deviation of a return about its model point (`σ_z`).
        pub return_sigma_m: f64 = 0.05, "m", (above 0), "The dissertation uses 0.5 m.";
        /// Maximum number of Gauss-Newton iterations of a descent.
        pub iterations: usize = 10, "iterations", (0 to 64), "Dissertation, section 2.6.2.";
        /// A descent has converged when an iteration lowers the cost by no more than this fraction.
        pub convergence: f64 = 1e-4, "", (0 to 1);
        /// Whether steps that raise the cost are undone and damped (Levenberg-Marquardt).
        pub damping: bool = true, "", (any), "`raywake-lab eval tracks` has a row with this alone.";
        /// Damping of the first iteration, a fraction of the diagonal.
        pub damping_first: f64 = 1e-4, "", (0 to 1);
        /// Factor of the damping after a step that raised the cost.
        pub damping_up: f64 = 10.0, "", (above 1);
        /// Factor of the damping after a step that lowered the cost.
        pub damping_down: f64 = 0.3, "", (above 0 to 1);
        /// Whether returns are weighted by the surface of their model point: fully across it,
        /// little along it.
        pub surfaces: bool = true, "", (any), "`raywake-lab eval tracks` has a row without.";
        /// Additional standard deviation of a return along its surface.
        pub tangential_sigma_m: f64 = 0.3, "m", (0 to 10);
        /// Whether the descent starts from a smoothed history and from motions found by a search.
        pub multi_start: bool = true, "", (any), "`raywake-lab eval tracks` has a row without.";
        /// Whether rays that pass an object show where it ends (see [`crate::panorama`]).
        pub passing: bool = true, "", (any), "`raywake-lab eval tracks` has a row without.";
        /// Length of an object at which the noise, `basis_s` and `tangential_sigma_m` hold; 0: at
        /// any length. Turn rate noise is inversely proportional to the length, as is the speed
        /// noise of longer objects; shorter ones have closer knots, and their returns are less free
        /// along surfaces; `shape_sigma_m` is at most the length.
        pub reference_length_m: f64 = 4.5, "m", (0 to 100), "Length of a car.";
        /// Objects that appear shorter are taken to be this long.
        pub length_min_m: f64 = 0.6, "m", (above 0);
        /// Objects that appear longer are taken to be this long.
        pub length_max_m: f64 = 30.0, "m", (above 0);
        /// Lower bound of the knot spacing of short objects, as a fraction of `basis_s`.
        pub basis_ratio_min: f64 = 2.0 / 3.0, "", (above 0 to 1);
        /// Time in which a turn rate decays to a third.
        pub turn_decay_s: f64 = 1.5, "s", (at least 0.01);
        /// Degrees of freedom of the turn rate's Student-t noise; 0: Gaussian noise.
        pub student_dof: f64 = 0.5, "", (0 to 100), "`raywake-lab eval tracks` has a row without.";
        /// Scale of the Student-t noise, as a fraction of the Gaussian's.
        pub student_scale: f64 = 0.05, "", (above 0 to 1);
        /// Time over which the Student-t noise has one variance.
        pub manoeuvre_s: f64 = 1.7, "s", (0 to 60);
    } and {
        /// Process noise (`Q_u`).
        pub noise: ProcessNoise = ProcessNoise {
            // Town traffic enters a bend within a second.
            turn_rate_sigma_radps: 0.15,
            ..ProcessNoise::DEFAULT
        };
        /// Where the object ends.
        pub endpoints: EndpointParams = EndpointParams::DEFAULT;
        /// Free-space carving.
        pub free_space: FreeSpaceParams = FreeSpaceParams::DEFAULT;
        /// Growth of the first trajectory from the middle of the track.
        pub growth: GrowthParams = GrowthParams::DEFAULT;
        /// First trajectories from a history.
        pub smoothing: SmoothingParams = SmoothingParams::DEFAULT;
        /// Search for steady motions.
        pub search: SearchParams = SearchParams::DEFAULT;
        /// The estimate of the last seconds.
        pub fixed_lag: FixedLagParams = FixedLagParams::DEFAULT;
    }
}

raywake_core::params! {
    /// Endpoints: where an object begins and ends along itself.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EndpointParams {
        /// Standard deviation of a return at an end of the object; 0: ends are not used. They guide
        /// the first descent, after which the returns alone decide.
        pub endpoint_sigma_m: f64 = 0.2, "m", (0 to 10),
            "`raywake-lab eval tracks` has a row without.";
        /// Time over which one foremost and one hindmost return are taken.
        pub endpoint_part_s: f32 = 0.2, "s", (above 0);
        /// Minimum number of returns in such a time to find the ends.
        pub endpoint_returns_min: usize = 6, "returns", (1 to 1000);
        /// Residual beyond which the cost of an end grows linearly (Huber).
        pub endpoint_bound_m: f64 = 0.3, "m", (above 0);
        /// Scale of the bounded cost of a return that falls short: something may hide the end.
        pub endpoint_hidden_m: f64 = 1.0, "m", (above 0);
        /// Weight of a return that falls short.
        pub endpoint_hidden_weight: f64 = 0.3, "", (0 to 1);
        /// Slope of the view, across to along, from which the far end counts in full.
        pub endpoint_slope: f64 = 0.3, "", (above 0);
        /// Rays that pass a return within this distance of an end show that nothing hides it.
        pub endpoint_passing_m: f64 = 0.5, "m", (0 to 10);
    }
}

raywake_core::params! {
    /// Free-space carving: model points that rays went through are removed.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct FreeSpaceParams {
        /// Maximum number of rounds of carving and descent; 0: nothing is carved.
        pub carving_rounds: usize = 3, "rounds", (0 to 20),
            "`raywake-lab eval tracks` has a row without.";
        /// Number of rays that carve, evenly spaced in time.
        pub carving_rays: usize = 1000, "rays", (1 to 8192);
        /// Distance within which a ray passes through a model point.
        pub carving_radius_m: f64 = 0.12, "m", (above 0);
        /// Length at the end of a ray that carves nothing.
        pub carving_clearance_m: f64 = 0.25, "m", (0 to 10);
        /// Minimum cosine between a ray and the normal of a surface that it crosses.
        pub carving_cosine: f64 = 0.2, "", (0 to 1);
        /// Minimum precision across a thin surface, as a fraction of a return's.
        pub carving_thinness: f64 = 0.05, "", (0 to 1);
        /// Number of returns of a model point that one ray through it outweighs.
        pub carving_rays_weight: usize = 8, "", (1 to 1000);
    }
}

raywake_core::params! {
    /// Growth of the first trajectory from the middle of the track, over a sparse model: a dense
    /// one would hold it where it starts.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct GrowthParams {
        /// Whether it grows.
        pub growth: bool = true, "", (any), "`raywake-lab eval tracks` has a row without.";
        /// Time by which a step reaches farther either way; the first step reaches twice as far.
        pub growth_step_s: f64 = 0.2, "s", (0.01 to 100);
        /// Standard deviation of a return during growth.
        pub growth_sigma_m: f64 = 0.15, "m", (above 0);
        /// Number of model points during growth.
        pub growth_points: usize = 75, "points", (1 to 3000);
        /// Number of models made in the first step.
        pub growth_first_rounds: usize = 6, "rounds", (1 to 100);
        /// Iterations with each of them.
        pub growth_first_iterations: usize = 6, "iterations", (0 to 64);
        /// Number of models made in a later step.
        pub growth_rounds: usize = 2, "rounds", (1 to 100);
        /// Iterations with each of them.
        pub growth_iterations: usize = 2, "iterations", (0 to 64);
    }
}

raywake_core::params! {
    /// The first trajectory, smoothed from a history of states and the process model.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SmoothingParams {
        /// Standard deviation of a position of the history.
        pub history_sigma_m: f64 = 0.3, "m", (above 0);
        /// Standard deviation of the heading of a fast object.
        pub history_heading_sigma_rad: f64 = 0.1, "rad", (above 0);
        /// Standard deviation of the turn rate about zero.
        pub turn_rate_prior_radps: f64 = 0.3, "rad/s", (above 0);
        /// Speed at which a heading has a quarter of its weight, and above which the direction of
        /// motion gives a heading.
        pub heading_speed_mps: f64 = 2.0, "m/s", (above 0);
        /// Gauss-Newton iterations.
        pub smoothing_iterations: usize = 6, "iterations", (1 to 64);
        /// Iterations after which positions are weighted by their residuals.
        pub smoothing_plain_iterations: usize = 2, "iterations", (0 to 64);
        /// Residual at which a position has a quarter of its weight (Geman-McClure).
        pub smoothing_outlier_m: f64 = 1.0, "m", (above 0);
    }
}

raywake_core::params! {
    /// Search for the steady motion that makes a cloud crispest.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SearchParams {
        /// Time over which an unsteady motion is taken to be steady.
        pub unsteady_s: f64 = 1.0, "s", (above 0);
        /// Minimum number of returns.
        pub search_returns_min: usize = 10, "returns", (2 to 1500);
        /// Minimum time that the returns span.
        pub search_span_min_s: f32 = 0.2, "s", (above 0);
        /// Time around the middle of the returns that is used.
        pub search_span_max_s: f32 = 10.0, "s", (above 0);
        /// Number of returns that rays pass from which these weigh as much as all others together.
        pub search_edges: usize = 100, "returns", (1 to 500);
        /// Edge of a cell for the entropy; cells are twice as high.
        pub search_cell_m: f32 = 0.3, "m", (0.05 to 10);
        /// Maximum number of cells along an object: longer ones have larger cells.
        pub search_cells_along: f32 = 60.0, "cells", (1 to 1000);
        /// Lengths of the object by which its centroid may move along it while it is seen.
        pub search_lengths: f32 = 1.3, "lengths", (0 to 10);
        /// Additional error of the centroid's velocity.
        pub search_error_mps: f32 = 0.5, "m/s", (0 to 10);
        /// Number of finer lattices around the best velocity, each with half the step.
        pub search_refinements: usize = 2, "lattices", (0 to 10);
        /// Factor of the cells' edge from one lattice to the next finer one.
        pub search_cell_ratio: f32 = 0.7, "", (above 0 to 1);
        /// Number of steps that a finer lattice reaches either way.
        pub search_refined_steps: u32 = 2, "steps", (1 to 10);
    }
}

raywake_core::params! {
    /// The fixed-lag estimate: over the last 2.5 s, with every sweep.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct FixedLagParams {
        /// Gauss-Newton iterations per sweep.
        pub lag_iterations: usize = 2, "iterations", (1 to 10);
        /// Additional standard deviation of a return along its surface, at any length.
        pub lag_tangential_sigma_m: f64 = 0.5, "m", (0 to 10);
        /// Distance from all model points at which a new one is added.
        pub lag_point_spacing_m: f32 = 0.3, "m", (above 0);
        /// Factor of this distance when there is no room for more model points.
        pub lag_spacing_growth: f32 = 1.25, "", (1.01 to 10);
        /// Maximum number of returns that have left the window and still hold a model point.
        pub lag_prior_returns: f32 = 20.0, "returns", (1 to 1000);
        /// Standard deviation of the position at the start of the window.
        pub lag_prior_m: f64 = 0.1, "m", (above 0);
        /// Standard deviation of the heading at the start of the window.
        pub lag_prior_heading_rad: f64 = 0.02, "rad", (above 0);
        /// Standard deviation of the speed at the start of the window.
        pub lag_prior_speed_mps: f64 = 0.5, "m/s", (above 0);
        /// Standard deviation of the climb at the start of the window.
        pub lag_prior_climb_mps: f64 = 0.2, "m/s", (above 0);
        /// Standard deviation of the turn rate at the start of the window.
        pub lag_prior_turn_rate_radps: f64 = 0.05, "rad/s", (above 0);
        /// Age below which other starts are tried with every sweep.
        pub young_s: f64 = 1.5, "s", (0 to 10);
        /// Displacement below which a young track counts as stationary; its heading is then
        /// unobservable and kept as it is.
        pub young_stationary_m: f64 = 0.5, "m", (0 to 10);
        /// Standard deviation of a return while the track is young.
        pub young_sigma_m: f64 = 0.15, "m", (above 0);
        /// Returns per model point while the track is young: with fewer, a model explains motion by
        /// separate points for every sweep.
        pub young_returns_per_point: usize = 6, "returns", (1 to 1000);
        /// Minimum number of model points while the track is young.
        pub young_points_min: usize = 12, "points", (1 to 3000);
        /// Maximum number of model points while the track is young.
        pub young_points_max: usize = 75, "points", (1 to 3000);
        /// Net backward displacement from which an object is turned round.
        pub reversed_m: f64 = 0.3, "m", (0 to 10);
        /// Cap on the object length by which the tracker's centroid may differ from the estimate.
        pub strayed_length_m: f64 = 15.0, "m", (0 to 100);
    }
}

impl EstimateParams {
    /// The dissertation's parameters (2.6.2).
    pub const DISSERTATION: EstimateParams = EstimateParams {
        basis_s: 0.5,
        return_sigma_m: 0.5,
        damping: false,
        surfaces: false,
        tangential_sigma_m: 0.0,
        multi_start: false,
        passing: false,
        reference_length_m: 0.0,
        turn_decay_s: f64::INFINITY,
        student_dof: 0.0,
        student_scale: 1.0,
        manoeuvre_s: 0.0,
        noise: ProcessNoise::DEFAULT,
        endpoints: EndpointParams { endpoint_sigma_m: 0.0, ..EndpointParams::DEFAULT },
        free_space: FreeSpaceParams { carving_rounds: 0, ..FreeSpaceParams::DEFAULT },
        growth: GrowthParams { growth: false, ..GrowthParams::DEFAULT },
        ..EstimateParams::DEFAULT
    };

    /// The parameters for an object of a given length, m; unchanged if it is unknown. Length
    /// implies agility: a tram neither brakes nor turns like a car, nor a car like a pedestrian.
    pub(super) fn for_length(&self, length_m: f32) -> EstimateParams {
        let mut params = *self;
        if self.reference_length_m > 0.0 && length_m > 0.0 {
            // No `clamp`: it panics if a user's bounds are the wrong way round.
            let length_m = f64::from(length_m).max(self.length_min_m).min(self.length_max_m);
            let shorter = self.reference_length_m / length_m;
            params.noise.turn_rate_sigma_radps *= shorter;
            params.noise.speed_sigma_mps *= shorter.min(1.0);
            params.basis_s *= shorter.recip().clamp(self.basis_ratio_min, 1.0);
            params.tangential_sigma_m *= shorter.recip().min(1.0);
            params.shape_sigma_m = params.shape_sigma_m.min(length_m);
        }
        params
    }

    /// The same with Gaussian noise only.
    pub(super) fn gaussian(&self) -> EstimateParams {
        EstimateParams { student_dof: 0.0, ..*self }
    }

    /// The same without endpoints.
    pub(super) fn without_endpoints(&self) -> EstimateParams {
        let endpoints = EndpointParams { endpoint_sigma_m: 0.0, ..self.endpoints };
        EstimateParams { endpoints, ..*self }
    }
}

impl FixedLagParams {
    /// Standard deviations of the state at the start of the window, by element.
    pub(super) fn prior_sigmas(&self) -> [f64; 7] {
        let m = self.lag_prior_m;
        let (heading, speed) = (self.lag_prior_heading_rad, self.lag_prior_speed_mps);
        [m, m, m, heading, speed, self.lag_prior_climb_mps, self.lag_prior_turn_rate_radps]
    }
}
