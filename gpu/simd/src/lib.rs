//! Instruction sets of the processor, chosen at run time.
//!
//! A program for x86-64 can only rely on the instructions of 2003, SSE2. [`Simd::run`] calls a
//! function compiled again, for AVX2 and for AVX-512, if the processor has those;
//! [`Simd::add_products`] is written for them by hand, in integers. Only the width differs: no sum
//! is taken in another order and nothing is contracted to a fused multiply-add, so that every bit
//! of a result is the same. On aarch64 the baseline is NEON. `RESULTS.md` has what AVX-512
//! saves.

#![no_std]
#![deny(missing_docs)]

#[cfg(feature = "detect")]
extern crate std;

/// An instruction set that this processor has: [`Simd::available`] makes it after checking, and
/// [`Simd::run`] passes it on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Simd(Width);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Width {
    Baseline,
    #[cfg(all(target_arch = "x86_64", feature = "detect"))]
    Avx2,
    #[cfg(all(target_arch = "x86_64", feature = "detect"))]
    Avx512,
}

/// Declares an instruction set by its features: whether the processor has them, and a function that
/// is compiled for them.
#[cfg(all(target_arch = "x86_64", feature = "detect"))]
macro_rules! compiled_for {
    ($name:ident, $width:ident: $($feature:tt)+) => {
        mod $name {
            use super::{Simd, Width};

            pub(super) fn is_available() -> bool {
                true $(&& std::is_x86_feature_detected!($feature))+
            }

            #[target_feature($(enable = $feature),+)]
            pub(super) fn run<R>(work: impl FnOnce(Simd) -> R) -> R {
                work(Simd(Width::$width))
            }
        }
    };
}

// x86-64-v3 without FMA, F16C and MOVBE.
#[cfg(all(target_arch = "x86_64", feature = "detect"))]
compiled_for!(avx2, Avx2: "avx2" "bmi1" "bmi2" "lzcnt" "popcnt");

// x86-64-v4 without MOVBE, and products of 16-bit integers. AVX-512 includes fused multiply-adds,
// but compilers contract nothing to them unless told to.
#[cfg(all(target_arch = "x86_64", feature = "detect"))]
compiled_for!(avx512, Avx512: "avx2" "bmi1" "bmi2" "lzcnt" "popcnt" "fma" "f16c" "avx512f"
    "avx512bw" "avx512cd" "avx512dq" "avx512vl" "avx512vnni");

impl Simd {
    /// What every processor of this architecture has.
    pub const BASELINE: Simd = Simd(Width::Baseline);

    /// The instruction sets that this processor has, the widest last.
    #[cfg(feature = "detect")]
    pub fn available() -> impl DoubleEndedIterator<Item = Simd> {
        #[cfg(target_arch = "x86_64")]
        let wide = [(avx2::is_available(), Width::Avx2), (avx512::is_available(), Width::Avx512)];
        #[cfg(not(target_arch = "x86_64"))]
        let wide = [];
        let wide = wide.into_iter().filter_map(|(has, width)| bool::then_some(has, Simd(width)));
        core::iter::once(Simd::BASELINE).chain(wide)
    }

    /// The widest one that this processor has.
    #[cfg(feature = "detect")]
    pub fn widest() -> Simd {
        Simd::available().next_back().unwrap_or(Simd::BASELINE)
    }

    /// Its name, in lower case.
    pub const fn name(self) -> &'static str {
        match self.0 {
            Width::Baseline if cfg!(target_arch = "x86_64") => "sse2",
            Width::Baseline if cfg!(target_arch = "aarch64") => "neon",
            Width::Baseline => "baseline",
            #[cfg(all(target_arch = "x86_64", feature = "detect"))]
            Width::Avx2 => "avx2",
            #[cfg(all(target_arch = "x86_64", feature = "detect"))]
            Width::Avx512 => "avx512",
        }
    }

    /// Adds to the sums of every cell the products of its inputs and the weights, which come in
    /// pairs of inputs: `inputs[c][2 p + k]` times `weights[p][n][k]` to `sums[c][n]`. No sum may
    /// overflow.
    ///
    /// # Panics
    /// If there are not half as many pairs as inputs, or not as many cells of inputs as of sums.
    #[inline(always)]
    pub fn add_products<const IN: usize, const OUT: usize>(
        self,
        weights: &[[[i16; 2]; OUT]],
        inputs: &[[i16; IN]],
        sums: &mut [[i32; OUT]],
    ) {
        assert!(2 * weights.len() == IN && inputs.len() == sums.len());
        match self.0 {
            // SAFETY: the processor has them, see `Simd`.
            #[cfg(all(target_arch = "x86_64", feature = "detect"))]
            Width::Avx2 => unsafe { products::avx2(weights, inputs, sums) },
            // SAFETY: likewise.
            #[cfg(all(target_arch = "x86_64", feature = "detect"))]
            Width::Avx512 => unsafe { products::avx512(weights, inputs, sums) },
            Width::Baseline => products::add_all(weights, inputs, sums),
        }
    }

    /// Does `work` with these instructions, and passes them on: what `work` does with that value
    /// needs no choice at run time. Code that is to use them must be inlined into `work`,
    /// and `work` itself too: put `#[inline(always)]` on the closure and on what it calls.
    #[inline(always)]
    pub fn run<R>(self, work: impl FnOnce(Simd) -> R) -> R {
        match self.0 {
            Width::Baseline => work(Simd::BASELINE),
            // SAFETY: the processor has them, see `Simd`.
            #[cfg(all(target_arch = "x86_64", feature = "detect"))]
            Width::Avx2 => unsafe { avx2::run(work) },
            // SAFETY: likewise.
            #[cfg(all(target_arch = "x86_64", feature = "detect"))]
            Width::Avx512 => unsafe { avx512::run(work) },
        }
    }
}

