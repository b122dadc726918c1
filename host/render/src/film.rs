//! A film: a sequence of pictures of one size, as an animated PNG.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use crate::Canvas;

/// Offset of a file's animation control chunk, bytes: after the signature and the header.
const CONTROL_AT: u64 = 8 + 25;
/// Number of plays: 0 repeats forever.
const PLAYS: u32 = 0;
/// Minimum and maximum time of a frame, ms: browsers show shorter ones for 100 ms.
const SHOWN_MS: [f64; 2] = [20.0, 2000.0];

/// A film being written: it grows on disk, not in memory. Every browser plays the file.
pub struct Film {
    writer: png::Writer<BufWriter<File>>,
    /// The same file: the number of frames precedes the first one.
    file: File,
    size: [u32; 2],
    frames: u32,
}

impl Film {
    /// Starts a film in an empty file, of pictures of this width and height, pixels.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn new(out: BufWriter<File>, size: [u32; 2]) -> io::Result<Film> {
        let file = out.get_ref().try_clone()?;
        let mut encoder = png::Encoder::new(out, size[0], size[1]);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_filter(png::Filter::NoFilter);
        // The number of frames is known only at the end.
        encoder.set_animated(i32::MAX as u32, PLAYS)?;
        Ok(Film { writer: encoder.write_header()?, file, size, frames: 0 })
    }

    /// Adds the next picture, shown for `shown_s` seconds.
    ///
    /// # Errors
    /// If the file cannot be written, or the picture's size differs from the film's.
    pub fn frame(&mut self, picture: &Canvas, shown_s: f64) -> io::Result<()> {
        if picture.size() != self.size {
            let ([w, h], [x, y]) = (picture.size(), self.size);
            let what = format!("a picture of {w} x {h} pixels in a film of {x} x {y}");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        let [least, most] = SHOWN_MS;
        // NaN becomes the minimum.
        let shown_ms = (1e3 * shown_s).max(least).min(most).round() as u16;
        self.writer.set_frame_delay(shown_ms, 1000)?;
        self.writer.write_image_data(&picture.rgb())?;
        self.frames += 1;
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(self) -> io::Result<()> {
        let Film { writer, mut file, frames, .. } = self;
        writer.finish()?;
        let mut control = b"acTL".to_vec();
        control.extend([frames, PLAYS].into_iter().flat_map(u32::to_be_bytes));
        control.extend(crc32fast::hash(&control).to_be_bytes());
        // Skips the length of the chunk.
        file.seek(SeekFrom::Start(CONTROL_AT + 4))?;
        file.write_all(&control)
    }
}
