//! Pictures of small scenes, pixel by pixel.

use crate::canvas::Canvas;
use crate::{
    Arrow, Cell, Colour, Film, LegendEntry, Look, Outline, Panel, PictureError, Sign, Trail,
    birds_eye, colours,
};

const RED: Colour = [200, 0, 0];
const BLUE: Colour = [0, 0, 200];
/// Margins left of and above a panel, pixels at a scale of 1.
const LEFT: u32 = 14;
const TOP: u32 = 44;

/// 20 m to every side, 10 pixels per metre.
fn look() -> Look {
    Look {
        half_extent_m: 20.0,
        cell_m: 0.3,
        height_m: 2.5,
        heights: colours::HEIGHTS,
        side: 400.0,
        scale: 1.0,
        legend: Vec::new(),
    }
}

fn cell(at: [f32; 2], vector: [f32; 2]) -> Cell {
    let arrow = Arrow { vector, colour: RED, width: 2.0 };
    Cell { at, colour: BLUE, arrows: [Some(arrow), None] }
}

fn draw(panel: Panel) -> Canvas {
    birds_eye(&[panel], &look()).unwrap()
}

fn pixel(canvas: &Canvas, x: u32, y: u32) -> Colour {
    let at = 4 * (y * canvas.size()[0] + x) as usize;
    let rgba = &canvas.rgba()[at..at + 4];
    assert_eq!(rgba[3], 255, "no pixel is transparent");
    [rgba[0], rgba[1], rgba[2]]
}

/// Positions of the pixels of a colour, including edges, m in the scene.
fn places(canvas: &Canvas, colour: Colour) -> Vec<[f32; 2]> {
    let [width, height] = canvas.size();
    let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let like = |found: Colour| found.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 85);
    let same = all.filter(|(x, y)| like(pixel(canvas, *x, *y)));
    let metres = |v: u32, from: u32| (200.0 + from as f32 - v as f32 - 0.5) / 10.0;
    same.map(|(x, y)| [metres(y, TOP), metres(x, LEFT)]).collect()
}

fn bounds(places: &[[f32; 2]], axis: usize) -> [f32; 2] {
    let values = || places.iter().map(|p| p[axis]);
    [values().fold(f32::MAX, f32::min), values().fold(f32::MIN, f32::max)]
}

/// FNV-1a.
fn digest(canvas: &Canvas) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    canvas.rgba().iter().fold(0xcbf2_9ce4_8422_2325, step)
}

#[test]
fn arrows_lie_where_the_motion_is() {
    let picture = draw(Panel { cells: vec![cell([10.0, 5.0], [0.0, -4.0])], ..Panel::default() });
    let red = places(&picture, RED);
    let ([x0, x1], [y0, y1]) = (bounds(&red, 0), bounds(&red, 1));
    assert!(x0 > 9.5 && x1 < 10.5, "10 m ahead: {x0} to {x1}");
    assert!((y1 - 5.0).abs() < 0.3 && (1.0..1.4).contains(&y0), "5 m to 1 m left: {y1} to {y0}");
    // The head, at the tip, is wider than the shaft.
    let wide = |y: f32| red.iter().filter(|p| (p[1] - y).abs() < 0.05).count();
    assert!(wide(1.75) > wide(3.05) + 2, "{} {}", wide(1.75), wide(3.05));
}

#[test]
fn one_arrow_for_four_cells_and_every_cell() {
    let grid = (0..4).flat_map(|i| (0..4).map(move |j| [i, j].map(|v| 0.3 * v as f32 + 0.15)));
    let cells: Vec<Cell> = grid.map(|at| cell(at, [6.0, 0.0])).collect();
    let picture = draw(Panel { cells, ..Panel::default() });
    let red = places(&picture, RED);
    let across = red.iter().filter(|p| (p[0] - 3.05).abs() < 0.01).count();
    assert!((2..=6).contains(&across), "two shafts of two pixels and their edges: {across}");
}

#[test]
fn rings_have_their_radius_and_labels() {
    let picture = draw(Panel::default());
    // 5 m, to the right of the middle and above it.
    for (x, y) in [(LEFT + 250, TOP + 200), (LEFT + 200, TOP + 150)] {
        let near = [(x, y), (x - 1, y), (x, y - 1), (x - 1, y - 1)];
        assert!(near.iter().any(|&(x, y)| pixel(&picture, x, y) != colours::GROUND), "{x} {y}");
    }
    for x in [LEFT + 225, LEFT + 275] {
        assert_eq!(pixel(&picture, x, TOP + 200), colours::GROUND, "no ring at {x}");
    }
    // Dark pixels of "5 m", 5 m away to the lower left.
    let label = (0..20).flat_map(|i| (0..12).map(move |j| (LEFT + 155 + i, TOP + 229 + j)));
    assert!(label.filter(|&(x, y)| pixel(&picture, x, y)[0] < 160).count() > 10);
}

