//! A round of all faults.

use super::*;
use clap::Parser;
use raywake_core::sweep::Point;
use std::collections::BTreeSet;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: Args,
}

#[test]
fn faults_leave_nothing_behind() {
    let line = "soak --sweeps 1 -n 30 --out none --backend scalar --set side=81";
    let args = Line::try_parse_from(line.split(' ')).unwrap_or_else(|e| panic!("{e}")).args;
    let mut source = source(&args).unwrap();
    let mut soak = Soak::new(&args, source.as_mut()).unwrap();
    let memory = memory_of_sweeps(&soak);
    let room = fault::OVER * soak.stretches.profile.returns();
    assert!(memory.iter().all(|(_, capacity)| *capacity == room));
    soak.run().unwrap();
    assert_eq!(memory_of_sweeps(&soak), memory, "no fault needs more");
    let met = soak.findings.of_fault.iter().filter(|counts| **counts != [0, 0]);
    assert!(met.clone().count() == 11 && met.clone().all(|counts| *counts == [1, 1]));
    assert_eq!(soak.findings.verdict(), None);
    // One of these stretches loses one sweep, and another ten.
    assert_eq!(soak.findings.sweeps(), 22 * 30 - 11);
}

/// Where the returns of both sweeps are in memory, and for how many there is room.
fn memory_of_sweeps(soak: &Soak<'_>) -> BTreeSet<(*const Point, usize)> {
    soak.stretches.sides.iter().map(|side| (side.points.as_ptr(), side.points.capacity())).collect()
}
