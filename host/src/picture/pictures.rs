//! Where pictures go: single files, a film, a page.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use raywake_io::Error;
use raywake_io::sink::atomic::{self, Partial};
use raywake_io::source::SweepData;
use raywake_render::{Canvas, Film, Look, Panel};

use super::page::Page;
use super::{PictureFiles, Subject, SweepFigures, drawing, flow, map, tracks};

/// How long the first picture of a film is shown, s: the duration of a sweep of most sensors.
const FIRST_SHOWN_S: f64 = 0.1;

/// The pictures of a recording in progress.
pub struct Pictures {
    name: String,
    folder: Option<PathBuf>,
    film: Option<FilmFile>,
    page: Option<Page>,
    /// Stamps of the first sweep drawn and of the last one, s.
    stamps_s: Option<[f64; 2]>,
}

impl Pictures {
    /// Starts the pictures of a recording with this name and number of sweeps. Creates missing
    /// folders.
    ///
    /// # Errors
    /// If a file or folder cannot be created.
    pub fn create(files: &PictureFiles, name: &str, sweeps: usize) -> Result<Pictures, Error> {
        files.folder.as_deref().map_or(Ok(()), atomic::create_folder)?;
        Ok(Pictures {
            name: name.into(),
            folder: files.folder.clone(),
            film: files.film.as_deref().map(FilmFile::create).transpose()?,
            page: files.page.as_deref().map(|p| Page::create(p, name, sweeps)).transpose()?,
            stamps_s: None,
        })
    }

    /// Whether any are drawn.
    pub fn are_enabled(&self) -> bool {
        self.folder.is_some() || self.film.is_some() || self.page.is_some()
    }

    /// Draws a sweep. Time counts from the first sweep drawn.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(
        &mut self,
        sweep: &SweepData,
        subject: &Subject,
        figures: &SweepFigures,
    ) -> Result<(), Error> {
        if !self.are_enabled() {
            return Ok(());
        }
        let [start_s, last_s] = self.stamps_s.unwrap_or([sweep.stamp_s; 2]);
        let shown_s = self.stamps_s.map_or(FIRST_SHOWN_S, |_| sweep.stamp_s - last_s);
        self.stamps_s = Some([start_s, sweep.stamp_s]);
        let after_s = sweep.stamp_s - start_s;
        let note = format!("frame {}, {after_s:.2} s", sweep.frame);
        let (panel, look) = view(sweep, subject);
        let panel = Panel { note, ..titled(panel, &self.name) };
        if let Some(folder) = &self.folder {
            let path = folder.join(format!("{:010}.png", sweep.frame));
            write(&path, &drawn(&panel, &look)?)?;
        }
        let wanted = self.film.is_some() || self.page.as_ref().is_some_and(Page::takes);
        let small = Look { side: drawing::FILM_SIDE, ..look };
        let small = wanted.then(|| drawn(&panel, &small)).transpose()?;
        if let Some((film, picture)) = self.film.as_mut().zip(small.as_ref()) {
            film.frame(picture, shown_s)?;
        }
        let moment = |page: &mut Page| page.moment(sweep.frame, after_s, figures, small.as_ref());
        self.page.iter_mut().try_for_each(moment)
    }

    /// Completes the files that span all sweeps; the page ends with the summary.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn finish(self, summary: &str) -> Result<(), Error> {
        self.film.map_or(Ok(()), FilmFile::finish)?;
        self.page.map_or(Ok(()), |page| page.finish(summary))
    }
}

/// Draws a single picture, titled with `name`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_one(
    path: &Path,
    sweep: &SweepData,
    subject: &Subject,
    name: &str,
) -> Result<(), Error> {
    let (panel, look) = view(sweep, subject);
    write(path, &drawn(&titled(panel, name), &look)?)
}

fn write(path: &Path, picture: &Canvas) -> Result<(), Error> {
    let png = picture.png();
    atomic::write(path, |out| out.write_all(&png))
}

fn view(sweep: &SweepData, subject: &Subject) -> (Panel, Look) {
    match subject {
        Subject::Flow { columns, profile, frame } => flow::view(sweep, columns, profile, *frame),
        Subject::Map { voxels, origin_m, voxel_m } => {
            map::view(&sweep.world_from_vehicle, voxels, *origin_m, *voxel_m)
        }
        Subject::Objects { objects, paths } => tracks::view(sweep, objects, paths),
    }
}

fn titled(panel: Panel, name: &str) -> Panel {
    Panel { title: format!("{}, {name}", panel.title), vehicle: true, ..panel }
}

fn drawn(panel: &Panel, look: &Look) -> Result<Canvas, Error> {
    let canvas = raywake_render::birds_eye(std::slice::from_ref(panel), look);
    canvas.map_err(|e| Error::Unsupported(e.to_string()))
}

#[cfg(test)]
pub(super) fn draw(sweep: &SweepData, subject: &Subject) -> Canvas {
    let (panel, look) = view(sweep, subject);
    drawn(&titled(panel, "drive"), &look).unwrap()
}

/// A film being written.
struct FilmFile {
    partial: Partial,
    /// Present until the first picture determines the size of all.
    empty: Option<BufWriter<File>>,
    film: Option<Film>,
}

impl FilmFile {
    fn create(path: &Path) -> Result<FilmFile, Error> {
        let (partial, out) = Partial::create(path)?;
        Ok(FilmFile { partial, empty: Some(out), film: None })
    }

    fn frame(&mut self, picture: &Canvas, shown_s: f64) -> Result<(), Error> {
        let FilmFile { partial, empty, film } = self;
        if let Some(out) = empty.take() {
            *film = Some(Film::new(out, picture.size()).map_err(|e| partial.error(e))?);
        }
        film.iter_mut().try_for_each(|f| f.frame(picture, shown_s)).map_err(|e| partial.error(e))
    }

    /// Completes the film. Without any picture there is no film, and no file.
    fn finish(self) -> Result<(), Error> {
        let FilmFile { partial, film, .. } = self;
        let Some(film) = film else { return Ok(()) };
        film.finish().map_err(|e| partial.error(e))?;
        partial.keep()
    }
}
