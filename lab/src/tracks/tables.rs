//! Tables 2.1 and 2.2 of the dissertation, and related counts.

use super::errors::{Errors, Rmse};
use super::evaluate::{AS_PRINTED, MAIN, OURS, Outcome, Score, methods};
use super::front_ends::Found;
use crate::labels::Kind;
use crate::report::{Cell, Table, TableRow};
use raywake::order_statistics::median;

/// Tracks listed as the worst.
const WORST: usize = 10;

/// Bins of the range of the nearest return, m: in the adjacent lane, one lane between, farther.
const PASSING_M: [(f64, f64); 3] = [(0.0, 4.0), (4.0, 8.0), (8.0, f64::INFINITY)];

/// An object that turns by less goes straight on, rad.
const STRAIGHT_RAD: f64 = 0.1;

/// Table 2.1: baseline, n_m = 300, n_m = 3000; m, m/s, rad, rad/s.
const PRINTED: [(&str, [f64; 4]); 3] = [
    ("dissertation, baseline EKF", [0.388, 0.543, 0.527, 0.139]),
    ("dissertation, n_m = 300", [0.162, 0.314, 0.071, 0.026]),
    ("dissertation, n_m = 3000", [0.183, 0.328, 0.090, 0.027]),
];

/// Table 2.2: truth, baseline, n_m = 300; nats.
const PRINTED_ENTROPY: [(&str, [f64; 3]); 2] = [
    ("dissertation, stationary", [1.920, 2.237, 2.103]),
    ("dissertation, dynamic", [f64::NAN, 2.860, 2.756]),
];

pub struct Set {
    /// Part of the tables' ids.
    pub id: String,
    /// As in "simulated, stationary".
    pub name: String,
    pub outcomes: Vec<Outcome>,
}

impl Set {
    /// Errors of a tracker over some objects.
    fn errors(&self, method: usize, of: impl Fn(&Outcome) -> bool) -> Errors {
        let mut errors = Errors::default();
        let some = self.outcomes.iter().filter(|o| of(o));
        some.for_each(|o| errors.merge(&o.scores[method].errors));
        errors
    }

    fn mean(&self, value: impl Fn(&Outcome) -> f64) -> f64 {
        self.outcomes.iter().map(value).sum::<f64>() / self.outcomes.len() as f64
    }

    /// Mean entropy by a tracker, nats.
    fn entropy(&self, method: usize) -> f64 {
        self.mean(|o| o.scores[method].entropy)
    }

    /// Share of the baseline's excess entropy over the truth that a tracker removes.
    pub fn gap_closed(&self, method: usize) -> f64 {
        let (truth, baseline) = (self.mean(|o| o.entropy), self.entropy(0));
        (baseline - self.entropy(method)) / (baseline - truth)
    }

    /// Share of tracks on which a tracker's error is less than the baseline's.
    pub fn better(&self, method: usize, error: impl Fn(&Rmse) -> f64) -> f64 {
        let less = |o: &Outcome| {
            error(&o.scores[method].errors.rmse()) < error(&o.scores[0].errors.rmse())
        };
        self.mean(|o| f64::from(u8::from(less(o))))
    }

    /// Root mean square errors of a tracker over all moments of all tracks.
    pub fn rmse(&self, method: usize) -> Rmse {
        self.errors(method, |_| true).rmse()
    }

    /// Number of objects, and how long and by how many returns they are seen.
    pub fn about(&self) -> String {
        format!(
            "{}: {} objects, each seen for {:.2} s by {:.0} returns on average",
            self.name,
            self.outcomes.len(),
            self.mean(|o| o.span_s),
            self.mean(|o| o.returns as f64)
        )
    }
}

/// A table whose column titles are separated by `|`.
fn table(id: String, caption: String, columns: &str, rows: Vec<TableRow>) -> Table {
    let columns = columns.split('|').map(|c| c.trim().to_string()).collect();
    Table { id, caption, columns, rows, notes: Vec::new() }
}

/// A row with a name and numbers with this many decimals.
fn numbers(name: &str, numbers: impl IntoIterator<Item = f64>, digits: usize) -> Vec<Cell> {
    let cells = numbers.into_iter().map(|v| Cell::Number(v, digits));
    [Cell::from(name)].into_iter().chain(cells).collect()
}

