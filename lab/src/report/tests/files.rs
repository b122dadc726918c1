//! What a written report contains.

use super::example;
use crate::report::*;
use crate::scratch::Scratch;
use std::collections::BTreeSet;
use std::fs;

fn text(folder: &Scratch, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

/// Number of colours in a picture.
fn colours(png: &[u8]) -> usize {
    let picture = resvg::tiny_skia::Pixmap::decode_png(png).unwrap();
    let pixels = picture.data().chunks(4).map(|p| [p[0], p[1], p[2], p[3]]);
    pixels.collect::<BTreeSet<_>>().len()
}

fn parse(text: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    roxmltree::Document::parse_with_options(text, options).unwrap()
}

fn unbase64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u8> = text.bytes().filter(|&c| c != b'=').map(digit).collect();
    let group = |g: &[u8]| {
        let word = g.iter().fold(0u32, |w, &d| w << 6 | u32::from(d)) << (6 * (4 - g.len()));
        word.to_be_bytes()[1..g.len()].to_vec()
    };
    digits.chunks(4).flat_map(group).collect()
}

#[test]
fn the_page_is_whole_and_needs_no_other_file() {
    let folder = Scratch::new();
    example::report().write(folder.path()).unwrap();
    let text = text(&folder, "report.html");
    let page = parse(&text);
    let named = |name: &'static str| page.descendants().filter(move |n| n.has_tag_name(name));
    let svgs = page.descendants().filter(|n| n.attribute("role") == Some("img")).count();
    assert_eq!((svgs, named("img").count(), named("section").count()), (8, 1, 6));
    assert_eq!(named("table").count(), 2);
    let (mut ids, mut files) = (BTreeSet::new(), 0);
    for id in page.descendants().filter_map(|n| n.attribute("id")) {
        assert!(ids.insert(id), "{id} twice");
    }
    for link in page.descendants().flat_map(|n| [n.attribute("href"), n.attribute("src")]).flatten()
    {
        match link.strip_prefix('#') {
            Some(target) => assert!(ids.contains(target), "{target}"),
            None => {
                assert!(link.starts_with("data:"), "{link}");
                files += 1;
            }
        }
    }
    assert_eq!(files, 8 + 2 + 1);
    let image = named("img").next().unwrap().attribute("src").unwrap();
    let data = unbase64(image.strip_prefix("data:image/png;base64,").unwrap());
    assert_eq!(data, fs::read(folder.path().join("pictures/ego-world.png")).unwrap());
    assert!(colours(&data) > 200);
    assert!(
        !fs::read_dir(folder.path())
            .unwrap()
            .any(|f| { f.unwrap().file_name().to_string_lossy().ends_with(".partial") })
    );
}

#[test]
fn text_is_escaped() {
    let folder = Scratch::new();
    example::report().write(folder.path()).unwrap();
    let text = text(&folder, "report.html");
    let page = parse(&text);
    let title = page.descendants().find(|n| n.has_tag_name("h1")).unwrap();
    assert_eq!(title.text(), Some("Scene flow <on> two drives"));
    let cell = page.descendants().filter(|n| n.has_tag_name("td"));
    assert!(cell.filter_map(|n| n.text()).any(|t| t == "<b>\"Tram\" & co</b>"));
    assert!(page.descendants().any(|n| n.has_tag_name("code") && n.text() == Some("hdl64")));
}

#[test]
fn every_chart_is_there_three_times() {
    let folder = Scratch::new();
    example::report().write(folder.path()).unwrap();
    let mut seen = 0;
    for file in fs::read_dir(folder.path().join("charts")).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_none_or(|e| e != "svg") {
            continue;
        }
        seen += 1;
        let svg = fs::read_to_string(&path).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{path:?}");
        assert!(document.descendants().any(|n| n.has_tag_name("text")));
        let png = fs::read(path.with_extension("png")).unwrap();
        let empty = path.ends_with("nothing.svg");
        assert!(colours(&png) > if empty { 10 } else { 40 }, "{path:?}: {}", colours(&png));
        assert!(path.with_extension("csv").is_file());
    }
    assert_eq!(seen, 8);
}

#[test]
fn tables_hold_all_digits() {
    let csv = example::table().csv();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[0], "class,columns,\"median, cm\",\"mean, cm\",\"within 30 cm, %\"");
    assert_eq!(lines[1], "Car,12345,10.1234,19.5,84.25");
    assert_eq!(lines[3], "\"<b>\"\"Tram\"\" & co</b>\",0,,,");
}

