//! Records exchanged with the device, each declared once: the Rust struct, its words and its WGSL
//! text come from the same line. Everything else exchanged is a plain array of 32-bit words.

macro_rules! record {
    ($(#[$m:meta])* $name:ident { $( $(#[$fm:meta])* $f:ident ),* $(,)? }) => {
        $(#[$m])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name { $( $(#[$fm])* pub $f: i32 ),* }

        impl $name {
            /// Field names in order; field `n` is word `n`.
            pub const FIELDS: &'static [&'static str] = &[ $( stringify!($f) ),* ];
            /// Words of the record.
            pub const WORDS: usize = Self::FIELDS.len();
            /// Writes the record; `words` must hold [`Self::WORDS`] elements.
            pub fn write(&self, words: &mut [u32]) {
                let values = [ $( self.$f ),* ];
                for (word, value) in words.iter_mut().zip(values) {
                    *word = value as u32;
                }
            }
        }
    };
}

/// Packed elements, each declared once: the type and its line in `memory-layout.md`.
macro_rules! packed {
    ($( $(#[doc = $doc:literal])+ $name:ident = $ty:ty; )*) => {
        $( $(#[doc = $doc])+ pub type $name = $ty; )*

        /// Name, bytes and layout of every packed element.
        pub const PACKED: &[(&str, usize, &str)] =
            &[ $( (stringify!($name), size_of::<$ty>(), concat!($($doc),+)) ),* ];
    };
}

packed! {
    /// `[i | j << 16, k | origin << 16 | no_end << 31]`: a ray, with `i, j, k` the signed 16-bit
    /// voxel of its end counted from the window's corner, `origin` an index into the table of
    /// origins, and `no_end` set if nothing is hit there.
    Ray = [u32; 2];
    /// `[free | occupied << 16, solid]`: a column of voxels, one bit per level (3.4, 3.5, epsilon =
    /// 0).
    Column = [u32; 2];
    /// `1 << 31 | (du + REACH) << 8 | dv + REACH`: the flow of a column, cells; 0 if there is none.
    Flow = u32;
    /// `[flow, energy]`: what a column proposes in a round; flow 0 if no target is feasible.
    Proposal = [u32; 2];
    /// `[energy, place]`: the minimum energy of a column over all displacements, without smoothing,
    /// and its place in the column's row of costs.
    MinCost = [u32; 2];
    /// `[key, log-odds as i32]`: an update, or a voxel of the sparse map.
    Update = [u32; 2];
}

record! {
    /// What the kernels need to know about a sweep besides its rays: sizes, shift and costs.
    SweepUniform {
        /// Columns of the window along x, and along y.
        side,
        /// Levels of a column.
        levels,
        /// Rays of the sweep.
        rays,
        /// Maximum number of voxels for which a ray is traced.
        range_steps,
        /// Window corner of this sweep minus that of the previous sweep, cells along x.
        shift_x,
        /// Along y.
        shift_y,
        /// Along z.
        shift_z,
        /// 1: every solid column is foreground.
        unfiltered,
        /// w_p, thousandths of a nat per cell².
        smoothing,
        /// Cost of displacement, thousandths of a nat per cell².
        displacement_cost,
        /// Cost of a window neighbour outside the grid, thousandths of a nat.
        outside_cost,
        /// Minimum sum of the constancy weights: entry 0 of the table of log-sigmoids.
        score_min,
        /// Sparse map: first key of the band.
        band_from,
        /// Sparse map: key after the band's last.
        band_to,
    }
}

/// Flag of [`Ray`]: free space only.
pub const NO_END: u32 = 1 << 31;

/// Packs a ray.
#[inline]
pub fn ray(end: [i32; 3], origin: u32, no_end: bool) -> Ray {
    let [i, j, k] = end.map(|v| v as u32 & 0xffff);
    [i | j << 16, k | origin << 16 | (no_end as u32) << 31]
}

/// End voxel of a ray.
#[inline]
pub fn ray_end(r: Ray) -> [i32; 3] {
    [r[0] as i16 as i32, (r[0] >> 16) as i16 as i32, r[1] as i16 as i32]
}

/// Origin index of a ray.
#[inline]
pub fn ray_origin(r: Ray) -> usize {
    (r[1] >> 16 & 0x7fff) as usize
}

/// Flag of [`Flow`].
pub const VALID: u32 = 1 << 31;

/// Packs a valid displacement, cells.
#[inline]
pub fn pack_flow(d: [i32; 2]) -> Flow {
    let reach = crate::params::REACH;
    VALID | ((d[0] + reach) as u32) << 8 | (d[1] + reach) as u32
}

/// The displacement of a valid flow, cells.
#[inline]
pub fn flow_displacement(f: Flow) -> [i32; 2] {
    let reach = crate::params::REACH;
    [(f >> 8 & 0xff) as i32 - reach, (f & 0xff) as i32 - reach]
}

/// Whether a word is 0 or one that [`pack_flow`] makes.
pub fn is_flow(flow: Flow) -> bool {
    let most = 2 * crate::params::REACH as u32;
    let within = (flow >> 8 & 0x7f_ffff) <= most && (flow & 0xff) <= most;
    flow == 0 || (flow & VALID != 0 && within)
}

/// No index, no cost yet.
pub const NONE: u32 = u32::MAX;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_is_reversible() {
        let r = ray([-5, 4095, -4095], 511, true);
        assert_eq!(ray_end(r), [-5, 4095, -4095]);
        assert_eq!((ray_origin(r), r[1] & NO_END), (511, NO_END));
        for d in [[-15, 15], [0, 0], [7, -3]] {
            assert_eq!(flow_displacement(pack_flow(d)), d);
            assert!(is_flow(pack_flow(d)));
        }
        assert!(is_flow(0));
        for nonsense in [1, VALID | 31, VALID | 31 << 8, VALID | 1 << 16, u32::MAX] {
            assert!(!is_flow(nonsense), "{nonsense:x}");
        }
    }
}
