//! The refinement's parameters as used internally: lengths in voxels.

use crate::params::{CLUSTER_LEVELS_MAX, Profile, REACH, RefinementParams, SUBVOXELS_MAX};

/// Parameters of a profile, with lengths in voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scaled {
    /// The original parameters, for those that are not lengths.
    pub params: RefinementParams,
    voxel_m: f64,
    pub ground_height: f32,
    pub height_min: f32,
    pub height_max: f32,
    /// Sub-voxels along an axis.
    pub subvoxels: usize,
    pub gap_levels: u32,
    pub extent_max: f32,
    pub surface_radius: f32,
    pub surface_radius_wide: f32,
    /// Voxels².
    pub surface_line: f32,
    pub return_sigma: f32,
    pub match_distance: f32,
    pub kernel_wide: f32,
    pub kernel: f32,
    pub converged: f32,
    /// Voxels^-2.
    pub hold_information: f32,
    pub inlier: f32,
    pub truncation: f32,
    sight_distance: f32,
    pub evidence_length: f32,
    pub displacement_min: f32,
    pub start_spacing: f32,
    /// Columns.
    pub fragment_distance: usize,
    pub footprint_margin: f32,
    pub static_sigma: f32,
    /// Voxels².
    pub confidence: f32,
    pub range_min: f32,
}

impl Scaled {
    pub fn new(profile: &Profile) -> Scaled {
        let (p, r) = (profile.refinement, profile.voxel_m);
        let length = |metres: f64| (metres / r) as f32;
        let area = |square_metres: f64| (square_metres / (r * r)) as f32;
        let whole = |metres: f64| libm::round(metres / r) as u32;
        let hold = r / p.hold_sigma_m;
        Scaled {
            params: p,
            voxel_m: r,
            ground_height: length(p.ground_height_m),
            height_min: length(p.cluster_height_min_m),
            height_max: length(p.cluster_height_max_m).min(CLUSTER_LEVELS_MAX as f32),
            subvoxels: (libm::round(r / p.thinning_m) as usize).clamp(1, SUBVOXELS_MAX),
            gap_levels: whole(p.cluster_gap_m),
            extent_max: length(p.cluster_extent_max_m),
            surface_radius: length(p.surface_radius_m),
            surface_radius_wide: length(p.surface_radius_wide_m),
            surface_line: area(p.surface_line_m2),
            return_sigma: length(p.return_sigma_m),
            match_distance: length(p.match_distance_m).min(1.0),
            kernel_wide: length(p.kernel_wide_m),
            kernel: length(p.kernel_m),
            converged: length(p.converged_m),
            hold_information: (hold * hold) as f32,
            inlier: length(p.inlier_m),
            truncation: length(p.truncation_m),
            sight_distance: length(p.sight_distance_m),
            evidence_length: length(p.evidence_length_m),
            displacement_min: length(p.displacement_min_m),
            start_spacing: length(p.start_spacing_m),
            fragment_distance: whole(p.fragment_distance_m) as usize,
            footprint_margin: length(p.footprint_margin_m),
            static_sigma: length(p.static_sigma_m),
            confidence: area(p.confidence_m2),
            range_min: length(p.range_min_m),
        }
    }

    /// How close a ray must pass to a place at this distance to say anything about it, voxels.
    pub fn sight_reach(&self, distance: f32) -> f32 {
        self.sight_distance.max(self.params.sight_angle_rad * distance)
    }

    /// How fast what starts may speed up, voxels per span², if a span is `span_s` seconds.
    pub fn acceleration(&self, span_s: f64) -> f32 {
        (self.params.acceleration_mps2 * span_s * span_s / self.voxel_m) as f32
    }

    /// How far displacements over `span_s` seconds are searched either way, voxels.
    pub fn search_reach(&self, span_s: f64) -> i32 {
        let reach = libm::round(self.params.search_speed_mps * span_s / self.voxel_m);
        reach.min(REACH as f64) as i32
    }
}