/// Errors as in table 2.1, for one set.
pub fn errors(set: &Set) -> Table {
    let stationary = set.outcomes.iter().any(|o| o.stationary);
    let mut rows = Vec::new();
    if stationary {
        rows.extend(PRINTED.map(|(name, [position, velocity, heading, rate])| {
            let none = f64::NAN;
            let all = [position, none, none, velocity, heading, rate, none, none];
            TableRow::reference(numbers(name, all, 3))
        }));
    }
    for (n, (name, _)) in methods().iter().enumerate() {
        rows.push(error_row(set, name, n, |_| true));
    }
    let straight = |o: &Outcome| o.turned_rad < STRAIGHT_RAD;
    let count = set.outcomes.iter().filter(|o| straight(o)).count();
    if (1..set.outcomes.len()).contains(&count) {
        for n in [0, OURS] {
            let name = format!("{}: the {count} that go straight", methods()[n].0);
            rows.push(error_row(set, &name, n, straight));
        }
    }
    let against = match stationary {
        true => "position and heading about their means, velocity and heading rate from zero",
        false => "against the truth at the same point of the body, after one transform per track",
    };
    let caption = format!(
        "As table 2.1, {}. Root mean squares over the batches of all tracks: {against}.",
        set.about()
    );
    let columns = "Tracker | Position, m | x and y, m | z, m | Velocity, m/s | Heading, rad \
        | Heading rate, rad/s | Median track's position, m | Flips";
    table(format!("errors-{}", set.id), caption, columns, rows)
}

/// The errors compared in the dissertation, by how near the vehicle passes, and their ratios to the
/// baseline's; and those it prints.
pub fn by_distance(set: &Set) -> Table {
    let none = f64::NAN;
    let mut rows = Vec::new();
    let baseline = PRINTED[0].1;
    for (name, errors) in PRINTED {
        let ratios = [0, 1, 2, 3].map(|n| errors[n] / baseline[n]);
        rows.push(TableRow::reference(numbers(
            name,
            [none].into_iter().chain(errors).chain(ratios),
            3,
        )));
    }
    for (least, most) in PASSING_M {
        let of = |o: &Outcome| (least..most).contains(&o.nearest_m);
        let count = set.outcomes.iter().filter(|o| of(o)).count();
        if count == 0 {
            continue;
        }
        let errors = |method: usize| {
            let r = set.errors(method, of).rmse();
            [r.position, r.velocity, r.heading, r.turn_rate]
        };
        let baseline = errors(0);
        for n in AS_PRINTED {
            let (name, errors) = (methods()[n].0, errors(n));
            let ratios = [0, 1, 2, 3].map(|n| errors[n] / baseline[n]);
            let name = match most.is_finite() {
                true => format!("{name}, {least} to {most} m"),
                false => format!("{name}, {least} m or more"),
            };
            let all = [count as f64].into_iter().chain(errors).chain(ratios);
            rows.push(TableRow::new(numbers(&name, all, 3)));
        }
    }
    let caption = format!(
        "Table 2.1 by the range of an object's nearest return, {}; also errors as multiples of the \
         baseline's.",
        set.name
    );
    let columns = "Tracker | Objects | Position, m | Velocity, m/s | Heading, rad \
        | Heading rate, rad/s | Position, ratio | Velocity, ratio | Heading, ratio \
        | Heading rate, ratio";
    table(format!("distance-{}", set.id), caption, columns, rows)
}

/// A row of [`errors`]: a tracker over some objects.
fn error_row(set: &Set, name: &str, method: usize, of: impl Fn(&Outcome) -> bool) -> TableRow {
    let errors = set.errors(method, &of);
    let r = errors.rmse();
    let all = [r.position, r.ground, r.height, r.velocity, r.heading, r.turn_rate];
    let some = set.outcomes.iter().filter(|o| of(o));
    let median = median(some.map(|o| o.scores[method].errors.rmse().position));
    let cells = numbers(name, all.into_iter().chain([median]), 3);
    TableRow::new(cells.into_iter().chain([Cell::from(errors.flips)]))
}

/// A row of [`errors`]: how far labels of parked objects wander in the world, including the drift
/// of the poses and the labels' own errors.
pub fn wandering(labels: &Errors) -> TableRow {
    let r = labels.rmse();
    let all = [r.position, r.ground, r.height, f64::NAN, r.heading, f64::NAN, f64::NAN];
    let cells = numbers("the labels, including the poses' drift", all, 3);
    TableRow::reference(cells.into_iter().chain([Cell::Empty]))
}

