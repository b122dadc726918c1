//! Tables.

use super::encode::{self, fixed, xml};
use raywake_io::Error;

/// A table with a name for its file.
#[derive(Clone, Debug)]
pub struct Table {
    /// Name of its file, unlike any other's in the report: letters, digits, `-` and `_`.
    pub id: String,
    /// What it tells.
    pub caption: String,
    /// Names of the columns with their units.
    pub columns: Vec<String>,
    /// As many cells each as there are columns.
    pub rows: Vec<Row>,
    /// Below the table.
    pub notes: Vec<String>,
}

/// A row.
#[derive(Clone, Debug)]
pub struct Row {
    cells: Vec<Cell>,
    reference: bool,
}

impl Row {
    /// Figures of ours.
    pub fn new(cells: impl IntoIterator<Item = Cell>) -> Row {
        Row { cells: cells.into_iter().collect(), reference: false }
    }

    /// Figures of somebody else's, to compare with; they step back.
    pub fn reference(cells: impl IntoIterator<Item = Cell>) -> Row {
        Row { reference: true, ..Row::new(cells) }
    }
}

/// A cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// How many.
    Count(u64),
    /// A number and the decimals that are shown of it; the CSV has all. NaN is shown as a dash.
    Number(f64, usize),
    /// Nothing to tell.
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
            // Not by way of a float: counts are exact.
            Cell::Count(count) => encode::grouped(&count.to_string()),
            Cell::Number(value, decimals) => fixed(*value, *decimals),
            Cell::Empty => "–".into(),
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
    /// Fails where a row has another number of cells than there are columns.
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong = self.rows.iter().position(|r| r.cells.len() != self.columns.len());
        let Some(row) = wrong else { return Ok(()) };
        let (cells, columns) = (self.rows[row].cells.len(), self.columns.len());
        let what = format!("row {} has {cells} cells for {columns} columns", row + 1);
        Err(Error::Usage(format!("report, table {}: {what}", self.id)))
    }

    pub(super) fn csv(&self) -> String {
        let exact = |r: &Row| r.cells.iter().map(Cell::exact).collect();
        let rows: Vec<_> =
            [self.columns.clone()].into_iter().chain(self.rows.iter().map(exact)).collect();
        encode::csv(&rows)
    }

    /// For a screen: the caption, then columns of equal width, numbers flush right.
    pub fn text(&self) -> String {
        let shown: Vec<Vec<String>> = [self.columns.clone()]
            .into_iter()
            .chain(self.rows.iter().map(|r| r.cells.iter().map(Cell::shown).collect()))
            .collect();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|c| shown.iter().map(|r| r[c].chars().count()).max().unwrap_or(0))
            .collect();
        let mut out = format!("{}\n", self.caption);
        for row in &shown {
            let cells = row.iter().zip(&widths).enumerate().map(|(c, (cell, width))| {
                if self.is_text(c) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
            out += cells.collect::<Vec<_>>().join("  ").trim_end();
            out.push('\n');
        }
        out
    }

    /// Whether a column holds words.
    fn is_text(&self, column: usize) -> bool {
        let text = |r: &Row| matches!(r.cells[column], Cell::Text(_));
        self.rows.is_empty() || self.rows.iter().any(text)
    }

    /// As `<table>`; columns of numbers are flush right.
    pub(super) fn html(&self) -> String {
        let class: Vec<&str> = (0..self.columns.len())
            .map(|c| if self.is_text(c) { "" } else { " class=\"n\"" })
            .collect();
        let mut out = String::from("<div class=\"wide\"><table>\n<thead><tr>");
        for (name, class) in self.columns.iter().zip(&class) {
            out += &format!("<th{class}>{}</th>", xml(name));
        }
        out += "</tr></thead>\n<tbody>\n";
        for row in &self.rows {
            out += if row.reference { "<tr class=\"reference\">" } else { "<tr>" };
            for (cell, class) in row.cells.iter().zip(&class) {
                out += &format!("<td{class}>{}</td>", xml(&cell.shown()));
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
