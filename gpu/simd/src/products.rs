//! Sums of products, for several cells that share weights.

/// For every instruction set. Vectorised by the compiler, which keeps the sums in memory.
#[inline(always)]
pub(crate) fn add_all<const IN: usize, const OUT: usize>(
    weights: &[[[i16; 2]; OUT]],
    inputs: &[[i16; IN]],
    sums: &mut [[i32; OUT]],
) {
    for (inputs, sums) in inputs.iter().zip(sums) {
        for (x, weights) in inputs.as_chunks().0.iter().zip(weights) {
            let [a, b] = x.map(i32::from);
            for (sum, [v, w]) in sums.iter_mut().zip(weights) {
                *sum += a * i32::from(*v) + b * i32::from(*w);
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use wide::avx2;

#[cfg(target_arch = "x86_64")]
mod wide {
    use core::arch::x86_64::{
        __m256i, _mm256_add_epi32, _mm256_loadu_si256, _mm256_madd_epi16, _mm256_set1_epi32,
        _mm256_storeu_si256,
    };
    use core::array::from_fn;

    /// Sums in a vector.
    const LANES: usize = 8;

    /// The same for AVX2, with the sums of some cells in registers: 6 to 12 of the 16 there are,
    /// beside the inputs and a weight. Other numbers of cells were not measured.
    #[target_feature(enable = "avx2")]
    pub(crate) fn avx2<const IN: usize, const OUT: usize>(
        weights: &[[[i16; 2]; OUT]],
        inputs: &[[i16; IN]],
        sums: &mut [[i32; OUT]],
    ) {
        match (OUT % LANES, OUT / LANES) {
            (0, 2) => cells::<4, 2, IN, OUT>(weights, inputs, sums),
            (0, 3) => cells::<2, 3, IN, OUT>(weights, inputs, sums),
            (0, 4) => cells::<2, 4, IN, OUT>(weights, inputs, sums),
            (0, 6) => cells::<2, 6, IN, OUT>(weights, inputs, sums),
            _ => super::add_all(weights, inputs, sums),
        }
    }

    /// For `CELLS` cells at a time, whose sums are `VECTORS` vectors each.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn cells<const CELLS: usize, const VECTORS: usize, const IN: usize, const OUT: usize>(
        weights: &[[[i16; 2]; OUT]],
        inputs: &[[i16; IN]],
        sums: &mut [[i32; OUT]],
    ) {
        assert!(OUT == LANES * VECTORS);
        let (inputs, inputs_left) = inputs.as_chunks::<CELLS>();
        let (sums, sums_left) = sums.as_chunks_mut::<CELLS>();
        for (inputs, sums) in inputs.iter().zip(sums) {
            let mut totals: [[__m256i; VECTORS]; CELLS] =
                from_fn(|c| from_fn(|v| load(&sums[c].as_chunks().0[v])));
            let inputs: [&[[i16; 2]]; CELLS] = from_fn(|c| inputs[c].as_chunks().0);
            for (p, weights) in weights.iter().enumerate() {
                let x: [__m256i; CELLS] = from_fn(|c| {
                    let [a, b] = inputs[c][p].map(|x| u32::from(x as u16));
                    _mm256_set1_epi32((a | b << 16) as i32)
                });
                for (v, weights) in weights.as_chunks().0.iter().enumerate() {
                    let weights = load_pairs(weights);
                    for c in 0..CELLS {
                        let products = _mm256_madd_epi16(x[c], weights);
                        totals[c][v] = _mm256_add_epi32(totals[c][v], products);
                    }
                }
            }
            for (totals, sums) in totals.iter().zip(sums) {
                let (sums, _) = sums.as_chunks_mut();
                totals.iter().zip(sums).for_each(|(total, sums)| store(*total, sums));
            }
        }
        super::add_all(weights, inputs_left, sums_left);
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn load(from: &[i32; LANES]) -> __m256i {
        // SAFETY: that many bytes are read, which need no alignment.
        unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn load_pairs(from: &[[i16; 2]; LANES]) -> __m256i {
        // SAFETY: that many bytes are read, which need no alignment.
        unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn store(from: __m256i, to: &mut [i32; LANES]) {
        // SAFETY: that many bytes are written, which need no alignment.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), from) }
    }
}
