//! A digest of results: 64-bit FNV-1a over little-endian bytes. It tells whether two runs put out
//! the same bits; it is no protection against anybody.

#[cfg(feature = "pipeline")]
use crate::output::{ColumnFlow, TrackletState};

/// A running digest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Digest(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    /// Digest of some bytes.
    pub fn of(bytes: &[u8]) -> u64 {
        let mut d = Digest::default();
        for &b in bytes {
            d.byte(b);
        }
        d.0
    }

    #[inline]
    fn byte(&mut self, b: u8) {
        self.0 = (self.0 ^ b as u64).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// Adds a word, least significant byte first.
    #[inline]
    pub fn word(&mut self, w: u32) {
        w.to_le_bytes().into_iter().for_each(|b| self.byte(b));
    }

    /// Adds a number by its bits. The zeros of both signs are one.
    #[inline]
    pub fn float(&mut self, v: f32) {
        self.word((v + 0.0).to_bits());
    }

    /// Adds a number in double precision by its bits, the lower word first. The zeros of both signs
    /// are one.
    #[inline]
    pub fn double(&mut self, v: f64) {
        (v + 0.0).to_bits().to_le_bytes().into_iter().for_each(|b| self.byte(b));
    }

    /// The digest so far.
    pub fn value(&self) -> u64 {
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
}
