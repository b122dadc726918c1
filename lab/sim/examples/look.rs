//! Writes two pictures of a sweep, one from above and one as the sensor sees it:
//! `look SEED SWEEP FOLDER [RIG] [SCENERY] [CLUTTER]`.

use raywake_sim::{Class, Drive, Options, SensorRig, SimSweep};
use std::io::Write;

const SIDE: usize = 1000;
const PIXELS_PER_M: f32 = 8.0;
/// Columns of the sensor's view, and its rows of 0.2 degrees from `TOP` downwards.
const WIDE: usize = 1800;
const HIGH: usize = 240;
const TOP: f32 = 20.0;

fn colour(class: Class, fast: bool) -> [u8; 3] {
    match class {
        Class::Ground => [90, 90, 90],
        Class::Building => [150, 110, 80],
        Class::Pole => [220, 220, 60],
        Class::Vegetation => [40, 160, 40],
        Class::Fixture => [150, 150, 200],
        Class::Clutter => [255, 255, 255],
        _ if fast => [255, 60, 60],
        _ => [80, 160, 255],
    }
}

fn from_above(sweep: &SimSweep) -> Vec<u8> {
    let mut image = vec![0u8; SIDE * SIDE * 3];
    for (p, t) in sweep.points.iter().zip(&sweep.truth) {
        let [x, y, _] = p.position;
        let (u, v) = (0.5 * SIDE as f32 - y * PIXELS_PER_M, 0.5 * SIDE as f32 - x * PIXELS_PER_M);
        if u < 0.0 || v < 0.0 || u >= SIDE as f32 || v >= SIDE as f32 {
            continue;
        }
        let at = 3 * (v as usize * SIDE + u as usize);
        let fast = t.velocity_world.iter().map(|v| v * v).sum::<f32>() > 0.04;
        image[at..at + 3].copy_from_slice(&colour(t.class, fast));
    }
    image
}

/// View from `eye` metres above the vehicle frame's origin, with forward in the middle.
fn as_seen(sweep: &SimSweep, eye: f32) -> Vec<u8> {
    let mut image = vec![0u8; WIDE * HIGH * 3];
    for (p, t) in sweep.points.iter().zip(&sweep.truth) {
        let [x, y, z] = p.position;
        let turned = 0.5 - y.atan2(x) / std::f32::consts::TAU;
        let column = ((turned * WIDE as f32) as usize).min(WIDE - 1);
        let down = 5.0 * (TOP - (z - eye).atan2(x.hypot(y)).to_degrees());
        let shade = 0.35 + 0.65 * (-x.hypot(y) / 30.0).exp();
        let fast = t.velocity_world.iter().map(|v| v * v).sum::<f32>() > 0.04;
        let rgb = colour(t.class, fast).map(|c| (f32::from(c) * shade) as u8);
        for row in [down as usize, down as usize + 1] {
            if row < HIGH {
                let at = 3 * (row * WIDE + column);
                image[at..at + 3].copy_from_slice(&rgb);
            }
        }
    }
    image
}

fn write(path: &str, wide: usize, rgb: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::File::create(path)?;
    writeln!(file, "P6 {wide} {} 255", rgb.len() / 3 / wide)?;
    file.write_all(rgb)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|a| a.parse().ok()).unwrap_or(0);
    let folder = arguments.get(2).map_or(".", String::as_str);
    let rig: SensorRig = arguments.get(3).map_or("hdl64", String::as_str).parse()?;
    let eye = rig.mounts.first().map_or(0.0, |m| m.vehicle_from_sensor.translation.z) as f32;
    let scenery = arguments.get(4).map_or("street", String::as_str).parse()?;
    let clutter = arguments.get(5).map_or("none", String::as_str).parse()?;
    let drive = Drive::new(number(0), Options { rig, scenery, clutter, ..Options::default() });
    let begin = std::time::Instant::now();
    let sweep = drive.sweep(number(1) as usize);
    println!("{} returns in {:.0} ms", sweep.points.len(), 1e3 * begin.elapsed().as_secs_f64());
    write(&format!("{folder}/above.ppm"), SIDE, &from_above(&sweep))?;
    write(&format!("{folder}/seen.ppm"), WIDE, &as_seen(&sweep, eye))?;
    Ok(())
}