/// Share of tracks better than the baseline's, and times.
pub fn better(set: &Set) -> Table {
    let row = |n: usize| {
        let shares = [
            set.better(n, |r| r.position),
            set.better(n, |r| r.velocity),
            set.better(n, |r| r.heading),
            set.better(n, |r| r.turn_rate),
        ];
        let crisper = |o: &Outcome| f64::from(u8::from(o.scores[n].entropy < o.scores[0].entropy));
        let iterations = |s: &Score| s.costs.len().saturating_sub(1) as f64;
        let ms = 1e3 * set.mean(|o| o.scores[n].seconds);
        let shares = shares.into_iter().chain([set.mean(crisper)]).map(|v| 100.0 * v);
        let work = [set.mean(|o| iterations(&o.scores[n])), ms];
        TableRow::new(numbers(methods()[n].0, shares.chain(work), 1))
    };
    let caption =
        format!("Share of tracks with a smaller error than the baseline's, {}.", set.name);
    let columns = "Tracker | Position, % | Velocity, % | Heading, % | Heading rate, % \
        | Entropy, % | Iterations | Time, ms";
    let rows = (1..methods().len()).map(row).collect();
    let mut table = table(format!("better-{}", set.id), caption, columns, rows);
    table.notes.push(
        "Iterations are those that led to the estimate; the time is for all of them, for the fixed \
         lag over all batches of a track."
            .into(),
    );
    table
}

/// Entropies as in table 2.2, and the share of the gap to the truth that is closed.
pub fn entropies(sets: &[Set]) -> Table {
    let number = |v: f64| Cell::Number(v, 3);
    let share = |v: f64| Cell::Number(100.0 * v, 0);
    let mut rows: Vec<TableRow> = PRINTED_ENTROPY
        .iter()
        .map(|&(name, [truth, baseline, proposed])| {
            let gap = (baseline - proposed) / (baseline - truth);
            let none = vec![Cell::Empty; MAIN - 2];
            let cells = [truth, baseline, proposed].map(number).into_iter().chain(none);
            let gaps = [share(gap), Cell::Empty];
            TableRow::reference([Cell::from(name)].into_iter().chain(cells).chain(gaps))
        })
        .collect();
    rows.extend(sets.iter().filter(|s| !s.outcomes.is_empty()).map(|set| {
        let all = (0..MAIN).map(|n| set.entropy(n));
        let cells = [set.mean(|o| o.entropy)].into_iter().chain(all).map(number);
        let gaps = [1, OURS].map(|n| share(set.gap_closed(n)));
        TableRow::new([Cell::from(set.name.as_str())].into_iter().chain(cells).chain(gaps))
    }));
    let names = methods().map(|m| m.0)[..MAIN].join(" | ");
    let columns =
        format!("Set | Truth | {names} | Gap closed as printed, % | Gap closed by ours, %");
    let caption = "As table 2.2: entropy of the clouds of all returns in the object's frame, sigma \
        5 cm, nats, mean over tracks; the gap is between the baseline and the truth.";
    table("entropy".into(), caption.into(), &columns, rows)
}

/// Errors of the baseline, as printed and of ours, by kind.
pub fn kinds(set: &Set) -> Table {
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        let all: Vec<&Outcome> = set.outcomes.iter().filter(|o| o.kind == kind).collect();
        if all.is_empty() {
            continue;
        }
        let better = all.iter().filter(|o| {
            let position = |n: usize| o.scores[n].errors.rmse().position;
            position(OURS) < position(0)
        });
        let better = 100.0 * better.count() as f64 / all.len() as f64;
        let mut cells = vec![Cell::from(format!("{kind:?}").to_lowercase()), Cell::from(all.len())];
        for n in [0, 1, OURS] {
            let errors = set.errors(n, |o| o.kind == kind);
            let r = errors.rmse();
            cells.push(Cell::from(format!(
                "{:.3} / {:.3} / {:.3} / {:.3}",
                r.position, r.velocity, r.heading, r.turn_rate
            )));
        }
        let flips = set.errors(OURS, |o| o.kind == kind).flips;
        cells.extend([Cell::Number(better, 0), Cell::from(flips)]);
        rows.push(TableRow::new(cells));
    }
    let caption = format!(
        "Errors by kind, {}: position, m / velocity, m/s / heading, rad / heading rate, rad/s.",
        set.name
    );
    let [baseline, printed, ours] = [0, 1, OURS].map(|n| methods()[n].0);
    let columns = format!(
        "Kind | Tracks | {baseline} | {printed} | {ours} | Better position, % | Flips of ours"
    );
    table(format!("kinds-{}", set.id), caption, &columns, rows)
}