mod products;

/// The integer part of a number: saturates at 2^30 and -2^30; NaN yields -2^30.
///
/// Compilers vectorise this, which they do not do reliably with `as`, whose limits are not floats.
#[inline(always)]
pub fn integer_part(number: f32) -> i32 {
    const BOUND: f32 = (1 << 30) as f32;
    let number = if number > -BOUND { number } else { -BOUND };
    let number = if number < BOUND { number } else { BOUND };
    // SAFETY: it is neither NaN nor beyond the range of an i32.
    unsafe { number.to_int_unchecked() }
}

#[cfg(all(test, feature = "detect"))]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn integer_parts_equal_casts_within_the_bounds() {
        let some = [0.0, -0.0, 0.99, -0.99, 1.5, -2.5, 8_388_609.0, -1e9, 1_073_741_824.0];
        for number in some {
            assert_eq!(integer_part(number), number as i32, "{number}");
        }
        let beyond = [f32::INFINITY, 3e9, f32::NEG_INFINITY, -3e9, f32::NAN].map(integer_part);
        assert_eq!(beyond, [1 << 30, 1 << 30, -1 << 30, -1 << 30, -1 << 30]);
    }

    fn check_products<const OUT: usize>() {
        const IN: usize = 12;
        const CELLS: usize = 19;
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as i16
        };
        let weights: [[[i16; 2]; OUT]; IN / 2] =
            core::array::from_fn(|_| core::array::from_fn(|_| [next() / 8, next() / 8]));
        let inputs: [[i16; IN]; CELLS] =
            core::array::from_fn(|_| core::array::from_fn(|_| next() / 8));
        let wanted: [[i32; OUT]; CELLS] = core::array::from_fn(|cell| {
            core::array::from_fn(|n| {
                let weight = |at: usize| i32::from(weights[at / 2][n][at % 2]);
                5 + (0..IN).map(|at| i32::from(inputs[cell][at]) * weight(at)).sum::<i32>()
            })
        });
        for (simd, cells) in Simd::available().flat_map(|simd| (0..=CELLS).map(move |n| (simd, n)))
        {
            let mut sums = [[5; OUT]; CELLS];
            simd.run(
                #[inline(always)]
                |simd| simd.add_products(&weights, &inputs[..cells], &mut sums[..cells]),
            );
            assert_eq!(sums[..cells], wanted[..cells], "{}, {OUT} sums", simd.name());
            assert!(sums[cells..].iter().flatten().all(|sum| *sum == 5));
        }
    }

    #[test]
    fn products_are_the_same_for_any_number_of_sums_and_cells() {
        check_products::<3>();
        check_products::<8>();
        check_products::<9>();
        check_products::<15>();
        check_products::<16>();
        check_products::<24>();
        check_products::<29>();
        check_products::<32>();
        check_products::<40>();
        check_products::<48>();
        check_products::<53>();
    }

    #[inline(always)]
    fn sums(values: &[f32]) -> [f32; 8] {
        let mut sums = [0.0; 8];
        for values in values.as_chunks::<8>().0 {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += *value * 1.1;
            }
        }
        sums
    }

    #[test]
    fn each_set_yields_the_same_bits() {
        let values: Vec<f32> = (0..800).map(|n| 0.1 + (n as f32) / 7.0).collect();
        let plain = sums(&values).map(f32::to_bits);
        for simd in Simd::available() {
            let found = simd.run(
                #[inline(always)]
                |_| sums(&values),
            );
            assert_eq!(found.map(f32::to_bits), plain, "{}", simd.name());
        }
    }

    #[test]
    fn the_widest_is_the_last() {
        let names: Vec<&str> = Simd::available().map(Simd::name).collect();
        // To be seen with `--nocapture`: what this processor has was tested.
        std::println!("{names:?}");
        if cfg!(target_arch = "x86_64") {
            assert!(["sse2", "avx2", "avx512"].starts_with(&names));
        } else {
            assert_eq!(names, [Simd::BASELINE.name()]);
        }
        assert_eq!(names.last(), Some(&Simd::widest().name()));
    }
}
