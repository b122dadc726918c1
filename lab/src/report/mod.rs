//! Reports of evaluations: one page to read, and every chart, table and picture as a file.
//!
//! The page needs neither network nor scripts. Every chart is described once and drawn once, as
//! SVG: the page contains it, the PNG is rendered from it. No text given here needs escaping; pairs
//! of backticks enclose code.

mod birds_eye;
mod chart;
mod clouds;
mod encode;
mod html;
mod measured_by;
mod raster;
mod table;

#[cfg(test)]
mod tests;

pub use birds_eye::{Column, Look, Outline, Panel, birds_eye};
pub use chart::{
    Axis, Bar, BarSeries, Bars, Chart, Guide, Histogram, Lines, Mark, Plot, Series, Style,
};
pub use clouds::{Cloud, clouds};
pub use measured_by::COMMAND;
pub use table::{Cell, Shown, Table, TableRow};

use raywake_io::Error;
use raywake_io::sink::atomic;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

/// Pixels per unit of a chart's PNG.
const SCALE: f32 = 2.0;

/// First bytes of every PNG file.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

/// A report under construction.
#[derive(Clone, Debug)]
pub struct Report {
    title: String,
    subtitle: String,
    headlines: Vec<[String; 3]>,
    facts: Vec<[String; 2]>,
    sections: Vec<Section>,
}

/// Facts and tables of a report: `results.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// Title of the report.
    pub title: String,
    /// Names and values: command, machine, drives.
    pub facts: Vec<[String; 2]>,
    /// In the order of the report.
    pub tables: Vec<Shown>,
}

impl Results {
    /// Prints the tables and the path of the report.
    pub fn print(&self, folder: &Path) {
        self.tables.iter().for_each(|table| println!("{}", table.text()));
        println!("report: {}", folder.join("report.html").display());
    }
}

/// A section of a report under construction.
#[derive(Clone, Debug)]
pub struct Section {
    title: String,
    elements: Vec<Element>,
}

/// What a section contains, in order.
#[derive(Clone, Debug)]
enum Element {
    Text(String),
    Table(Table),
    Chart(Chart),
    Picture(Picture),
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its file, unlike any other's in the report: letters, digits, `-` and `_`.
    pub id: String,
    /// What the picture shows.
    pub caption: String,
    /// A PNG file.
    pub png: Vec<u8>,
}

impl Picture {
    /// Width and height, pixels; `None` if the bytes are not a PNG.
    fn size(&self) -> Option<[u32; 2]> {
        let sizes = self.png.strip_prefix(PNG)?.first_chunk::<8>()?;
        let [w, h] = [0, 4].map(|i| [sizes[i], sizes[i + 1], sizes[i + 2], sizes[i + 3]]);
        Some([u32::from_be_bytes(w), u32::from_be_bytes(h)])
    }
}

impl Report {
    /// A report that contains only this command and machine.
    pub fn new(title: &str, subtitle: &str) -> Report {
        Report {
            title: title.into(),
            subtitle: subtitle.into(),
            headlines: Vec::new(),
            facts: vec![
                [COMMAND.into(), measured_by::command()],
                ["Machine".into(), measured_by::machine()],
            ],
            sections: Vec::new(),
        }
    }

    /// Adds a result in large type at the top: a number with its unit, what it is, what to compare
    /// it with.
    pub fn headline(&mut self, value: &str, label: &str, note: &str) -> &mut Report {
        self.headlines.push([value, label, note].map(String::from));
        self
    }

    /// Adds a line at the top on what was measured: drives, profile, digest.
    pub fn fact(&mut self, name: &str, value: &str) -> &mut Report {
        self.facts.push([name, value].map(String::from));
        self
    }

    /// Begins a section and returns it.
    pub fn section(&mut self, title: &str) -> &mut Section {
        self.sections.push(Section { title: title.into(), elements: Vec::new() });
        let last = self.sections.len() - 1;
        &mut self.sections[last]
    }

    /// Writes `report.html`, `results.json`, `charts/ID.svg`, `.png` and `.csv`, `tables/ID.csv`
    /// and `pictures/ID.png` to a folder, which is created if missing; each file whole or not at
    /// all, the page last.
    ///
    /// Fails with [`Error::Usage`] before anything is written on an id that is not a file name or
    /// is given twice, a table whose rows do not fit its columns, or a picture that is not a PNG;
    /// later if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Results, Error> {
        self.check()?;
        atomic::create_folder(folder)?;
        for element in self.sections.iter().flat_map(|s| &s.elements) {
            write_files(element, folder)?;
        }
        let results = self.results();
        let text = serde_json::to_string_pretty(&results).expect("plain text") + "\n";
        put(folder, "results.json", text.as_bytes())?;
        put(folder, "report.html", html::page(self).as_bytes())?;
        Ok(results)
    }

    fn results(&self) -> Results {
        let elements = self.sections.iter().flat_map(|s| &s.elements);
        let tables = elements.filter_map(|element| match element {
            Element::Table(table) => Some(table.shown()),
            _ => None,
        });
        Results { title: self.title.clone(), facts: self.facts.clone(), tables: tables.collect() }
    }

    fn check(&self) -> Result<(), Error> {
        let mut seen = BTreeSet::new();
        for element in self.sections.iter().flat_map(|s| &s.elements) {
            let id = match element {
                Element::Text(_) => continue,
                Element::Table(table) => {
                    table.check()?;
                    &table.id
                }
                Element::Chart(chart) => &chart.id,
                Element::Picture(picture) => {
                    if picture.size().is_none() {
                        let what = "is not a PNG file";
                        return Err(Error::Usage(format!(
                            "report, picture {}: {what}",
                            picture.id
                        )));
                    }
                    &picture.id
                }
            };
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if id.is_empty() || !id.chars().all(plain) {
                let what = "is not a plain name (letters, digits, - and _)";
                return Err(Error::Usage(format!("report: {id:?} {what}")));
            }
            if !seen.insert(id) {
                return Err(Error::Usage(format!("report: {id:?} is used twice")));
            }
        }
        Ok(())
    }
}

impl Section {
    /// Adds paragraphs, separated by empty lines.
    pub fn text(&mut self, text: &str) -> &mut Section {
        self.elements.push(Element::Text(text.into()));
        self
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) -> &mut Section {
        self.elements.push(Element::Table(table));
        self
    }

    /// Adds a chart.
    pub fn chart(&mut self, chart: Chart) -> &mut Section {
        self.elements.push(Element::Chart(chart));
        self
    }

    /// Adds a picture.
    pub fn picture(&mut self, picture: Picture) -> &mut Section {
        self.elements.push(Element::Picture(picture));
        self
    }
}

fn write_files(element: &Element, folder: &Path) -> Result<(), Error> {
    match element {
        Element::Text(_) => Ok(()),
        Element::Table(table) => {
            put(&folder.join("tables"), &format!("{}.csv", table.id), table.csv().as_bytes())
        }
        Element::Chart(chart) => {
            let folder = folder.join("charts");
            let (svg, size) = chart.svg();
            put(&folder, &format!("{}.csv", chart.id), chart.csv().as_bytes())?;
            put(&folder, &format!("{}.svg", chart.id), svg.as_bytes())?;
            put(&folder, &format!("{}.png", chart.id), &raster::png(&svg, size, SCALE)?)
        }
        Element::Picture(picture) => {
            put(&folder.join("pictures"), &format!("{}.png", picture.id), &picture.png)
        }
    }
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Error> {
    atomic::create_folder(folder)?;
    atomic::write(&folder.join(name), |out| out.write_all(bytes))
}
