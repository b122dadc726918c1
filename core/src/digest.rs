//! A digest of results: 64-bit FNV-1a over little-endian bytes, with each return added in one step.
//! It tells whether two runs produced the same bits; it is not a cryptographic hash.

#[cfg(feature = "pipeline")]
use crate::output::{ColumnFlow, PointFlow, TrackletState};

/// The prime of 64-bit FNV.
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// Odd factors, one for each pair of a return's words, so that no two pairs are interchangeable:
/// the fractional part of the golden ratio, times 1, 3 and 5.
#[cfg(feature = "pipeline")]
const ODD: [u64; 3] = [GOLDEN, GOLDEN.wrapping_mul(3), GOLDEN.wrapping_mul(5)];
#[cfg(feature = "pipeline")]
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A running digest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Digest::START
    }
}

impl Digest {
    /// The digest of no data.
    pub const START: Digest = Digest(0xcbf2_9ce4_8422_2325);

    /// Resumes from a [`Digest::value`].
    pub const fn resume(value: u64) -> Digest {
        Digest(value)
    }

    /// Returns the digest of some bytes.
    pub fn of(bytes: &[u8]) -> u64 {
        let mut d = Digest::default();
        for &b in bytes {
            d.byte(b);
        }
        d.0
    }

    #[inline]
    fn byte(&mut self, b: u8) {
        self.0 = (self.0 ^ b as u64).wrapping_mul(PRIME);
    }

    /// Adds a word, least significant byte first.
    #[inline]
    pub fn word(&mut self, w: u32) {
        w.to_le_bytes().into_iter().for_each(|b| self.byte(b));
    }

    /// Adds a number by its bits. Zeros of either sign are the same.
    #[inline]
    pub fn float(&mut self, v: f32) {
        self.word((v + 0.0).to_bits());
    }

    /// Adds a double-precision number by its bits, lower word first. Zeros of either sign are the
    /// same.
    #[inline]
    pub fn double(&mut self, v: f64) {
        (v + 0.0).to_bits().to_le_bytes().into_iter().for_each(|b| self.byte(b));
    }

    /// The digest so far.
    pub const fn value(&self) -> u64 {
        self.0
    }
}

#[cfg(feature = "pipeline")]
impl Digest {
    /// Adds a column's flow: cell, basis, displacement, its covariance, energy, velocity over
    /// ground, velocity relative to the vehicle, covariance, age, P(moves).
    pub fn column(&mut self, c: &ColumnFlow) {
        c.cell.iter().for_each(|v| self.word(*v as u32));
        self.word(c.basis as u32);
        c.displacement_cells.iter().for_each(|v| self.word(*v as u32));
        c.displacement_m.iter().for_each(|v| self.float(*v));
        c.displacement_covariance.iter().for_each(|v| self.float(*v));
        self.word(c.energy as u32);
        c.velocity_world_mps.iter().for_each(|v| self.float(*v));
        c.velocity_ego_mps.iter().for_each(|v| self.float(*v));
        c.covariance.iter().for_each(|v| self.float(*v));
        self.word(c.age);
        self.float(c.probability);
    }

    /// Adds a return's flow: velocity over ground, velocity relative to the vehicle, status,
    /// P(moves). There are ten times as many returns as columns, so each is first reduced to a sum
    /// of products that do not depend on one another, which is added in one step.
    #[inline]
    pub fn point(&mut self, p: &PointFlow) {
        let bits = |v: f32| u64::from((v + 0.0).to_bits());
        let [wx, wy] = p.velocity_world_mps.map(bits);
        let [ex, ey, ez] = p.velocity_ego_mps.map(bits);
        let pairs = [wx | wy << 32, ex | ey << 32, ez | bits(p.probability) << 32];
        let products = pairs.iter().zip(ODD).map(|(pair, odd)| {
            let product = pair.wrapping_mul(odd);
            product ^ product >> 32
        });
        let sum = products.fold(p.status as u64, u64::wrapping_add);
        self.0 = (self.0 ^ sum).wrapping_mul(PRIME).rotate_left(29);
    }

    /// Adds a tracklet: cell, position, heading, speed, turning rate, covariance, age,
    /// P(moves).
    pub fn tracklet(&mut self, t: &TrackletState) {
        t.cell.iter().for_each(|v| self.word(*v as u32));
        t.position_vehicle_m.iter().for_each(|v| self.float(*v));
        [t.heading_rad, t.speed_mps, t.turn_rate_radps].iter().for_each(|v| self.float(*v));
        t.covariance.iter().flatten().for_each(|v| self.float(*v));
        self.word(t.age);
        self.float(t.probability);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(Digest::of(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(Digest::of(b"a"), 0xaf63_dc4c_8601_ec8c);
        let mut d = Digest::default();
        d.word(u32::from_le_bytes(*b"a\0\0\0"));
        assert_eq!(d.value(), Digest::of(b"a\0\0\0"));
        let (mut p, mut n) = (Digest::default(), Digest::default());
        p.float(0.0);
        n.float(-0.0);
        assert_eq!(p, n);
    }

    #[cfg(feature = "pipeline")]
    #[test]
    fn digest_covers_every_field_of_a_return() {
        use crate::output::{PointFlow, Status};
        let plain = PointFlow { probability: 0.25, ..PointFlow::default() };
        let of = |points: &[PointFlow]| {
            let mut digest = Digest::default();
            points.iter().for_each(|p| digest.point(p));
            digest.value()
        };
        let mut changed = [plain; 8];
        changed[1].velocity_world_mps[0] = 1.0;
        changed[2].velocity_world_mps[1] = 1.0;
        changed[3].velocity_ego_mps[0] = 1.0;
        changed[4].velocity_ego_mps[1] = 1.0;
        changed[5].velocity_ego_mps[2] = 1.0;
        changed[6].status = Status::Moving;
        changed[7].probability = 0.25f32.next_up();
        let mut digests = changed.map(|p| of(&[p])).to_vec();
        digests.extend([of(&[plain, changed[1]]), of(&[changed[1], plain])]);
        digests.sort_unstable();
        digests.dedup();
        assert_eq!(digests.len(), 10);
        let minus = PointFlow { velocity_world_mps: [-0.0; 2], ..plain };
        assert_eq!(of(&[minus]), of(&[plain]));
    }
}
