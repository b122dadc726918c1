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

#[cfg(all(target_arch = "x86_64", feature = "detect"))]
pub(crate) use wide::{avx2, avx512};

#[cfg(all(target_arch = "x86_64", feature = "detect"))]
mod wide {
    use core::arch::x86_64::{
        __m256i, _mm256_add_epi32, _mm256_dpwssd_epi32, _mm256_loadu_si256, _mm256_madd_epi16,
        _mm256_set1_epi32, _mm256_storeu_si256,
    };
    use core::array::from_fn;

    /// Sums in a vector.
    const LANES: usize = 8;

    /// Declares [`super::add_all`] for an instruction set, with sums in registers. `cells` lists
    /// how many cells are computed at a time if the sums of one fill 1, 2, 3, 4 and 6 vectors;
    /// `add` adds the products of two vectors of pairs to a vector of sums.
    macro_rules! products {
        ($name:ident, $features:literal, cells: $cells:expr, add: $add:expr) => {
            #[target_feature(enable = $features)]
            pub(crate) fn $name<const IN: usize, const OUT: usize>(
                weights: &[[[i16; 2]; OUT]],
                inputs: &[[i16; IN]],
                sums: &mut [[i32; OUT]],
            ) {
                /// The sums that fill `VECTORS` vectors, for `CELLS` cells at a time, then singly.
                #[inline]
                #[target_feature(enable = $features)]
                fn cells<
                    const CELLS: usize,
                    const VECTORS: usize,
                    const IN: usize,
                    const OUT: usize,
                >(
                    weights: &[[[i16; 2]; OUT]],
                    inputs: &[[i16; IN]],
                    sums: &mut [[i32; OUT]],
                ) {
                    assert!(OUT / LANES == VECTORS);
                    let (inputs, inputs_left) = inputs.as_chunks::<CELLS>();
                    let (sums, sums_left) = sums.as_chunks_mut::<CELLS>();
                    for (inputs, sums) in inputs.iter().zip(sums) {
                        let mut totals: [[__m256i; VECTORS]; CELLS] =
                            from_fn(|c| from_fn(|v| load(&sums[c].as_chunks().0[v])));
                        let inputs: [&[[i16; 2]]; CELLS] = from_fn(|c| inputs[c].as_chunks().0);
                        for (p, weights) in weights.iter().enumerate() {
                            let x: [__m256i; CELLS] = from_fn(|c| everywhere(inputs[c][p]));
                            for (v, weights) in weights.as_chunks().0.iter().enumerate() {
                                let weights = load_pairs(weights);
                                for c in 0..CELLS {
                                    totals[c][v] = $add(totals[c][v], x[c], weights);
                                }
                            }
                        }
                        for (totals, sums) in totals.iter().zip(sums) {
                            let (sums, _) = sums.as_chunks_mut();
                            totals.iter().zip(sums).for_each(|(total, sums)| store(*total, sums));
                        }
                    }
                    if CELLS > 1 {
                        cells::<1, VECTORS, IN, OUT>(weights, inputs_left, sums_left);
                    }
                }

                const CELLS: [usize; 5] = $cells;
                match OUT / LANES {
                    1 => cells::<{ CELLS[0] }, 1, IN, OUT>(weights, inputs, sums),
                    2 => cells::<{ CELLS[1] }, 2, IN, OUT>(weights, inputs, sums),
                    3 => cells::<{ CELLS[2] }, 3, IN, OUT>(weights, inputs, sums),
                    4 => cells::<{ CELLS[3] }, 4, IN, OUT>(weights, inputs, sums),
                    6 => cells::<{ CELLS[4] }, 6, IN, OUT>(weights, inputs, sums),
                    _ => return super::add_all(weights, inputs, sums),
                }
                add_from(OUT - OUT % LANES, weights, inputs, sums);
            }
        };
    }

    // 4 to 12 of the 16 registers, beside the inputs and a weight. Others were not measured.
    products!(avx2, "avx2", cells: [4, 4, 2, 2, 2], add: madd);

    // 8 to 24 of the 32 registers. With half as many cells, the encoder takes 3 % longer (KITTI
    // drive 0005, one core of an AMD EPYC, Zen 5). 24 sums do not fill vectors twice as wide.
    products!(
        avx512,
        "avx2,avx512vl,avx512vnni",
        cells: [8, 8, 4, 4, 4],
        add: _mm256_dpwssd_epi32
    );

    /// The same for the sums from `first` on: fewer than a vector.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn add_from<const IN: usize, const OUT: usize>(
        first: usize,
        weights: &[[[i16; 2]; OUT]],
        inputs: &[[i16; IN]],
        sums: &mut [[i32; OUT]],
    ) {
        for n in first..OUT {
            let of_sum: [i16; IN] = from_fn(|x| weights[x / 2][n][x % 2]);
            for (inputs, sums) in inputs.iter().zip(&mut *sums) {
                let products = inputs.iter().zip(&of_sum);
                sums[n] += products.map(|(x, w)| i32::from(*x) * i32::from(*w)).sum::<i32>();
            }
        }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn madd(sums: __m256i, a: __m256i, b: __m256i) -> __m256i {
        _mm256_add_epi32(sums, _mm256_madd_epi16(a, b))
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn everywhere(pair: [i16; 2]) -> __m256i {
        let [a, b] = pair.map(|x| u32::from(x as u16));
        _mm256_set1_epi32((a | b << 16) as i32)
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
