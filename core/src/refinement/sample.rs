//! A return as it is registered, and what is known about its surface.

/// Information about the surface a return lies on, the upper triangle of a symmetric matrix: the
/// inverse of the covariance of the returns around it plus that of their noise, relative to the
/// noise alone. 1 across a surface, little along it: point-to-plane without fitting a plane
/// (generalised ICP).
pub type SurfaceWeight = [f32; 6];

/// A return of a cluster.
#[derive(Clone, Copy, Debug, Default)]
pub struct CloudPoint {
    /// Voxels from the window's corner of its sweep.
    pub at: [f32; 3],
    /// Sensor that saw it.
    pub sensor: u32,
    /// When, s after the stamp of its sweep.
    pub offset_s: f32,
    /// Its index in the cloud of its sweep.
    pub index: u32,
}

/// Squared distance across the surface, voxels².
pub fn squared_distance(weight: &SurfaceWeight, [x, y, z]: [f32; 3]) -> f32 {
    let [xx, xy, xz, yy, yz, zz] = *weight;
    x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z
}

/// A difference weighted by what is known across each direction.
pub fn weighed(weight: &SurfaceWeight, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let [xx, xy, xz, yy, yz, zz] = *weight;
    [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
}

pub fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A running mean, 0 if empty.
#[derive(Clone, Copy, Default)]
pub struct Mean {
    sum: f32,
    pub count: f32,
}

impl Mean {
    pub fn add(&mut self, value: f32) {
        self.add_weighted(value, 1.0);
    }

    pub fn add_weighted(&mut self, value: f32, times: f32) {
        self.sum += times * value;
        self.count += times;
    }

    pub fn include(&mut self, other: Mean) {
        self.sum += other.sum;
        self.count += other.count;
    }

    pub fn value(&self) -> f32 {
        self.value_with(0.0)
    }

    /// The mean once this many zeros have been added.
    pub fn value_with(&self, zeros: f32) -> f32 {
        self.sum / (self.count + zeros).max(1.0)
    }
}
