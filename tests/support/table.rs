//! Times of several variants as a table.

use raywake::order_statistics::median;
use raywake_core::digest::Digest;

/// Rows that are not stages: printed last.
const SUMS: [&str; 4] = ["total", "foreground columns", "rays traced", "voxels"];

/// A variant: a value per row and sweep, and the digest of its results.
pub struct Variant {
    /// Description.
    pub name: String,
    rows: Vec<(&'static str, Vec<f64>)>,
    /// Digest of all results.
    pub digest: Digest,
}

impl Variant {
    /// A variant without values.
    pub fn new(name: String) -> Variant {
        Variant { name, rows: Vec::new(), digest: Digest::default() }
    }

    /// Adds to a row of a sweep. The first sweep, which has no pair and warms up, is not counted.
    pub fn add(&mut self, n: usize, row: &'static str, value: f64) {
        let Some(n) = n.checked_sub(1) else { return };
        let known = self.rows.iter().position(|r| r.0 == row);
        let at = known.unwrap_or_else(|| {
            self.rows.push((row, Vec::new()));
            self.rows.len() - 1
        });
        let values = &mut self.rows[at].1;
        values.resize(values.len().max(n + 1), 0.0);
        values[n] += value;
    }

    fn values(&self, row: &str) -> Option<&[f64]> {
        Some(&self.rows.iter().find(|r| r.0 == row)?.1)
    }

    fn median(&self, row: &str) -> Option<f64> {
        Some(median(self.values(row)?.iter().copied()))
    }

    /// Median over sweeps of what this takes divided by what `other` takes.
    fn ratio(&self, other: &Variant, row: &str) -> Option<f64> {
        let both = self.values(row)?.iter().zip(other.values(row)?);
        Some(median(both.map(|(a, b)| a / b)))
    }
}

/// Prints variants and ratios of pairs of them, then checks that variants with equal results agree.
pub fn table(
    title: &str,
    variants: &[Variant],
    ratios: &[(usize, usize)],
    equal: &[(usize, usize)],
) {
    let letter = |n: usize| char::from(b'a' + n as u8);
    let there = |pairs: &[(usize, usize)]| {
        let both = pairs.iter().filter(|(a, b)| *a.max(b) < variants.len());
        both.copied().collect::<Vec<_>>()
    };
    let (ratios, equal) = (there(ratios), there(equal));
    println!("\n{title}");
    for (n, v) in variants.iter().enumerate() {
        println!("  {}  digest {:016x}  {}", letter(n), v.digest.value(), v.name);
    }
    let mut rows: Vec<&str> = Vec::new();
    for (row, _) in variants.iter().flat_map(|v| &v.rows) {
        if !rows.contains(row) {
            rows.push(row);
        }
    }
    rows.sort_by_key(|row| SUMS.contains(row));
    print!("{:22}", "");
    (0..variants.len()).for_each(|n| print!("{:>11}", letter(n)));
    ratios.iter().for_each(|(a, b)| print!("{:>7}/{}", letter(*a), letter(*b)));
    println!();
    for row in rows {
        let medians: Vec<_> = variants.iter().map(|v| v.median(row)).collect();
        let text = |v: Option<f64>| v.map_or("-".to_string(), |v| format!("{v:.2}"));
        print!("{row:22}");
        medians.iter().for_each(|m| print!("{:>11}", text(*m)));
        for (a, b) in &ratios {
            let ratio = variants[*a].ratio(&variants[*b], row);
            print!("{:>9}", ratio.map_or("-".to_string(), |r| format!("{r:.3}")));
        }
        println!();
    }
    for (a, b) in equal {
        let [a, b] = [&variants[a], &variants[b]];
        assert_eq!(a.digest, b.digest, "{} and {} differ", a.name, b.name);
    }
}
