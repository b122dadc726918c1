//! The figures as text.

use super::grades::Grades;
use super::{Accuracy, AccuracyTable, Bucket, BucketedErrors, Category, Class, PointMotion, Range};

/// Writes the figures of an estimate to standard output.
pub(super) fn figures(grades: &Grades) {
    bucketed(&grades.bucketed.errors(Range::Near));
    let three = grades.three_way.errors(Range::Near);
    println!("  three-way EPE within 35 m      returns     EPE (m)");
    let epe = |name: &str, b: Bucket| println!("    {name:<24}{:>10}{}", b.count, number(b.epe_m));
    epe("foreground, moving", three.foreground_dynamic);
    epe("foreground, static", three.foreground_static);
    epe("background, static", three.background_static);
    println!("    {:<34}{}", "mean", number(three.mean_epe_m()));
    accuracy("without the vehicle's motion", &grades.over_ground);
    accuracy("with the vehicle's motion", &grades.with_ego_motion);
}

fn bucketed(errors: &BucketedErrors) {
    println!("  bucket-normalised EPE within 35 m       static (m)     dynamic");
    for class in &errors.classes {
        let (a, b) = (number(class.static_epe_m), number(class.dynamic));
        println!("    {:<34}{a}{b}", class.class.name());
    }
    let (a, b) = (number(errors.mean_static_epe_m), number(errors.mean_dynamic));
    println!("    {:<34}{a}{b}", "mean");
}

/// Writes the non-empty buckets to standard output.
pub(super) fn buckets(errors: &BucketedErrors) {
    println!("  buckets, m per pair            returns     EPE (m)   speed (m)  normalised");
    for class in &errors.classes {
        for bucket in class.buckets.iter().filter(|b| b.count > 0) {
            let range = format!("{:.2} to {:.2}", bucket.from_m, bucket.to_m);
            print!("    {:<15}{range:<14}{:>5}", class.class.name(), bucket.count);
            print!("{}{}", number(bucket.epe_m), number(bucket.mean_speed_m));
            // The first bucket is static: its error is not divided by next to nothing.
            println!(
                "{}",
                number(if bucket.from_m > 0.0 { bucket.normalised() } else { f64::NAN })
            );
        }
    }
}

fn accuracy(what: &str, table: &AccuracyTable) {
    println!("  {what:<29}returns     EPE (m)  strict (%) relaxed (%) outlier (%)  angle (rad)");
    let line = |name: &str, a: Accuracy| {
        let shares = [a.strict, a.relaxed, a.outliers].map(|v| number(100.0 * v)).concat();
        println!("    {name:<24}{:>10}{}{shares}{}", a.count, number(a.epe_m), number(a.angle_rad));
    };
    line("all", table.accuracy(|_| true, PointMotion::Any));
    line("moving", table.accuracy(|_| true, PointMotion::Moving));
    let parked = |c: Category| c.class().is_some_and(|class| class != Class::Background);
    line("parked", table.accuracy(parked, PointMotion::Standing));
    for class in Class::ALL {
        line(class.name(), table.accuracy(|c| c.class() == Some(class), PointMotion::Any));
    }
}

/// Twelve characters wide; a dash for NaN.
fn number(value: f64) -> String {
    if value.is_nan() { format!("{:>12}", "-") } else { format!("{value:>12.6}") }
}
