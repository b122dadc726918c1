//! A self-contained HTML page of a run: a slider over the sweeps, figures of each, the busiest
//! moments, and the summary. `page.html` is its template.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use raywake_io::Error;
use raywake_io::sink::atomic::Partial;
use raywake_render::Canvas;
use serde::Serialize;

use super::SweepFigures;

/// Maximum number of pictures on a page; of more sweeps every second is shown, or every third, and
/// so on. At 100 kB each, a page with this many has 40 MB, which browsers open within a second.
const SHOWN_MAX: usize = 300;

const TEMPLATE: &str = include_str!("page.html");
/// Where the sweeps go in the template.
const MOMENTS: &str = "<!-- moments -->\n";

/// A page being written.
pub(super) struct Page {
    partial: Partial,
    out: BufWriter<File>,
    name: String,
    /// One in this many sweeps is shown.
    every: usize,
    moments: usize,
}

/// A sweep in the form the page's script takes.
#[derive(Serialize)]
struct Moment {
    /// A string: a timestamp has more digits than JavaScript numbers.
    frame: String,
    time_s: f64,
    figures: [f64; 2],
    /// A PNG file.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

impl Page {
    pub(super) fn create(path: &Path, name: &str, sweeps: usize) -> Result<Page, Error> {
        let (partial, out) = Partial::create(path)?;
        let every = sweeps.div_ceil(SHOWN_MAX).max(1);
        Ok(Page { partial, out, name: escaped(name), every, moments: 0 })
    }

    /// Whether the next sweep is shown.
    pub(super) fn takes(&self) -> bool {
        self.moments.is_multiple_of(self.every)
    }

    /// Adds a sweep with its time since the first one (s), and its picture if it is shown.
    pub(super) fn moment(
        &mut self,
        frame: u64,
        time_s: f64,
        figures: &SweepFigures,
        picture: Option<&Canvas>,
    ) -> Result<(), Error> {
        let picture = picture.filter(|_| self.takes()).map(|p| STANDARD.encode(p.png()));
        let frame = frame.to_string();
        let moment = Moment { frame, time_s, figures: figures.map(|f| f.1), picture };
        let first = self.moments == 0;
        self.moments += 1;
        let written = match first {
            true => self.head(figures).and_then(|()| self.add(&moment)),
            false => self.add(&moment),
        };
        written.map_err(|e| self.partial.error(e))
    }

    fn head(&mut self, figures: &SweepFigures) -> io::Result<()> {
        let names = serde_json::to_string(&figures.map(|f| f.0))?;
        let head = parts().0.replace("{name}", &self.name).replace("{names}", &names);
        self.out.write_all(head.as_bytes())
    }

    fn add(&mut self, moment: &Moment) -> io::Result<()> {
        writeln!(self.out, "<script>add({})</script>", serde_json::to_string(moment)?)
    }

    /// Ends the page with a summary. Without any sweep there is no page, and no file.
    pub(super) fn finish(mut self, summary: &str) -> Result<(), Error> {
        if self.moments == 0 {
            return Ok(());
        }
        let foot = parts().1.replace("{summary}", &escaped(summary));
        let written = self.out.write_all(foot.as_bytes()).and_then(|()| self.out.flush());
        written.map_err(|e| self.partial.error(e))?;
        self.partial.keep()
    }
}

/// The template before and after the sweeps.
fn parts() -> (&'static str, &'static str) {
    TEMPLATE.split_once(MOMENTS).unwrap_or((TEMPLATE, ""))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
