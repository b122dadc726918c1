//! Pictures of known motion.

use raywake_core::output::{ColumnFlow, FlowBasis};
use raywake_core::params::Profile;
use raywake_core::pose::Pose;
use raywake_core::refinement::cues::Cues;
use raywake_core::sweep::Point;
use raywake_io::sink::feather::Voxel;
use raywake_io::source::SweepData;
use raywake_render::{Canvas, colours};

use super::flow::BEYOND;
use super::{PictureFiles, Pictures, Subject};
use crate::args::PictureFrame;

fn draw(columns: &[ColumnFlow], yaw_rad: f64, frame: PictureFrame) -> Canvas {
    let point = |i: u8| Point { position: [0.1 * f32::from(i), 8.0, -1.7], ..Point::default() };
    let sweep = SweepData {
        points: (0..100).map(point).collect(),
        world_from_vehicle: Pose::planar(5.0, -3.0, 0.0, yaw_rad),
        ..SweepData::default()
    };
    let subject = Subject::Flow { columns, profile: &Profile::hdl64(), frame };
    super::pictures::draw(&sweep, &subject)
}

/// Centroid of the strong colours of the panel, m forward and left, and their number of pixels.
fn motion(canvas: &Canvas) -> ([f64; 2], usize) {
    let width = canvas.size()[0] as usize;
    // The panel is 900 pixels wide and high, 14 from the left and 44 from the top.
    let rows = canvas.rgba().chunks(4 * width).skip(44).take(900);
    let pixels = rows.enumerate().flat_map(|(y, row)| {
        let strong = |p: &[u8]| p[0].saturating_sub(p[2]) > 60 || p[0].saturating_sub(p[1]) > 60;
        let row = row.chunks(4).skip(14).enumerate().filter(move |(_, p)| strong(p));
        row.map(move |(x, _)| [449.5 - y as f64, 449.5 - x as f64])
    });
    let pixels: Vec<[f64; 2]> = pixels.collect();
    let profile = Profile::hdl64();
    let per_m = 450.0 / (BEYOND * 0.5 * f64::from(profile.side) * profile.voxel_m);
    let n = pixels.len();
    ([0, 1].map(|a| pixels.iter().map(|p| p[a]).sum::<f64>() / n as f64 / per_m), n)
}

const COLUMN: ColumnFlow = ColumnFlow {
    cell: [0; 2],
    position_world_m: [0.0; 2],
    position_vehicle_m: [10.0, 0.0],
    displacement_cells: [0; 2],
    displacement_m: [1.0, 0.0],
    displacement_covariance: [0.0; 3],
    energy: 0,
    velocity_world_mps: [10.0, 0.0],
    velocity_ego_mps: [0.0, -10.0],
    covariance: [0.0; 3],
    age: 3,
    basis: FlowBasis::Matched,
    probability: 1.0,
    cues: Cues::NONE,
    class: None,
};

#[test]
fn arrows_point_where_columns_go() {
    let ([x, y], _) = motion(&draw(&[COLUMN], 0.0, PictureFrame::Ego));
    assert!(y < -1.0 && (x - 10.0).abs() < 0.3, "{x} {y}");
    // The vehicle heads along world y: world x is to its right.
    let quarter = core::f64::consts::FRAC_PI_2;
    let ([x, y], _) = motion(&draw(&[COLUMN], quarter, PictureFrame::World));
    assert!(y < -1.0 && (x - 10.0).abs() < 0.3, "{x} {y}");
    let ([x, y], _) = motion(&draw(&[COLUMN], 0.0, PictureFrame::World));
    assert!(y.abs() < 0.3 && x > 11.0, "{x} {y}");
}

#[test]
fn motion_is_drawn_from_the_first_observation_on_thinner_while_young() {
    let pixels = |column| motion(&draw(&[column], 0.0, PictureFrame::World)).1;
    let young = pixels(ColumnFlow { age: 0, ..COLUMN });
    assert!(young > 50, "{young}");
    assert!(pixels(COLUMN) > young);
    assert!(pixels(ColumnFlow { basis: FlowBasis::Joined, ..COLUMN }) > young);
}

#[test]
fn static_and_unknown_cells_have_no_arrow() {
    let static_ = ColumnFlow { velocity_world_mps: [0.3, 0.0], ..COLUMN };
    let unmatched = ColumnFlow { basis: FlowBasis::Unmatched, ..COLUMN };
    let nonsense = ColumnFlow { velocity_world_mps: [f32::NAN; 2], ..COLUMN };
    let picture = draw(&[static_, unmatched, nonsense], 0.0, PictureFrame::World);
    assert_eq!(motion(&picture).1, 0);
}

