//! Boxes of large constants.

use std::mem::MaybeUninit;

/// A constant identified by a type, for [`boxed`]; [`boxed!`](crate::boxed!) makes one.
pub trait Constant {
    /// The type of the constant.
    type Value;
    /// The constant.
    const VALUE: Self::Value;
}

/// A box of a constant. It is written directly to the heap, never via the stack, in optimised and
/// unoptimised builds: states of tens of MiB need no stack of that size.
pub fn boxed<C: Constant>() -> Box<C::Value> {
    let mut place = Box::<C::Value>::new_uninit();
    *place = const { MaybeUninit::new(C::VALUE) };
    // SAFETY: it has just been written.
    unsafe { place.assume_init() }
}

/// [`boxed`] of a constant expression and its type.
///
/// ```
/// let zeros = raywake_alloc_guard::boxed!([u8; 64 << 20], [0; 64 << 20]);
/// assert_eq!(zeros.len(), 64 << 20);
/// ```
#[macro_export]
macro_rules! boxed {
    ($type:ty, $value:expr) => {{
        struct Here;
        impl $crate::Constant for Here {
            type Value = $type;
            const VALUE: $type = $value;
        }
        $crate::boxed::<Here>()
    }};
}