#[test]
fn outside_the_window_points_are_paler() {
    let window = Some([[5.0, 5.0], [5.0, -5.0], [-5.0, -5.0], [-5.0, 5.0]]);
    let points = vec![[2.0, 2.0, 0.0], [8.0, 8.0, 0.0]];
    let shaded = draw(Panel { window, points: points.clone(), ..Panel::default() });
    let plain = draw(Panel { points, ..Panel::default() });
    let at = |picture: &Canvas, m: u32| pixel(picture, LEFT + 200 - 10 * m, TOP + 200 - 10 * m);
    assert_eq!(at(&shaded, 2), at(&plain, 2));
    assert!(at(&shaded, 8)[0] > at(&plain, 8)[0]);
    let border = (LEFT + 150..LEFT + 250).filter(|x| pixel(&shaded, *x, TOP + 150)[0] < 200);
    assert!((50..80).contains(&border.count()), "dashes of 6 pixels, gaps of 4");
}

#[test]
fn boxes_trails_and_the_vehicle_are_there() {
    let outline = Outline {
        at: [10.0, 0.0],
        forward: [0.0, 1.0],
        size: [4.0, 2.0],
        colour: RED,
        label: "7".into(),
        arrow: None,
    };
    let trail = Trail { places: vec![[-10.0, -5.0], [-10.0, 5.0]], colour: BLUE, width: 2.0 };
    let panel =
        Panel { outlines: vec![outline], trails: vec![trail], vehicle: true, ..Panel::default() };
    let picture = draw(panel);
    let red = places(&picture, RED);
    // Its front points left: on the picture it is 4 m wide, and 2 m high except for the number.
    let [right, left] = bounds(&red, 1);
    assert!((left - 2.0).abs() < 0.2 && (right + 2.0).abs() < 0.2, "{left} {right}");
    assert_eq!(bounds(&places(&picture, BLUE), 1), [-4.95, 4.95]);
    let inside = |p: &&[f32; 2]| p[0].abs() < 2.6 && p[1].abs() < 1.0;
    let dark = places(&picture, colours::VEHICLE);
    assert!(dark.iter().filter(inside).count() > 500);
}

#[test]
fn the_legend_has_a_row_for_what_fits() {
    let entry = LegendEntry { sign: Sign::Cell(RED), text: "moving, of some length".into() };
    let height = |n: usize| {
        let look = Look { legend: vec![entry.clone(); n], ..look() };
        let picture = birds_eye(&[Panel::default()], &look).unwrap();
        let signs = places(&picture, RED).len();
        assert_eq!(signs, 100 * n, "a square of 10 pixels each");
        picture.size()[1]
    };
    assert_eq!(height(1), height(0) + 12 + 26);
    assert_eq!(height(2), height(1));
    assert_eq!(height(5), height(1) + 2 * 26);
}

#[test]
fn titles_end_before_notes() {
    let page = |title: &str| {
        let note = "frame 17, 1.70 s".to_string();
        draw(Panel { title: title.into(), note, ..Panel::default() })
    };
    let (short, long) = (page("Flow"), page(&"Flow and more of it ".repeat(9)));
    let note = |p: &Canvas| (330..414).map(|x| pixel(p, x, 30)).collect::<Vec<_>>();
    assert_eq!(note(&short), note(&long));
    let gap = (300..320).flat_map(|x| (20..44).map(move |y| (x, y)));
    assert!(gap.into_iter().all(|(x, y)| pixel(&long, x, y) == colours::PAPER));
}

