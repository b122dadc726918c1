//! The results of an estimator as plain records: the same in C and in NumPy.

use bytemuck::{Pod, Zeroable};
use raywake_core::encoder::ColumnClass;
use raywake_core::output::{ColumnFlow, PointFlow, TrackletState};
use raywake_objects::tracked::TrackedObject;

/// Class of a column or return that has none.
pub const NO_CLASS: u8 = 255;

const _: () = assert!(NO_CLASS == ColumnClass::NONE);

/// Flow of one solid column of a pair's first sweep.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ColumnRecord {
    /// Centre in the world (the frame of the poses), m.
    pub position_world_m: [f64; 2],
    /// Lattice index; cell (0, 0) lies at the vehicle in the first sweep.
    pub cell: [i32; 2],
    /// Centre in the vehicle frame, m.
    pub position_vehicle_m: [f32; 2],
    /// Displacement over ground until the second sweep, along world axes, m.
    pub displacement_m: [f32; 2],
    /// Its covariance (xx, xy, yy), m^2.
    pub displacement_covariance: [f32; 3],
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 2],
    /// Covariance of the velocity over ground (xx, xy, yy), (m/s)^2.
    pub velocity_covariance: [f32; 3],
    /// P(moves).
    pub probability: f32,
    /// Observations of its tracklet after birth.
    pub age: u32,
    /// Source of the flow: 0 background, 1 unmatched, 2 matched, 3 joined (with its cluster).
    pub basis: u8,
    /// 0 ground, 1 structure, 2 vegetation, 3 pole, 4 car, 5 large vehicle, 6 person,
    /// 7 two-wheeler; 255: none.
    pub class_id: u8,
    /// Always 0.
    pub reserved: [u8; 6],
}

/// Flow of one return of a pair's first sweep.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PointRecord {
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 3],
    /// Covariance of the velocity over ground (xx, xy, yy), (m/s)^2.
    pub velocity_covariance: [f32; 3],
    /// P(moves).
    pub probability: f32,
    /// Observations of its column's tracklet after birth.
    pub age: u32,
    /// Outcome: 0 static, 1 moving, 2 unmatched, 3 outside the window, 4 over capacity, 5 own
    /// vehicle, 6 no echo, 7 invalid.
    pub status: u8,
    /// As for a column.
    pub basis: u8,
    /// As for a column.
    pub class_id: u8,
    /// Always 0.
    pub reserved: u8,
}

/// A flow tracklet, at the time of the last sweep.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TrackletRecord {
    /// Position in the world, m.
    pub position_world_m: [f64; 2],
    /// Lattice cell it lies in.
    pub cell: [i32; 2],
    /// Position in the vehicle frame, m.
    pub position_vehicle_m: [f32; 2],
    /// Heading of its motion in the world, rad.
    pub heading_rad: f32,
    /// Speed over ground along the heading, m/s.
    pub speed_mps: f32,
    /// Turning rate, rad/s.
    pub turn_rate_radps: f32,
    /// P(moves), as last observed.
    pub probability: f32,
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 2],
    /// Covariance of x, y, heading, speed and turning rate, row by row.
    pub covariance: [f32; 25],
    /// Observations after birth.
    pub age: u32,
}

/// An object in a pair's first sweep: a box with a velocity.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ObjectRecord {
    /// When it was last seen, s: before the sweep's stamp if it was not seen in the sweep.
    pub time_s: f64,
    /// Centre of its box in the world (the frame of the poses), m.
    pub position_world_m: [f64; 3],
    /// Direction of its length in the world, rad. If it is stationary, either end may be the front.
    pub heading_rad: f32,
    /// Length, width and height of the part that was seen, m.
    pub size_m: [f32; 3],
    /// Velocity over ground along world axes, m/s; 0 if it is stationary.
    pub velocity_world_mps: [f32; 2],
    /// Turning rate, rad/s.
    pub turn_rate_radps: f32,
    /// Covariance of its position (xx, xy, yy) and variance of its height, m^2.
    pub position_covariance: [f32; 4],
    /// Variance of the heading, rad^2.
    pub heading_variance: f32,
    /// Variance of the speed, (m/s)^2.
    pub speed_variance: f32,
    /// Variance of the turning rate, (rad/s)^2.
    pub turn_rate_variance: f32,
    /// P(moves), the mean over its returns; NaN if unknown.
    pub probability: f32,
    /// Share of its returns that have its class, 0 to 1.
    pub class_share: f32,
    /// Number of its track, from 0 in order of birth.
    pub id: u32,
    /// Number of times it was seen.
    pub observations: u32,
    /// 1: moving; 0: stationary.
    pub moves: u8,
    /// As for a column: the class of most of its returns.
    pub class_id: u8,
    /// Always 0.
    pub reserved: [u8; 6],
}

impl From<&TrackedObject> for ObjectRecord {
    fn from(o: &TrackedObject) -> ObjectRecord {
        let (class, share) = o.class.unzip();
        ObjectRecord {
            time_s: o.time_s,
            position_world_m: o.centre,
            heading_rad: o.heading as f32,
            size_m: o.size,
            velocity_world_mps: o.velocity.unwrap_or_default().map(|v| v as f32),
            turn_rate_radps: o.turn_rate as f32,
            position_covariance: o.variances.position,
            heading_variance: o.variances.heading,
            speed_variance: o.variances.speed,
            turn_rate_variance: o.variances.turn_rate,
            probability: o.p_moves.unwrap_or(f32::NAN),
            class_share: share.unwrap_or(0.0),
            id: o.id,
            observations: o.observations,
            moves: o.velocity.is_some().into(),
            class_id: ColumnClass::number(class),
            reserved: [0; 6],
        }
    }
}

impl From<&ColumnFlow> for ColumnRecord {
    fn from(c: &ColumnFlow) -> ColumnRecord {
        ColumnRecord {
            position_world_m: c.position_world_m,
            cell: c.cell,
            position_vehicle_m: c.position_vehicle_m,
            displacement_m: c.displacement_m,
            displacement_covariance: c.displacement_covariance,
            velocity_world_mps: c.velocity_world_mps,
            velocity_ego_mps: c.velocity_ego_mps,
            velocity_covariance: c.covariance,
            probability: c.probability,
            age: c.age,
            basis: c.basis as u8,
            class_id: ColumnClass::number(c.class),
            reserved: [0; 6],
        }
    }
}

impl From<PointFlow> for PointRecord {
    #[inline]
    fn from(p: PointFlow) -> PointRecord {
        PointRecord {
            velocity_world_mps: p.velocity_world_mps,
            velocity_ego_mps: p.velocity_ego_mps,
            velocity_covariance: p.covariance,
            probability: p.probability,
            age: p.age,
            status: p.status as u8,
            basis: p.basis as u8,
            class_id: ColumnClass::number(p.class),
            reserved: 0,
        }
    }
}

impl From<TrackletState> for TrackletRecord {
    fn from(t: TrackletState) -> TrackletRecord {
        let mut covariance = [0.0; 25];
        covariance.copy_from_slice(t.covariance.as_flattened());
        TrackletRecord {
            position_world_m: t.position_world_m,
            cell: t.cell,
            position_vehicle_m: t.position_vehicle_m,
            heading_rad: t.heading_rad,
            speed_mps: t.speed_mps,
            turn_rate_radps: t.turn_rate_radps,
            probability: t.probability,
            velocity_world_mps: t.velocity_world_mps,
            velocity_ego_mps: t.velocity_ego_mps,
            covariance,
            age: t.age,
        }
    }
}
