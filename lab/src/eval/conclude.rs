//! From the rows of all drives to tables, figures and the report.

use super::calibration::{self, Calibration};
use super::drive::Settings;
use super::facts::Facts;
use super::flow_tables::Tallies;
use super::groups::{ClassGroup, Estimate, MotionGroup, Truth};
use super::moving::{self, ColumnVerdicts, FirstSights, MovesReliability};
use super::points::{DOUBT_M, GROUND_M};
use super::statistics::Weight;
use super::tables::Rejection;
use super::tally::Tally;
use super::{PAIRS, figures, flow_tables, read_rows, return_tables, tables};
use crate::labels::CAMERA_DEG;
use crate::report::{Picture, Report, Results};
use raywake_io::Error;
use std::path::Path;

/// Results accumulated from the rows of all drives.
struct Evidence {
    tally: Tally,
    /// The same, pair by pair.
    alone: Option<Tally>,
    calibration: Calibration,
    verdicts: ColumnVerdicts,
    sights: FirstSights,
    reliability: MovesReliability,
}

impl Evidence {
    fn read(drives: &[Facts], pairs: &[Facts], out: &Path) -> Result<Evidence, Error> {
        let (mut tally, mut calibration) = (Tally::new(), Calibration::default());
        let (mut verdicts, mut sights) = (ColumnVerdicts::default(), FirstSights::default());
        let mut reliability = MovesReliability::default();
        read_rows(drives, out, |facts, row| {
            tally.row(row);
            if !row.below {
                calibration.row(row, facts.exact);
            }
            verdicts.row(row, facts.exact);
            sights.row(&facts.drive, row, facts.exact);
            reliability.row(row, facts.exact);
        })?;
        let mut alone = Tally::new();
        read_rows(pairs, &out.join(PAIRS), |_, row| alone.row(row))?;
        let alone = Some(alone).filter(|_| !pairs.is_empty());
        Ok(Evidence { tally, alone, calibration, verdicts, sights, reliability })
    }
}

/// Reads the rows of all drives, writes the report and returns its tables. `pairs`: the drives that
/// were also run pair by pair.
pub fn conclude(
    drives: &[Facts],
    pairs: &[Facts],
    settings: &Settings,
    out: &Path,
) -> Result<Results, Error> {
    let evidence = Evidence::read(drives, pairs, out)?;
    let mut report = Report::new("Temporal scene flow", &subtitle(drives));
    headlines(&mut report, &evidence, drives);
    facts(&mut report, drives, settings);
    if drives.iter().any(Facts::has_boxes) {
        of_boxes(&mut report, drives, &evidence, settings);
    }
    if let Some(table) = moving::semantic_kitti(drives.iter().map(|d| &d.returns)) {
        let section = report.section("Classes of returns").table(table);
        if let Some(table) = moving::class_confusion(drives.iter().map(|d| &d.returns.encoded)) {
            section.table(table);
        }
    }
    report
        .section("Time")
        .text(TIME)
        .table(tables::times(drives))
        .chart(figures::times(drives))
        .chart(figures::time_by_points(drives));
    pictures(&mut report, drives, out)?;
    choices(&mut report, drives, settings, &evidence.tally);
    report.write(out)
}

/// The sections that need labelled objects.
fn of_boxes(report: &mut Report, drives: &[Facts], evidence: &Evidence, settings: &Settings) {
    let Evidence { tally, alone, calibration, verdicts, sights, reliability } = evidence;
    report
        .section("Moving or not")
        .table(moving::table(verdicts, drives))
        .table(verdicts.by_kind())
        .table(verdicts.false_motion(drives))
        .table(sights.table())
        .table(reliability.table())
        .chart(reliability.chart());
    raw_flow(report, Tallies { run: tally, pairs: alone.as_ref() }, settings.profile.voxel_m);
    report
        .section("Temporal scene flow")
        .text(TRACKLETS)
        .table(tables::tracklets(tally))
        .chart(figures::settled(tally))
        .chart(figures::tracklets(tally));
    report
        .section("Uncertainty")
        .text(UNCERTAINTY)
        .table(calibration::table(calibration))
        .chart(calibration::reliability(calibration));
    returns(report, drives);
    let refines = settings.profile.refinement_sweeps > 0;
    let curves = Rejection {
        filter: tally.filter().filter(|_| settings.weights.has_filter()),
        encoder: tally.encoder().filter(|_| refines && settings.weights.has_encoder()),
        could_move_min: f64::from(settings.profile.refinement.could_move_min),
    };
    report
        .section("Rejection of the background")
        .table(tables::rejection(&curves))
        .chart(figures::precision_recall(&curves));
}

