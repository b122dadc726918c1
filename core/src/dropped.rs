//! Returns left out of a sweep: invalid, too far away, or too many.

use crate::sweep::{Point, Rig};

/// The kind of a return, determined before it is placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnKind {
    /// From something around the vehicle.
    Valid,
    /// On the ego vehicle.
    OwnVehicle,
    /// Contains a NaN or an infinity.
    NotFinite,
    /// At exactly (0, 0, 0), a sensor's way of reporting no echo.
    NoEcho,
    /// From a sensor the rig does not have.
    UnknownSensor,
}

impl ReturnKind {
    /// Returns the kind of a return.
    #[inline(always)]
    pub fn of(rig: &Rig, point: &Point) -> ReturnKind {
        let ([x, y, z], offset_s) = (point.position, point.offset_s);
        // Without a branch per number: almost all are finite.
        let is_finite = x.is_finite() & y.is_finite() & z.is_finite() & offset_s.is_finite();
        if !is_finite {
            ReturnKind::NotFinite
        } else if x == 0.0 && y == 0.0 && z == 0.0 {
            ReturnKind::NoEcho
        } else if point.sensor as usize >= rig.sensors.len() {
            ReturnKind::UnknownSensor
        } else if rig.is_own_vehicle(point.position) {
            ReturnKind::OwnVehicle
        } else {
            ReturnKind::Valid
        }
    }
}

/// How many returns were left out, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DroppedReturns {
    /// Returns beyond a sweep's [`returns_max`](crate::params::Profile::returns_max): the sweep was
    /// thinned evenly.
    pub over_capacity: u64,
    /// Returns with a NaN or an infinity.
    pub not_finite: u64,
    /// Returns at exactly (0, 0, 0).
    pub no_return: u64,
    /// Returns more than [`EXTENT_VOXELS`](crate::params::EXTENT_VOXELS) voxels from the window's
    /// corner along an axis.
    pub too_far: u64,
    /// Returns from a sensor the rig does not have.
    pub unknown_sensor: u64,
    /// Returns on the ego vehicle: their rays count as free space, with no end point.
    pub own_vehicle: u64,
}

impl core::ops::AddAssign for DroppedReturns {
    fn add_assign(&mut self, more: DroppedReturns) {
        self.over_capacity += more.over_capacity;
        self.not_finite += more.not_finite;
        self.no_return += more.no_return;
        self.too_far += more.too_far;
        self.unknown_sensor += more.unknown_sensor;
        self.own_vehicle += more.own_vehicle;
    }
}

impl DroppedReturns {
    /// Nothing left out yet.
    pub const ZERO: DroppedReturns = DroppedReturns {
        over_capacity: 0,
        not_finite: 0,
        no_return: 0,
        too_far: 0,
        unknown_sensor: 0,
        own_vehicle: 0,
    };

    /// Returns whether a valid return lies on the ego vehicle (not counted here); counts an invalid
    /// one and returns `None`.
    #[inline(always)]
    pub fn admit(&mut self, rig: &Rig, point: &Point) -> Option<bool> {
        match ReturnKind::of(rig, point) {
            ReturnKind::Valid => return Some(false),
            ReturnKind::OwnVehicle => return Some(true),
            ReturnKind::NotFinite => self.not_finite += 1,
            ReturnKind::NoEcho => self.no_return += 1,
            ReturnKind::UnknownSensor => self.unknown_sensor += 1,
        }
        None
    }

    /// The number of returns for which no ray is cast.
    pub fn without_ray(&self) -> u64 {
        let invalid = self.not_finite + self.no_return + self.unknown_sensor;
        self.over_capacity + self.too_far + invalid
    }

    /// Every count with its field name and a human-readable name.
    pub fn counts(&self) -> [(&'static str, &'static str, u64); 6] {
        [
            ("over_capacity", "over capacity", self.over_capacity),
            ("not_finite", "not finite", self.not_finite),
            ("no_return", "without an echo", self.no_return),
            ("too_far", "too far", self.too_far),
            ("unknown_sensor", "from an unknown sensor", self.unknown_sensor),
            ("own_vehicle", "on the ego vehicle", self.own_vehicle),
        ]
    }
}
