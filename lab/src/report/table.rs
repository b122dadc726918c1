//! Tables.

use super::encode::{self, fixed, xml};
use raywake_io::Error;
use serde::{Deserialize, Serialize};

/// Shown if there is no value.
const NOTHING: &str = "–";

/// A table with a name for its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table<C = Cell> {
    /// Name of its file, unlike any other's in the report: letters, digits, `-` and `_`.
    pub id: String,
    /// What it shows.
    pub caption: String,
    /// Names of the columns with their units.
    pub columns: Vec<String>,
    /// Each with as many cells as there are columns.
    pub rows: Vec<TableRow<C>>,
    /// Shown below the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// A table whose cells are text, as shown on a page and in `results.json`.
pub type Shown = Table<String>;

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRow<C = Cell> {
    /// One for each column.
    pub cells: Vec<C>,
    /// Whether these are someone else's figures, for comparison; they are de-emphasised.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reference: bool,
}

impl TableRow {
    /// A row of our figures.
    pub fn new(cells: impl IntoIterator<Item = Cell>) -> TableRow {
        TableRow { cells: cells.into_iter().collect(), reference: false }
    }

    /// A row of someone else's figures.
    pub fn reference(cells: impl IntoIterator<Item = Cell>) -> TableRow {
        TableRow { reference: true, ..TableRow::new(cells) }
    }
}

/// A cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A count.
    Count(u64),
    /// A number and the decimals shown of it; the CSV has all. NaN is shown as a dash.
    Number(f64, usize),
    /// No value.
    Empty,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Cell {
        Cell::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Cell {
        Cell::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Cell {
        Cell::Count(count)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Cell {
        Cell::Count(count as u64)
    }
}

impl Cell {
    fn shown(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            // Not via a float: counts are exact.
            Cell::Count(count) => encode::grouped(&count.to_string()),
            Cell::Number(value, decimals) => fixed(*value, *decimals),
            Cell::Empty => NOTHING.into(),
        }
    }

    fn exact(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Count(count) => count.to_string(),
            Cell::Number(value, _) if value.is_nan() => String::new(),
            Cell::Number(value, _) => value.to_string(),
            Cell::Empty => String::new(),
        }
    }
}

impl Table {
    /// A table without notes.
    pub fn new(
        id: impl Into<String>,
        caption: impl Into<String>,
        columns: &[&str],
        rows: Vec<TableRow>,
    ) -> Table {
        let columns = columns.iter().map(|c| (*c).to_string()).collect();
        Table { id: id.into(), caption: caption.into(), columns, rows, notes: Vec::new() }
    }

    /// The same table with a note below.
    pub fn note(mut self, note: &str) -> Table {
        self.notes.push(note.into());
        self
    }

    /// Fails if a row's number of cells differs from the number of columns.
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong = self.rows.iter().position(|r| r.cells.len() != self.columns.len());
        let Some(row) = wrong else { return Ok(()) };
        let (cells, columns) = (self.rows[row].cells.len(), self.columns.len());
        let what = format!("row {} has {cells} cells for {columns} columns", row + 1);
        Err(Error::Usage(format!("report, table {}: {what}", self.id)))
    }

    pub(super) fn csv(&self) -> String {
        let exact = |r: &TableRow| r.cells.iter().map(Cell::exact).collect();
        let rows: Vec<_> =
            [self.columns.clone()].into_iter().chain(self.rows.iter().map(exact)).collect();
        encode::csv(&rows)
    }

    /// The table as text for a terminal.
    pub fn text(&self) -> String {
        self.shown().text()
    }

    /// The table with every cell as the text shown for it.
    pub fn shown(&self) -> Shown {
        let row = |r: &TableRow| TableRow {
            cells: r.cells.iter().map(Cell::shown).collect(),
            reference: r.reference,
        };
        Shown {
            id: self.id.clone(),
            caption: self.caption.clone(),
            columns: self.columns.clone(),
            rows: self.rows.iter().map(row).collect(),
            notes: self.notes.clone(),
        }
    }
}

impl Shown {
    /// Whether a column, never the first, holds numbers: those are right-aligned.
    fn is_number(&self, column: usize) -> bool {
        let number = |line: &TableRow<String>| {
            let text = line.cells[column].trim_start_matches('\u{2212}');
            text == NOTHING || text == "inf" || text.starts_with(|c: char| c.is_ascii_digit())
        };
        column > 0 && !self.rows.is_empty() && self.rows.iter().all(number)
    }

    /// The table as text for a terminal: the caption, then the columns, each padded to its widest
    /// cell.
    pub fn text(&self) -> String {
        let lines = || [&self.columns].into_iter().chain(self.rows.iter().map(|r| &r.cells));
        let width = |c: usize| lines().map(|r| r[c].chars().count()).max().unwrap_or(0);
        let columns: Vec<_> =
            (0..self.columns.len()).map(|c| (width(c), self.is_number(c))).collect();
        let mut out = format!("{}\n", self.caption);
        for line in lines() {
            let cells = line.iter().zip(&columns).map(|(cell, &(width, number))| {
                if number { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
            });
            out += cells.collect::<Vec<_>>().join("  ").trim_end();
            out.push('\n');
        }
        out
    }

    /// The table in GitHub's Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = |c| if self.is_number(c) { "--:" } else { "---" };
        let mut out = line(self.columns.iter().map(|c| c.replace('|', "\\|")).collect());
        out += &line((0..self.columns.len()).map(|c| rule(c).into()).collect());
        for row in &self.rows {
            let cell = |text: &String| match text.replace('|', "\\|") {
                text if row.reference && text != NOTHING => format!("*{text}*"),
                text => text,
            };
            out += &line(row.cells.iter().map(cell).collect());
        }
        out
    }

    /// The table as `<table>`.
    pub(super) fn html(&self) -> String {
        let class: Vec<&str> = (0..self.columns.len())
            .map(|c| if self.is_number(c) { " class=\"n\"" } else { "" })
            .collect();
        let mut out = String::from("<div class=\"wide\"><table>\n<thead><tr>");
        for (name, class) in self.columns.iter().zip(&class) {
            out += &format!("<th{class}>{}</th>", xml(name));
        }
        out += "</tr></thead>\n<tbody>\n";
        for row in &self.rows {
            out += if row.reference { "<tr class=\"reference\">" } else { "<tr>" };
            for (cell, class) in row.cells.iter().zip(&class) {
                out += &format!("<td{class}>{}</td>", xml(cell));
            }
            out += "</tr>\n";
        }
        if self.rows.is_empty() {
            let span = self.columns.len().max(1);
            out += &format!("<tr><td class=\"none\" colspan=\"{span}\">no data</td></tr>\n");
        }
        out + "</tbody></table></div>\n"
    }
}
