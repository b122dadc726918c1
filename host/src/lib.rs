//! raywake.
