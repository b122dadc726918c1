//! `raywake-lab eval tracks`: chapter 2's tables and figures on objects whose trajectories are
//! known.

pub mod object;
pub mod simulated;