/// Everything at once.
fn full() -> Canvas {
    let point = |i: i32| {
        [0.37 * (i % 90) as f32 - 17.0, 0.4 * (i / 90) as f32 - 18.0, 0.03 * (i % 70) as f32]
    };
    let outline = Outline {
        at: [8.0, -6.0],
        forward: [0.6, 0.8],
        size: [4.4, 1.9],
        colour: BLUE,
        label: "12".into(),
        arrow: Some(Arrow { vector: [3.0, 4.0], colour: RED, width: 1.7 }),
    };
    let panel = Panel {
        title: "Flow over ground".into(),
        note: "frame 3, 0.31 s".into(),
        points: (0..8000).map(point).collect(),
        tiles: vec![cell([3.0, 3.0], [0.0, 0.0])],
        cells: (0..40).map(|i| cell([-9.0 + 0.3 * i as f32, 4.1], [1.0, 2.5])).collect(),
        outlines: vec![outline],
        trails: vec![Trail {
            places: (0..30).map(|i| [0.5 * i as f32, 0.02 * (i * i) as f32]).collect(),
            colour: RED,
            width: 1.5,
        }],
        window: Some([[14.0, 11.0], [13.0, -14.0], [-12.0, -13.0], [-13.0, 12.0]]),
        vehicle: true,
    };
    let entry = |sign, text: &str| LegendEntry { sign, text: text.into() };
    let legend = vec![
        entry(Sign::Ramp(colours::SPEEDS, ["0".into(), "≥ 15".into()]), "m/s"),
        entry(Sign::Arrow(Arrow { vector: [5.0, 0.0], colour: RED, width: 1.7 }), "10 m/s"),
        entry(Sign::Outline(BLUE), "car"),
        entry(Sign::Line(crate::WINDOW), "window"),
    ];
    birds_eye(&[panel.clone(), panel], &Look { legend, scale: 1.5, ..look() }).unwrap()
}

#[test]
fn the_same_bytes_everywhere() {
    let picture = full();
    assert_eq!(format!("{:016x}", digest(&picture)), "6b3adb3c84f7bca0");
}

#[test]
fn a_png_is_read_back() {
    let picture = draw(Panel::default());
    let mut reader = png::Decoder::new(std::io::Cursor::new(picture.png())).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgb).unwrap();
    assert_eq!([info.width, info.height], picture.size());
    let flat: Vec<u8> = picture.rgba().chunks(4).flat_map(|p| p[..3].to_vec()).collect();
    assert!(rgb == flat);
}

#[test]
fn invalid_input_is_left_out() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, 0.0];
    let pairs = || odd.iter().flat_map(|x| odd.map(|y| [*x, y]));
    let outline = |[a, b]: [f32; 2]| Outline {
        at: [a, b],
        forward: [b, a],
        size: [a, b],
        colour: RED,
        label: "odd".into(),
        arrow: Some(Arrow { vector: [a, b], colour: RED, width: a }),
    };
    let panel = Panel {
        points: pairs().map(|[a, b]| [a, b, a]).collect(),
        tiles: pairs().map(|at| cell(at, at)).collect(),
        cells: pairs().map(|[a, b]| cell([b, 1.0], [a, b])).collect(),
        outlines: pairs().map(outline).collect(),
        trails: vec![Trail { places: pairs().collect(), colour: RED, width: f32::NAN }],
        window: Some([[f32::NAN; 2]; 4]),
        ..Panel::default()
    };
    for half_extent_m in [1e-3, 0.5, 20.0, 1e4, 1e9] {
        birds_eye(std::slice::from_ref(&panel), &Look { half_extent_m, ..look() }).unwrap();
    }
    birds_eye(&[], &look()).unwrap();
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let fails = |look: Look| birds_eye(&[Panel::default()], &look).err().unwrap();
    assert!(matches!(fails(Look { half_extent_m: f32::NAN, ..look() }), PictureError::Extent(_)));
    assert_eq!(fails(Look { half_extent_m: 0.0, ..look() }), PictureError::Extent(0.0));
    assert_eq!(fails(Look { cell_m: -1.0, ..look() }), PictureError::Extent(-1.0));
    assert!(matches!(fails(Look { side: 1e6, ..look() }), PictureError::Size(_)));
    assert!(matches!(fails(Look { scale: 0.0, ..look() }), PictureError::Size(_)));
}

#[test]
fn each_picture_of_a_film_is_shown_for_its_duration() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.png");
    let out = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    let pictures = [1.0, 5.0, 9.0]
        .map(|x| draw(Panel { cells: vec![cell([x, 0.0], [0.0, 3.0])], ..Panel::default() }));
    let mut film = Film::new(out, pictures[0].size()).unwrap();
    for (picture, shown_s) in pictures.iter().zip([0.1, 0.25, f64::NAN]) {
        film.frame(picture, shown_s).unwrap();
    }
    let other = birds_eye(&[], &Look { side: 300.0, ..look() }).unwrap();
    assert!(film.frame(&other, 0.1).unwrap_err().to_string().contains("in a film of 428 x"));
    film.finish().unwrap();

    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    assert_eq!(reader.info().animation_control.unwrap().num_frames, 3);
    for (picture, shown_ms) in pictures.iter().zip([100, 250, 20]) {
        let mut found = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut found).unwrap();
        assert!(found == picture.rgb());
        let control = reader.info().frame_control.unwrap();
        assert_eq!((control.delay_num, control.delay_den), (shown_ms, 1000));
    }
}
