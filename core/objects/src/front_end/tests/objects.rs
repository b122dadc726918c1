//! Which tracks are reported as objects.

extern crate std;
use super::super::scene::{PARAMS, Run, SceneBox, ground, seen};
use super::super::*;
use raywake_core::encoder::ColumnClass;
use raywake_core::output::{ColumnFlow, PointFlows, ReturnFlow, Status};
use std::vec;
use std::vec::Vec;

/// A wall, a parked car, a walking person, and a wall that the flow reports as moving for a while.
#[test]
fn objects_are_movers_and_potential_movers() {
    let wall = |y| SceneBox { at: [5.0, y], size: [6.0, 0.4, 2.0], velocity: [0.0; 2] };
    let person = SceneBox { at: [8.0, 3.7], size: [0.4, 0.4, 1.7], velocity: [1.5, 0.0] };
    let things = [wall(12.0), SceneBox::car(12.0, -6.0, [0.0; 2]), person, wall(-12.0)];
    let (structure, car) = (Some(ColumnClass::Structure), Some(ColumnClass::Car));
    let classes = [structure, car, None, structure];
    let run = |encoder: bool, flow: bool| {
        let (mut run, mut members) = (Run::new(1, 8), vec![0; 8]);
        for n in 0..20 {
            let stamp_s = n as f64 * 0.1;
            let mut columns = Vec::new();
            let mut flows = vec![ReturnFlow::new(None, Status::Static); ground().len()];
            for (thing, class) in things.iter().zip(classes) {
                let moves = thing.velocity[0] > 0.0 || thing.at[1] < -10.0 && n < 10;
                columns.push(ColumnFlow {
                    velocity_world_mps: thing.velocity.map(|v| v as f32),
                    probability: if moves { 0.9 } else { 0.0 },
                    class: class.filter(|_| encoder),
                    ..ColumnFlow::default()
                });
                let flow = ReturnFlow::new(Some(columns.len() as u32 - 1), Status::Static);
                flows.resize(flows.len() + thing.points(0.0).len(), flow);
            }
            let points = seen(&things, stamp_s, 0.0, 0);
            let of = PointFlows::at_rest(&columns, &flows, &points);
            run.take(stamp_s, &points, flow.then_some(Flows { of, reach_m: 40.0 }));
            run.step();
            run.front_end.members().for_each(|(index, slot)| {
                assert!(index >= ground().len());
                members[slot] += 1;
            });
        }
        for (slot, track) in run.tracks.iter().enumerate() {
            assert_eq!(members[slot], track.returns_seen());
        }
        let objects = run.live().into_iter().filter(|t| t.is_object(&PARAMS)).map(|track| {
            let moving = track.p_moves().iter().filter(|p| **p > 0.5).count();
            (track.class(), moving, track.p_moves().len())
        });
        let mut objects: Vec<_> = objects.collect();
        objects.sort();
        (run.live().len(), objects)
    };
    // The person has no class, but moves.
    assert_eq!(run(true, true), (4, vec![(None, 20, 20), (car, 0, 20)]));
    // Without classes, only the person remains.
    assert_eq!(run(false, true), (4, vec![(None, 20, 20)]));
    assert_eq!(run(true, false), (4, Vec::new()));
}
