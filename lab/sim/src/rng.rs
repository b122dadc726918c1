//! A tiny random generator (splitmix64): the simulator's only source of randomness, so that one
//! seed gives one drive.

/// Splitmix64 (Steele, Lea and Flood 2014): 64 bits of state, enough for scenery and noise.
#[derive(Clone, Debug)]
pub struct Rng {
    state: u64,
}

/// The finaliser of splitmix64: a bijection that scatters neighbouring numbers.
fn scatter(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl Rng {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Rng {
        Rng { state: scatter(seed ^ 0x9E37_79B9_7F4A_7C15) }
    }

    /// A separate stream for part `index` of a seed, so that what one part draws does not affect
    /// what another draws (columns cast by different threads, for example).
    pub fn split(seed: u64, index: u64) -> Rng {
        Rng::new(scatter(seed).wrapping_add(scatter(index ^ 0xD1B5_4A32_D192_ED03)))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        scatter(self.state)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [from, to).
    pub fn range(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    /// Returns true with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// -1 or +1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Bell-shaped with mean 0 and standard deviation 1: the sum of four uniforms, which needs no
    /// transcendental function and never exceeds 3.5 in magnitude.
    pub fn bell(&mut self) -> f64 {
        let (a, b) = (self.bits(), self.bits());
        let parts = [a >> 32, a & 0xFFFF_FFFF, b >> 32, b & 0xFFFF_FFFF];
        let sum: f64 = parts.iter().map(|&p| p as f64 / 4_294_967_296.0).sum();
        // Four uniforms have variance 4/12.
        (sum - 2.0) * 1.732_050_807_568_877_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments() {
        let mut rng = Rng::new(7);
        let n = 100_000;
        let (mut mean, mut square, mut unit) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            let b = rng.bell();
            mean += b / n as f64;
            square += b * b / n as f64;
            unit += rng.unit() / n as f64;
        }
        assert!(mean.abs() < 0.02 && (square - 1.0).abs() < 0.03 && (unit - 0.5).abs() < 0.01);
    }

    #[test]
    fn streams_differ() {
        let a = Rng::split(1, 0).bits();
        assert_ne!(a, Rng::split(1, 1).bits());
        assert_ne!(a, Rng::split(2, 0).bits());
        assert_eq!(a, Rng::split(1, 0).bits());
    }
}
