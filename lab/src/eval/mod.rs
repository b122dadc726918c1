//! `raywake-lab eval`: chapter 3's tables and figures, and today's metrics, on labelled drives.

mod row;
mod statistics;
mod tally;