#[test]
fn charts_hold_their_numbers() {
    let csv = example::precision_recall().csv();
    assert!(csv.starts_with("series,recall,precision,mark\ntrained filter,0,1,\n"));
    assert!(csv.contains("trained filter,0.95,") && csv.contains(",95 % of the foreground\n"));
    assert_eq!(csv.lines().count(), 1 + 3 * 201 + 2);
    let csv = example::histograms().csv();
    assert!(csv.starts_with("part,\"error, m from\",\"error, m to\",columns\nCar,0,0.05,"));
    let cars = csv.lines().filter(|l| l.starts_with("Car,"));
    let sum: u64 = cars.map(|l| l.rsplit(',').next().unwrap().parse::<u64>().unwrap()).sum();
    assert_eq!(sum, 9000);
    let csv = example::bars().csv();
    assert!(csv.contains("\npercent of cars within 30 cm,this run,84.25,82,86\n"), "{csv}");
}

#[test]
fn empty_charts_say_no_data() {
    let (svg, _) = example::nothing().svg();
    assert_eq!(svg.matches("no data").count(), 4);
    let (svg, _) = Chart::small_multiples("none", "", vec![]).svg();
    assert!(roxmltree::Document::parse(&svg).is_ok());
}

#[test]
fn odd_values_are_drawn_or_left_out() {
    let odd = [
        0.0,
        -0.0,
        1e300,
        -1e300,
        f64::MIN_POSITIVE,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1.0,
    ];
    for &a in &odd {
        for &b in &odd {
            let axes = [Axis::new("x"), Axis::new("x").range(a, b)];
            for (axis, log_y) in
                axes.into_iter().flat_map(|axis| [(axis.clone(), false), (axis, true)])
            {
                let mut lines = Lines { log_y, ..Lines::new(axis.clone(), axis.clone()) };
                lines.series.push(Series {
                    marks: vec![Mark { at: [a, b], label: "m".into() }],
                    ..Series::line("odd", vec![[a, b], [b, a], [1.0, 1.0]])
                });
                lines.guides = vec![Guide::Y(a, "g".into()), Guide::Diagonal("d".into())];
                let mut bars =
                    Bars { x: axis, categories: vec!["a".into(), "b".into()], series: vec![] };
                let bar = Bar { value: a, spread: Some([b, a]) };
                bars.series.push(BarSeries {
                    name: "s".into(),
                    reference: false,
                    bars: vec![Some(bar)],
                });
                let line = Some((b, "l".into()));
                let (x, y, counts) = ("x".into(), "y".into(), vec![1, 0, 2]);
                let h = Histogram { x, y, width: a, counts, overflow: 1, line };
                let parts = [Plot::Lines(lines), Plot::Bars(bars), Plot::Histogram(h)];
                let parts = parts.into_iter().map(|p| (String::new(), p)).collect();
                let (svg, _) = Chart::small_multiples("odd", "", parts).svg();
                assert!(
                    !svg.contains("=\"NaN") && !svg.contains("=\"inf") && !svg.contains("=\"-inf"),
                    "{a} {b} {svg}"
                );
            }
        }
    }
}

#[test]
fn invalid_contents_are_refused_by_name() {
    let folder = Scratch::new();
    let refused = |fill: &dyn Fn(&mut Section)| {
        let mut report = Report::new("t", "");
        fill(report.section("s"));
        let error = report.write(&folder.path().join("report")).unwrap_err().to_string();
        assert!(!folder.path().join("report").exists());
        error
    };
    let twice = refused(&|s| {
        s.chart(example::stages()).chart(example::stages());
    });
    assert!(twice.contains("\"stages\" is used twice"), "{twice}");
    let path = refused(&|s| {
        s.table(Table { id: "../x".into(), ..example::table() });
    });
    assert!(path.contains("\"../x\" is not a plain name"), "{path}");
    let ragged = refused(&|s| {
        let mut table = example::table();
        table.rows.push(TableRow::new([Cell::Empty]));
        s.table(table);
    });
    assert!(ragged.contains("row 4 has 1 cells for 5 columns"), "{ragged}");
    let caption = String::new();
    let picture = refused(&|s| {
        s.picture(Picture { id: "p".into(), caption: caption.clone(), png: b"GIF89a".to_vec() });
    });
    assert!(picture.contains("picture p: is not a PNG file"), "{picture}");
}

#[test]
fn birds_eye_shows_what_is_there() {
    let look = example::look();
    let empty = birds_eye(&[Panel::default()], &look).unwrap();
    let full = birds_eye(&[example::panel("one", [1.0, 0.0])], &look).unwrap();
    assert!(colours(&full) > 2 * colours(&empty), "{} {}", colours(&full), colours(&empty));
    let far = f64::INFINITY;
    let odd = Panel {
        columns: vec![
            Column { at: [far, f64::NAN], error: None, truth: None, estimate: None },
            Column {
                at: [1.0, 1.0],
                error: Some(far),
                truth: Some([f64::NAN, far]),
                estimate: Some([1e9, 0.0]),
            },
        ],
        points: vec![[f32::INFINITY, 0.0, 0.0], [1.0, 1.0, f32::NAN]],
        ..Panel::default()
    };
    birds_eye(&[odd], &look).unwrap();
    assert!(birds_eye(&[], &Look { half_extent_m: f64::NAN, ..look }).is_err());
}
