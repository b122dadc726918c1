//! Figure 3.1 as a whole: the device against the scalar backend, what the background filter may and
//! may not do, and the choices that the dissertation's text leaves open.

#![forbid(unsafe_code)]

mod choices;
mod filter;
mod frames;
mod stages;
