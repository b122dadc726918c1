//! `raywake-lab results`: writes `RESULTS.md` from the results of evaluations.

use crate::report::{COMMAND, Results};
use raywake_io::Error;
use std::path::{Path, PathBuf};

/// `raywake-lab results`.
#[derive(clap::Args)]
pub struct Args {
    /// Folders that `eval`, `eval tracks` and `ablate` wrote to, or `results.json` files, in the
    /// order of the document
    #[arg(required = true, value_name = "RESULTS")]
    results: Vec<PathBuf>,
}

/// Tables that only the report shows: details and second views of what other tables show.
const REPORT_ONLY: [&str; 4] = ["table-3-1-voxels", "references-smooth", "kinds-", "worst-"];

/// Prints the document. Nothing is computed: the results contain every figure.
///
/// Fails if a file cannot be read or is not a `results.json`.
pub fn run(args: &Args) -> Result<(), Error> {
    print!("{}", document(&args.results)?);
    Ok(())
}

fn document(paths: &[PathBuf]) -> Result<String, Error> {
    let mut out = String::from(
        "# Results\n\n\
         Written by `raywake-lab results`; do not edit. Every section names the command that \
         measured it and the machine it ran on. Rows in italics are published figures or \
         references that need no LIDAR.\n",
    );
    for path in paths {
        out += &section(&read(path)?);
    }
    Ok(out)
}

fn read(path: &Path) -> Result<Results, Error> {
    let file = if path.is_dir() { path.join("results.json") } else { path.to_path_buf() };
    let text = std::fs::read_to_string(&file).map_err(Error::reading(&file))?;
    let results: Results = serde_json::from_str(&text)
        .map_err(|e| Error::input(&file, format!("line {}", e.line()), e.to_string()))?;
    for table in &results.tables {
        let columns = table.columns.len();
        if table.rows.iter().any(|row| row.cells.len() != columns) {
            let what = format!("a row of table {} does not have {columns} cells", table.id);
            return Err(Error::input(&file, "", what));
        }
    }
    Ok(results)
}

fn section(results: &Results) -> String {
    let mut out = format!("\n## {}\n\n", results.title);
    for [name, value] in &results.facts {
        let value = if name == COMMAND { format!("`{value}`") } else { value.clone() };
        out += &format!("- {name}: {value}\n");
    }
    let shown = |id: &str| !REPORT_ONLY.iter().any(|hidden| id.starts_with(hidden));
    for table in results.tables.iter().filter(|t| shown(&t.id)) {
        out += &format!("\n{}\n\n{}", table.caption, table.markdown());
        for note in &table.notes {
            out += &format!("\n{note}\n");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    /// The measured results, kept in the repository.
    const KEPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/results");

    #[test]
    fn results_md_matches_the_kept_results() {
        let mut files: Vec<PathBuf> =
            std::fs::read_dir(KEPT).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        let written = std::fs::read_to_string(format!("{KEPT}/../../RESULTS.md")).unwrap();
        let how = "raywake-lab results lab/results/*.json > RESULTS.md";
        assert!(document(&files).unwrap() == written, "RESULTS.md is out of date: {how}");
    }

    #[test]
    fn invalid_results_are_refused() {
        let scratch = Scratch::new();
        let refused =
            |text: &str| read(&scratch.write("results.json", text)).unwrap_err().to_string();
        assert!(refused("{").contains("results.json"));
        let row = r#"{"title": "t", "facts": [], "tables": [{"id": "a", "caption": "c",
            "columns": ["x", "y"], "rows": [{"cells": ["1"]}]}]}"#;
        assert!(refused(row).contains("table a"));
        assert!(read(scratch.path()).is_err(), "the folder's file is the same");
    }
}
