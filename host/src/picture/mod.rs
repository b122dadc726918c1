//! Pictures of what the program finds, seen from above.

mod flow;

use std::io::Write;
use std::path::Path;

use raywake_render::{Canvas, Look, Panel, birds_eye, colours};

use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_io::source::SweepData;

#[cfg(test)]
mod tests;

pub use flow::{FlowScene, flow};

/// Width and height of a picture's panel, pixels.
const SIDE: f32 = 900.0;
/// Height above the ground of the darkest returns, m.
const HEIGHT_M: f32 = 2.5;

/// How a picture that reaches so far, in cells of this width, looks; m.
fn look(half_extent_m: f64, cell_m: f64) -> Look {
    Look {
        half_extent_m: half_extent_m as f32,
        cell_m: cell_m as f32,
        height_m: HEIGHT_M,
        heights: colours::HEIGHTS,
        side: SIDE,
        scale: 1.0,
        legend: Vec::new(),
    }
}

/// Frame and time of a sweep of a recording that began at `start_s`.
pub fn note(sweep: &SweepData, start_s: f64) -> String {
    format!("frame {}, {:.2} s", sweep.frame, sweep.stamp_s - start_s)
}

fn draw(panel: Panel, look: &Look) -> Result<Canvas, Error> {
    birds_eye(&[panel], look).map_err(|e| Error::Unsupported(e.to_string()))
}

fn write(path: &Path, canvas: &Canvas) -> Result<(), Error> {
    let png = canvas.png();
    atomic::write(path, |out| out.write_all(&png))
}
