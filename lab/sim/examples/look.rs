//! Writes two pictures of a sweep, from above and as the sensor sees it:
//! `look SEED SWEEP FOLDER`.

use raywake_sim::{Class, Drive, Options, SimSweep};
use std::io::Write;

const SIDE: usize = 1000;
const PIXELS_PER_M: f32 = 8.0;
const WIDE: usize = 2048;
const ROW: usize = 5;

fn colour(class: Class, fast: bool) -> [u8; 3] {
    match class {
        Class::Ground => [90, 90, 90],
        Class::Building => [150, 110, 80],
        Class::Pole => [220, 220, 60],
        Class::Vegetation => [40, 160, 40],
        Class::Fixture => [150, 150, 200],
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

fn as_seen(sweep: &SimSweep) -> Vec<u8> {
    let mut image = vec![0u8; WIDE * 64 * ROW * 3];
    for (p, t) in sweep.points.iter().zip(&sweep.truth) {
        let [x, y, z] = p.position;
        let column = ((p.offset_s + 0.05) / 0.1 * WIDE as f32) as usize;
        let down = 2.0 - z.atan2(x.hypot(y)).to_degrees();
        let beam = if down < 10.58 { down * 31.0 / 10.33 } else { 32.0 + (down - 10.83) * 2.0 };
        let beam = (beam.round().max(0.0) as usize).min(63);
        let shade = 0.35 + 0.65 * (-x.hypot(y) / 30.0).exp();
        let fast = t.velocity_world.iter().map(|v| v * v).sum::<f32>() > 0.04;
        let rgb = colour(t.class, fast).map(|c| (f32::from(c) * shade) as u8);
        for row in 0..ROW {
            let at = 3 * ((beam * ROW + row) * WIDE + column.min(WIDE - 1));
            image[at..at + 3].copy_from_slice(&rgb);
        }
    }
    image
}

fn write(path: &str, wide: usize, rgb: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::File::create(path)?;
    writeln!(file, "P6 {wide} {} 255", rgb.len() / 3 / wide)?;
    file.write_all(rgb)
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|a| a.parse().ok()).unwrap_or(0);
    let folder = arguments.get(2).map_or(".", String::as_str);
    let drive = Drive::new(number(0), Options::default());
    let begin = std::time::Instant::now();
    let sweep = drive.sweep(number(1) as usize);
    println!("{} returns in {:.0} ms", sweep.points.len(), 1e3 * begin.elapsed().as_secs_f64());
    write(&format!("{folder}/above.ppm"), SIDE, &from_above(&sweep))?;
    write(&format!("{folder}/seen.ppm"), WIDE, &as_seen(&sweep))
}
