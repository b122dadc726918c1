use super::*;
use crate::scratch::Scratch;
use clap::Parser;
use raywake_sim::Rng;

#[derive(Parser)]
struct Toy {
    #[command(flatten)]
    args: Args,
}

/// Strokes of a seven-segment display, by digit.
const STROKES: [u8; CLASSES] = [0x77, 0x24, 0x5d, 0x6d, 0x2e, 0x6b, 0x7b, 0x25, 0x7f, 0x6f];

/// Digits drawn on 8 x 8 pixels, with each stroke a little brighter or darker, and some noise.
fn drawn(count: usize) -> String {
    let mut rng = Rng::new(7);
    let line = |n: usize| {
        let digit = n % CLASSES;
        let mut pixels = [0.0; 64];
        for (stroke, part) in [(0, 1), (1, 8), (2, 8), (3, 1), (4, 8), (5, 8), (6, 1)] {
            let from = [9, 9, 13, 33, 33, 37, 57][stroke];
            if STROKES[digit] >> stroke & 1 == 1 {
                let bright = rng.range(8.0, 16.0);
                (0..4).for_each(|n| pixels[from + n * part] = bright);
            }
        }
        let noisy = pixels.map(|p: f64| (p + rng.range(0.0, 3.0)).min(16.0).round().to_string());
        format!("{},{digit}\n", noisy.join(","))
    };
    (0..count).map(line).collect()
}

/// With three digits, all pairs can be at their desired distances: no loss is left (4.2).
#[test]
fn three_digits_reach_the_optimum() {
    let mut rng = Rng::new(4);
    let mut digits = Digits { pixels: 6, ..Digits::default() };
    for n in 0..300u16 {
        let label = (n % 3) as u8;
        let bright = |pixel: u8| if pixel % 3 == label { 0.8 } else { 0.0 };
        digits.values.extend((0..6u8).map(|p| (bright(p) + rng.range(0.0, 0.2)) as f32));
        digits.labels.push(label);
    }
    let line = ["toy", "digits", "--out", "out", "--hidden", "20", "--steps", "2000", "--l2", "0"];
    let training = Toy::parse_from(line).args.training;
    let encodings = training.encoder(Objective::Features, &digits).of(&digits);
    let (mut sum, mut pairs) = (0.0, 0.0f32);
    for (n, a) in encodings.iter().enumerate() {
        for (m, b) in encodings.iter().enumerate().take(n) {
            let same = digits.labels[n] == digits.labels[m];
            sum += crate::learning::pair_loss(a, b, same, 5.0).0;
            pairs += 1.0;
        }
    }
    assert!(sum / pairs < 0.1, "{}", sum / pairs);
    let told = training.classifier(&encodings, &digits.labels).classify(&encodings);
    assert_eq!(told, digits.labels);
}

/// Every digit gets a place of its own; which ones are confused depends on the seed, since two
/// classes that have collapsed onto each other stay there.
#[test]
fn drawn_digits_end_to_end() {
    let scratch = Scratch::new();
    let digits = scratch.write("digits.csv", drawn(1000));
    let out = scratch.path().join("out");
    let run_once = || {
        let line = ["toy", digits.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let line = line.into_iter().chain(["--steps", "1500", "--hidden", "40,20"]);
        run(&Toy::parse_from(line).args).unwrap();
        std::fs::read_to_string(out.join("tables/table-4-1.csv")).unwrap()
    };
    let table = run_once();
    let all: Vec<f64> =
        table.lines().last().unwrap().split(',').skip(1).map(|v| v.parse().unwrap()).collect();
    assert!(all[1] >= 80.0, "{table}");
    for file in ["charts/figure-4-2.png", "charts/figure-4-3.svg", "report.html"] {
        assert!(out.join(file).exists(), "{file}");
    }
    assert_eq!(run_once(), table);
    assert!(Toy::try_parse_from(["toy", "digits", "--out", "o", "--hidden", "0"]).is_err());
}
