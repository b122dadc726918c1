//! Bird's-eye pictures: returns, motion, objects, maps and a legend, drawn to single or animated
//! PNG.
//!
//! Plain data in, pixels out. All positions are in metres in a frame of the caller's choice, x up
//! and y to the left on the picture, so that a vehicle's frame (x forward, y left) is drawn with
//! its front up. The same scene gives the same bytes on every machine: the font is embedded, the
//! rasteriser runs scalar code, and no function of the platform's maths library is called.
//!
//! `film.png` was made by `raywake run DRIVE --film` from sweeps 10 to 33 of the drive that
//! `raywake-lab sim OUT --scenery roundabout --seed 4` writes, reduced to a palette of 48 colours.
//!
//! Static objects are drawn pale, moving ones in strong colours that colour-blind readers can
//! distinguish (see [`colours`]).

#![deny(missing_docs)]
#![forbid(unsafe_code)]

pub mod canvas;
pub mod colours;
mod film;
mod legend;
mod page;
mod panel;
pub mod scene;
mod text;

#[cfg(test)]
mod tests;

pub use canvas::{Canvas, Pen, PictureError};
pub use colours::Colour;
pub use film::Film;
pub use page::birds_eye;
pub use panel::WINDOW;
pub use scene::{Arrow, Cell, LegendEntry, Look, Outline, Panel, Sign, Trail};
