//! The page: XHTML in a single self-contained file.

use super::encode::{base64, xml};
use super::{Element, Picture, Report, Section};
use std::fmt::Write;

const STYLE: &str = include_str!("style.css");

/// Running numbers of captions.
#[derive(Default)]
struct Numbers {
    figures: usize,
    tables: usize,
}

pub(super) fn page(report: &Report) -> String {
    let title = xml(&report.title);
    let mut out = format!(
        "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n\
         <meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<div class=\"page\">\n"
    );
    out += &header(report);
    out += &contents(report);
    out += "<main>\n";
    let mut numbers = Numbers::default();
    for (i, section) in report.sections.iter().enumerate() {
        out += &section_html(i + 1, section, &mut numbers);
    }
    out + "</main>\n</div>\n</body>\n</html>\n"
}

fn header(report: &Report) -> String {
    let mut out = format!("<header>\n<h1>{}</h1>\n", xml(&report.title));
    if !report.subtitle.is_empty() {
        out += &format!("<p class=\"subtitle\">{}</p>\n", prose(&report.subtitle));
    }
    if !report.headlines.is_empty() {
        out += "<div class=\"headlines\">\n";
        for [value, label, note] in &report.headlines {
            let (value, label, note) = (xml(value), prose(label), prose(note));
            out += "<div class=\"headline\">";
            out += &format!("<b>{value}</b><span>{label}</span><span>{note}</span></div>\n");
        }
        out += "</div>\n";
    }
    if !report.facts.is_empty() {
        out += "<dl>\n";
        for [name, value] in &report.facts {
            out += &format!("<dt>{}</dt><dd>{}</dd>\n", xml(name), prose(value));
        }
        out += "</dl>\n";
    }
    out + "</header>\n"
}

fn contents(report: &Report) -> String {
    let mut out = String::from("<nav aria-label=\"Contents\">\n<p>Contents</p>\n<ol>\n");
    for (i, section) in report.sections.iter().enumerate() {
        let number = i + 1;
        let title = xml(&section.title);
        out += &format!("<li><a href=\"#section-{number}\">{number}. {title}</a></li>\n");
    }
    if report.sections.is_empty() {
        out += "<li>no sections</li>\n";
    }
    out + "</ol>\n</nav>\n"
}

fn section_html(number: usize, section: &Section, numbers: &mut Numbers) -> String {
    let title = xml(&section.title);
    let mut out =
        format!("<section id=\"section-{number}\">\n<h2><span>{number}</span>{title}</h2>\n");
    for element in &section.elements {
        match element {
            Element::Text(text) => {
                for paragraph in text.split("\n\n").filter(|p| !p.trim().is_empty()) {
                    out += &format!("<p>{}</p>\n", prose(paragraph));
                }
            }
            Element::Table(table) => {
                numbers.tables += 1;
                let what = caption("above", "Table", numbers.tables, &table.caption);
                let link = csv_link(&table.id, &table.csv());
                let _ = writeln!(out, "<figure id=\"{}\">{what}{link}</figcaption>", table.id);
                out += &table.shown().html();
                for note in &table.notes {
                    out += &format!("<p class=\"note\">{}</p>\n", prose(note));
                }
                out += "</figure>\n";
            }
            Element::Chart(chart) => {
                numbers.figures += 1;
                let what = caption("", "Figure", numbers.figures, &chart.caption);
                let link = csv_link(&chart.id, &chart.csv());
                let svg = chart.svg().0;
                let _ = write!(out, "<figure id=\"{}\">\n{svg}", chart.id);
                let _ = writeln!(out, "{what}{link}</figcaption>\n</figure>");
            }
            Element::Picture(picture) => {
                numbers.figures += 1;
                let what = caption("", "Figure", numbers.figures, &picture.caption);
                let _ = write!(out, "<figure id=\"{}\">\n{}", picture.id, image(picture));
                let _ = writeln!(out, "{what}</figcaption>\n</figure>");
            }
        }
    }
    out + "</section>\n"
}

fn image(picture: &Picture) -> String {
    let size =
        picture.size().map_or(String::new(), |[w, h]| format!(" width=\"{w}\" height=\"{h}\""));
    let (data, what) = (base64(&picture.png), xml(&picture.caption));
    format!("<img{size} alt=\"{what}\" src=\"data:image/png;base64,{data}\"/>\n")
}

/// A caption, not yet closed.
fn caption(class: &str, kind: &str, number: usize, text: &str) -> String {
    format!("<figcaption class=\"{class}\"><b>{kind} {number}.</b> {}", prose(text))
}

fn csv_link(id: &str, csv: &str) -> String {
    let data = base64(csv.as_bytes());
    format!(" <a download=\"{id}.csv\" href=\"data:text/csv;charset=utf-8;base64,{data}\">CSV</a>")
}

/// Text in which pairs of backticks enclose code.
fn prose(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    let mut out = String::new();
    for (i, part) in parts.iter().enumerate() {
        let closed = i + 1 < parts.len();
        match (i % 2 == 1, closed) {
            (true, true) => out += &format!("<code>{}</code>", xml(part)),
            (true, false) => out += &format!("`{}", xml(part)),
            (false, _) => out += &xml(part),
        }
    }
    out
}