/// Boxes around the clouds compared with those of the vehicles.
pub fn extents(sets: &[Set]) -> Table {
    let mut rows = Vec::new();
    for set in sets {
        let vehicles: Vec<&Outcome> =
            set.outcomes.iter().filter(|o| o.kind <= Kind::Tram).collect();
        let off_by = |extent: &dyn Fn(&Outcome) -> [f64; 3], axis: usize| {
            median(vehicles.iter().map(|o| (extent(o)[axis] - o.size[axis]).abs()))
        };
        let mut row = |name: &str, extent: &dyn Fn(&Outcome) -> [f64; 3]| {
            let numbers = [0, 1, 2].map(|axis| Cell::Number(off_by(extent, axis), 2));
            let head =
                [Cell::from(set.name.as_str()), Cell::from(vehicles.len()), Cell::from(name)];
            rows.push(TableRow::new(head.into_iter().chain(numbers)));
        };
        if vehicles.is_empty() {
            continue;
        }
        row("truth", &|o| o.extent);
        for (n, (name, _)) in methods().iter().enumerate().take(MAIN) {
            row(name, &|o| o.scores[n].extent);
        }
    }
    let caption = "Extent of vehicles: median difference between the narrowest box around the \
        cloud and the vehicle's own. That of the truth is due to what is never seen.";
    let columns = "Set | Vehicles | Cloud by | Length, m | Width, m | Height, m";
    table("extents".into(), caption.into(), columns, rows)
}

pub fn worst(set: &Set) -> Table {
    let position = |o: &Outcome, n: usize| o.scores[n].errors.rmse().position;
    let mut all: Vec<&Outcome> = set.outcomes.iter().collect();
    all.sort_by(|a, b| position(b, OURS).total_cmp(&position(a, OURS)));
    let row = |o: &&Outcome| {
        let ours = &o.scores[OURS];
        let r = ours.errors.rmse();
        let errors =
            [position(o, 0), position(o, 1), r.position, r.velocity, r.heading, r.turn_rate];
        let head = [
            Cell::from(o.name.as_str()),
            Cell::from(format!("{:?}", o.kind).to_lowercase()),
            Cell::from(o.returns),
            Cell::Number(o.span_s, 1),
            Cell::Number(o.range_m, 0),
            Cell::Number(o.turned_rad, 1),
        ];
        let entropy = [Cell::Number(ours.entropy - o.entropy, 2)];
        let stop = [Cell::from(format!("{:?}", ours.stop).to_lowercase())];
        let errors = errors.into_iter().map(|v| Cell::Number(v, 2));
        TableRow::new(head.into_iter().chain(errors).chain(entropy).chain(stop))
    };
    let rows = all.iter().take(WORST).map(row).collect();
    let caption = format!("The tracks on which ours is worst, {}.", set.name);
    let columns = "Object | Kind | Returns | Seen, s | Mean range, m | Turns, rad \
        | Baseline's position, m | As printed, m | Ours, m | Velocity, m/s \
        | Heading, rad | Heading rate, rad/s | Entropy above the truth's | Stopped";
    table(format!("worst-{}", set.id), caption, columns, rows)
}

/// Counts of what the front ends find of the labelled objects of some drives.
pub fn front_ends(found: &[(&'static str, Found)]) -> Table {
    let row = |(name, found): &(&'static str, Found)| {
        let counts = [
            found.objects[0],
            found.objects[1],
            found.tracks[0],
            found.tracks[1],
            found.fragments,
            found.swaps,
        ];
        TableRow::new([Cell::from(*name)].into_iter().chain(counts.map(Cell::from)))
    };
    let caption = "What the front ends find of labelled objects. A track belongs to an object if \
        more than half of its returns lie in the object's box; fragments are the tracks of an \
        object beyond its first, and a swap is a track switching from one object to another.";
    let columns = "Front end | Labelled objects | Found | Tracks | Of labelled objects \
        | Fragments | Swaps";
    table("front-ends".into(), caption.into(), columns, found.iter().map(row).collect())
}