#[test]
fn map_shows_static_structure_and_free_space() {
    // A wall 3 m high 20 m ahead, a free lane up to it, ground to its right; voxels of 0.4 m.
    let voxel = |i, j, k, log_odds_tenths| Voxel { index: [i, j, k], log_odds_tenths };
    let ground = (0..100).map(|i| voxel(i, -60, 0, 20));
    let lane = (0..50).map(|i| voxel(i, 0, 0, -20));
    let wall =
        (-10..10).flat_map(|j| [voxel(50, j, 0, 20), voxel(50, j, 7, 20), voxel(50, j, 8, -5)]);
    let voxels: Vec<Voxel> = lane.chain(wall).chain(ground).collect();
    let subject = Subject::Map { voxels: &voxels, origin_m: [100.0, 50.0, -1.7], voxel_m: 0.4 };
    let sweep = SweepData {
        world_from_vehicle: Pose::planar(100.0, 50.0, 0.0, 0.0),
        ..SweepData::default()
    };
    let picture = super::pictures::draw(&sweep, &subject);
    let width = picture.size()[0] as usize;
    // 4.5 pixels per metre, the vehicle in the middle of the panel.
    let at = |x_m: f64, y_m: f64| {
        let (row, column) = (44.0 + 450.0 - 4.5 * x_m, 14.0 + 450.0 - 4.5 * y_m);
        let pixel = 4 * (row as usize * width + column as usize);
        [0, 1, 2].map(|c| picture.rgba()[pixel + c])
    };
    assert_eq!(at(10.0, 0.2), colours::FREE);
    assert_eq!(at(10.0, 8.0), colours::GROUND);
    assert!(at(20.2, 2.2)[1] < 200, "{:?}", at(20.2, 2.2));
}

/// The parts of a page between these strings.
fn between<'a>(page: &'a str, from: &str, to: &str) -> Vec<&'a str> {
    let parts = page.split(from).skip(1);
    parts.map(|part| part.split_once(to).unwrap().0).collect()
}

#[test]
fn page_lists_every_sweep_and_shows_some() {
    let folder = tempfile::tempdir().unwrap();
    let [page, film, none] = ["p.html", "f.png", "n.html"].map(|name| folder.path().join(name));
    let files = |page, film| PictureFiles { folder: None, page: Some(page), film };
    // Of 700 sweeps every third has a picture; the recording ends early.
    let asked = files(page.clone(), Some(film.clone()));
    let mut pictures = Pictures::create(&asked, "a <b> & c", 700).unwrap();
    for n in 0..5 {
        let sweep = SweepData {
            frame: u64::MAX - n,
            stamp_s: 7.0 + 0.1 * n as f64,
            ..SweepData::default()
        };
        let profile = Profile::hdl64();
        let (columns, frame) = (&[COLUMN][..], PictureFrame::World);
        let subject = Subject::Flow { columns, profile: &profile, frame };
        pictures.write(&sweep, &subject, &[("moving", n as f64), ("ms", f64::NAN)]).unwrap();
    }
    assert!(!page.exists() && !film.exists());
    pictures.finish("all & done").unwrap();
    assert!(film.exists());

    let text = std::fs::read_to_string(&page).unwrap();
    let moments = between(&text, "<script>add(", ")</script>");
    let moments: Vec<serde_json::Value> =
        moments.iter().map(|m| serde_json::from_str(m).unwrap()).collect();
    assert_eq!(moments.len(), 5);
    assert_eq!(moments[1]["frame"], (u64::MAX - 1).to_string());
    assert!((moments[4]["time_s"].as_f64().unwrap() - 0.4).abs() < 1e-9);
    assert_eq!(moments[4]["figures"], serde_json::json!([4.0, null]));
    let shown: Vec<bool> = moments.iter().map(|m| m.get("picture").is_some()).collect();
    assert_eq!(shown, [true, false, false, true, false]);
    assert!(moments[0]["picture"].as_str().unwrap().starts_with("iVBORw0KGgo"), "a PNG file");
    assert_eq!(between(&text, "<h1>", "</h1>"), ["a &lt;b&gt; &amp; c"]);
    assert_eq!(between(&text, "<pre>", "</pre>"), ["all &amp; done"]);
    assert_eq!(between(&text, "names = ", ";"), ["[\"moving\",\"ms\"]"]);

    // Without sweeps there is no page.
    Pictures::create(&files(none.clone(), None), "", 0).unwrap().finish("").unwrap();
    assert!(!none.exists());
}