fn raw_flow(report: &mut Report, tallies: Tallies, cell_m: f64) {
    let [by_class, by_motion] = figures::histograms(tallies.run, cell_m);
    report
        .section("Raw scene flow")
        .text(RAW)
        .table(flow_tables::raw_flow(tallies))
        .chart(by_class)
        .chart(by_motion)
        .table(flow_tables::references(tallies, Truth::Raw))
        .chart(figures::references(tallies.run))
        .table(flow_tables::references(tallies, Truth::Smooth));
}

fn returns(report: &mut Report, drives: &[Facts]) {
    let scores = return_tables::scores(drives);
    let [bucketed, three_way] = return_tables::argoverse(&scores);
    report
        .section("Flow of single returns")
        .text(&about_returns())
        .table(bucketed)
        .table(three_way)
        .table(return_tables::accuracy(&scores));
}

const RAW: &str = "The error is the distance between the displacement found for a solid column \
    from one sweep to the next and that of the labelled object it belongs to. Columns that the \
    filter takes for background, and columns without a match, output no motion over ground and are \
    scored as such.";

const TRACKLETS: &str = "The error is the distance between the velocity over ground of a column's \
    tracklet and that of its object at the column's centre.";

const UNCERTAINTY: &str = "Every displacement and every velocity has a covariance. It is \
    meaningful if its ellipses contain the share of true values that it claims. Truth is the \
    simulator's, or the smoothed labels, whose own errors count as ours; whatever is parked or \
    unlabelled is at rest.";

/// Text explaining the scores of returns.
fn about_returns() -> String {
    format!(
        "Every return has the velocity of its column over the time between the sweeps. Truth is \
    the simulator's, or the motion of the labelled box that contains the return; returns in no box \
    are static, except those so close to one ({DOUBT_M} m) that they may belong to it, which are \
    not scored. Without a map, returns without a label up to {GROUND_M} m above the plane the \
    vehicle stands on count as ground, which is left out. For the graders' own truth and ground of \
    an Argoverse 2 log see `raywake-lab grade`."
    )
}

const TIME: &str = "From the sweep in memory to flow in memory, while another thread makes rows, \
    and other drives run if `--jobs` is above 1; `raywake run` has the machine to itself.";

fn subtitle(drives: &[Facts]) -> String {
    let pairs: u64 = drives.iter().map(|d| d.pairs).sum();
    let drives =
        if drives.len() == 1 { "1 drive".into() } else { format!("{} drives", drives.len()) };
    format!("{drives}, {pairs} pairs of sweeps")
}

/// A number with its unit; a dash if there is none.
fn number(value: f64, unit: &str, digits: usize) -> String {
    if value.is_finite() { format!("{value:.digits$} {unit}") } else { "–".into() }
}

