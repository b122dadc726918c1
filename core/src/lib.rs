#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! Core of raywake.

pub mod output;
pub mod pose;
pub mod sweep;
