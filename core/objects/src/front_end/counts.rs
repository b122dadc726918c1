//! What the front end counts.

use raywake_core::dropped::DroppedReturns;

/// Declares counts with their sum and their names.
macro_rules! counts {
    ($(#[$doc:meta])* $group:ident { $($(#[$count_doc:meta])* $count:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $group {
            /// Returns left out before they were examined.
            pub dropped: DroppedReturns,
            $($(#[$count_doc])* pub $count: u64,)*
        }

        impl core::ops::AddAssign for $group {
            fn add_assign(&mut self, more: $group) {
                self.dropped += more.dropped;
                $(self.$count += more.$count;)*
            }
        }

        impl $group {
            /// Every count but those of dropped returns, with its name.
            pub fn named(&self) -> impl Iterator<Item = (&'static str, u64)> {
                [$((stringify!($count), self.$count)),*].into_iter()
            }
        }
    };
}

counts! {
    /// Counts of one step or several.
    TrackingCounts {
        /// Returns of objects.
        object_returns,
        /// Returns of objects beyond the capacity for chunks.
        unchunked,
        /// Segments that may be objects.
        segments,
        /// Segments too small for an object.
        too_small,
        /// Segments too large for an object.
        too_large,
        /// Segments beyond the capacity.
        unlisted,
        /// Tracks begun.
        born,
        /// Segments without a track for lack of room.
        unborn,
        /// Tracks continued.
        updated,
        /// Tracks that waited unobserved.
        waiting,
        /// Tracks ended.
        ended,
        /// Tracks ended because time went backwards, included in `ended`.
        reset,
    }
}