fn headlines(report: &mut Report, evidence: &Evidence, drives: &[Facts]) {
    let tally = &evidence.tally;
    let moving = |tally: &Tally| {
        let (labelled, moving) = (ClassGroup::Labelled, MotionGroup::Moving);
        let errors = tally.flow(Estimate::Ours, Truth::Raw, labelled, moving, Weight::Column);
        number(100.0 * errors.quantile(0.5), "cm", 1)
    };
    let alone = evidence.alone.as_ref().map(|t| format!("pair by pair: {}; ", moving(t)));
    let settled = tally.settled(ClassGroup::Labelled, MotionGroup::Moving, Weight::Column);
    let counts = evidence.verdicts.all();
    report.headline(
        &number(100.0 * counts.precision(), "%", 1),
        "of the columns reported as moving do move",
        &format!(
            "and {} of those that move are reported so",
            number(100.0 * counts.recall(), "%", 1)
        ),
    );
    report.headline(
        &moving(tally),
        "median error of raw flow, moving",
        &format!("{}all labelled in the dissertation: 11.0 cm", alone.unwrap_or_default()),
    );
    report.headline(
        &number(settled.quantile(0.5), "m/s", 2),
        "median error of tracklets of age 10 or more, moving",
        "all labelled in the dissertation: 0.50 m/s",
    );
    let totals: Vec<f64> = drives.iter().flat_map(|d| &d.totals).copied().collect();
    if let Some(s) = raywake::order_statistics::Spread::of(&totals) {
        report.headline(
            &number(s.median, "ms", 1),
            "median time of a pair of sweeps",
            "the dissertation's mean on a GTX 1080: 85.7 ms",
        );
    }
}

fn facts(report: &mut Report, drives: &[Facts], settings: &Settings) {
    report.fact("Profile", &settings.profile.name);
    report.fact("Weights", &settings.weights_digest);
    let list = |f: &dyn Fn(&Facts) -> String| drives.iter().map(f).collect::<Vec<_>>().join(", ");
    if drives.len() <= 12 {
        report.fact("Drives", &list(&|d| format!("{} ({})", d.drive, d.digest)));
    }
    let times: f64 = drives.iter().map(|d| d.seconds).sum();
    let sweeps: u64 = drives.iter().map(|d| d.sweeps).sum();
    report.fact("Evaluated", &format!("{sweeps} sweeps in {times:.1} s of work"));
}

/// Best and worst sweeps of the first drives.
fn pictures(report: &mut Report, drives: &[Facts], out: &Path) -> Result<(), Error> {
    const SHOWN: usize = 8;
    let panels: Vec<_> = drives.iter().flat_map(|d| &d.panels).take(SHOWN).collect();
    if panels.is_empty() {
        return Ok(());
    }
    let section = report.section("Best and worst sweeps");
    for (n, panel) in panels.into_iter().enumerate() {
        let path = out.join("panels").join(&panel.file);
        let png = std::fs::read(&path).map_err(Error::reading(&path))?;
        let (id, caption) = (format!("panel-{n}"), panel.caption.clone());
        section.picture(Picture { id, caption, png });
    }
    Ok(())
}

/// Every convention that decides what is counted.
fn choices(report: &mut Report, drives: &[Facts], settings: &Settings, tally: &Tally) {
    let boxes: usize = drives.iter().map(|d| d.boxes).sum();
    let tracks: usize = drives.iter().map(|d| d.tracks).sum();
    let section = report.section("What is counted");
    section.text(&format!(
        "If the truth of every return is known, as in simulated drives, a column belongs to the \
         object hit by most of its returns above the ground. If it has none, and in other drives, \
         it belongs to the first labelled box, in the order of the labels, that contains its \
         centre, seen from above, with a margin of {} m: the road below a car is in the car's \
         column. Where exact truth distinguishes such columns of road, {} of them, they count only \
         in one row of moving columns. {tracks} labelled objects have {boxes} boxes.\n\n\
         Columns count where labels are complete, at both ends of their true motion: in drives \
         labelled in a front camera's view, within {CAMERA_DEG} degrees of straight ahead; in the \
         others, all round. {} columns do not.\n\n\
         An object is moving from {} m/s over ground.\n\n\
         Columns without a valid match and columns that the filter rejects are scored with what \
         the program outputs for them: no motion over ground.",
        settings.margin_m,
        tally.below,
        tally.out_of_view,
        crate::labels::trajectory::MOVING_MPS,
    ));
    let labelled = |d: &Facts| match d.has_boxes() {
        true => format!("`{}`: labelled in {}", d.drive, d.view),
        false => format!("`{}`: no labelled objects, only classes of returns", d.drive),
    };
    let views = drives.iter().map(labelled);
    let notes = drives.iter().flat_map(|d| d.notes.iter().map(|n| format!("`{}`: {n}", d.drive)));
    section.text(&views.chain(notes).take(200).collect::<Vec<_>>().join("\n\n"));
}
