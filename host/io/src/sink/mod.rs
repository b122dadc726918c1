//! Outputs: feather, Parquet and MCAP files and Argoverse 2 submissions, each complete or absent,
//! and viewers.

pub mod argoverse;
pub mod atomic;
#[cfg_attr(not(feature = "mcap"), path = "bag_absent.rs")]
pub mod bag;
pub mod clouds;
pub mod feather;
pub mod flow_tables;
#[cfg_attr(not(feature = "parquet"), path = "parquet_absent.rs")]
pub mod parquet;
pub mod streams;
pub mod table;

#[cfg(test)]
mod tests;

/// File metadata besides the version of this program: keys and values, such as `("frame", "17")`,
/// `("stamp_s", "1.72")`.
pub type Meta<'a> = &'a [(&'a str, String)];
