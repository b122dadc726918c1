//! The background filter applies to sources only (section 3.4.2, before 3.5).

use glam::DVec3;
use raywake_core::output::FlowBasis;
use raywake_core::params::Profile;
use raywake_sim::SimSweep;
use raywake_tests::drives::{Setup, pairs, street};
use raywake_tests::pair::{Side, Stages};
use raywake_tests::weights;

fn run(profile: &Profile, filter: Option<String>, sweeps: usize) -> Vec<Stages> {
    let setup = Setup::new(profile.clone(), filter);
    let mut side = Side::new(&setup, setup.scalar());
    pairs(&street()[..sweeps]).map(|(now, before)| side.step(now, before)).collect()
}

/// `-v - w x p` with the motion from one sweep to the next.
fn odometry(sweep: &SimSweep, next: &SimSweep, at: DVec3) -> DVec3 {
    let moved = sweep.world_from_vehicle.inverse() * next.world_from_vehicle;
    let twist = moved.twist(next.stamp_s - sweep.stamp_s);
    -twist.linear - twist.angular.cross(at)
}

fn check_odometry(sweep: &SimSweep, next: &SimSweep, stages: &Stages) {
    for c in &stages.columns {
        assert_eq!((c.basis, c.age), (FlowBasis::Background, 0));
        assert_eq!((c.velocity_world_mps, c.covariance), ([0.0; 2], [0.0; 3]));
        let [x, y] = c.position_vehicle_m.map(f64::from);
        let wanted = odometry(sweep, next, DVec3::new(x, y, 0.0));
        let [u, v] = c.velocity_ego_mps.map(f64::from);
        assert!((wanted.x - u).abs() < 1e-4 && (wanted.y - v).abs() < 1e-4, "{c:?}: {wanted}");
    }
    for (p, flow) in sweep.points.iter().zip(&stages.points) {
        assert_eq!((flow.basis, flow.velocity_world_mps), (FlowBasis::Background, [0.0; 2]));
        let wanted = odometry(sweep, next, DVec3::from_array(p.position.map(f64::from)));
        let off = wanted - DVec3::from_array(flow.velocity_ego_mps.map(f64::from));
        assert!(off.length() < 1e-4, "{flow:?}: {wanted}");
    }
}

#[test]
fn flow_equals_odometry_if_nothing_may_move() {
    // The refinement moves objects whose columns the filter removed.
    let cells = Profile { refinement_sweeps: 0, ..Profile::hdl64() };
    for profile in [cells, Profile::dissertation()] {
        let all = run(&profile, Some(weights::closed_filter(14)), 6);
        for (pair, stages) in street().windows(2).zip(&all[1..]) {
            let [before, next] = pair else { unreachable!("pairs") };
            assert!(before.twist.linear.length() > 4.0, "the vehicle moves");
            assert!(stages.columns.len() > 1000 && stages.points.len() == before.points.len());
            assert!(stages.tracklets.is_empty() && stages.words("compact").is_empty());
            check_odometry(before, next, stages);
        }
        assert!(street()[5].twist.angular.z > 0.1, "and turns");
    }
}

#[test]
fn targets_are_never_filtered() {
    for profile in [Profile::hdl64(), Profile::dissertation()] {
        let open = run(&profile, None, 5);
        let some = run(&profile, Some(weights::filter(43, 14, 100, 0)), 5);
        let closed = run(&profile, Some(weights::closed_filter(14)), 5);
        for (n, open) in open.iter().enumerate().skip(1) {
            // The previous sweep's targets come back as sources, in the new window.
            for other in [&some[n], &closed[n]] {
                assert!(other.words("shift") == open.words("shift"), "sweep {n}");
            }
            let kept = |s: &Stages| s.words("compact").len();
            assert!(kept(&closed[n]) < kept(&some[n]) && kept(&some[n]) < kept(open), "sweep {n}");
        }
    }
}

#[test]
fn filtered_columns_are_still_targets() {
    // Columns that a matched column leads to, and that the filter rejects as sources.
    let all = run(&Profile::hdl64(), Some(weights::filter(43, 14, 100, 0)), 4);
    let step = &all[3].step;
    let sources = all[3].words("compact");
    let state = all[2].words("flow");
    let led_to: Vec<u32> = all[2]
        .words("compact")
        .iter()
        .filter(|c| state[**c as usize] != 0)
        .filter_map(|c| {
            let d = raywake_core::record::flow_displacement(state[*c as usize]);
            let i = *c as i32 / step.side + d[0] - step.shift_x;
            let j = *c as i32 % step.side + d[1] - step.shift_y;
            let inside = (0..step.side).contains(&i) && (0..step.side).contains(&j);
            inside.then_some((i * step.side + j) as u32)
        })
        .collect();
    let rejected = led_to.iter().filter(|c| sources.binary_search(c).is_err()).count();
    assert!(rejected * 10 > led_to.len(), "{rejected} of {}", led_to.len());
}
