//! Starts of a registration from other tracklets.

use super::*;

#[test]
fn in_a_row_of_cars_each_moves_as_traffic_does() {
    // From sweep to sweep the next car comes to where it is about as far behind as this one went
    // ahead, beyond the reach of a search.
    let by = 13.0;
    let mut random = Random(21);
    let sweep = |n: usize, random: &mut Random| {
        let mut returns = Returns::flat();
        let [first, next] = [36.0, 18.0].map(|x| [x + (n as f32 - 1.0) * by, 31.0]);
        Car { centre: first, yaw: 0.0 }.add_to(&mut returns, random);
        // Of the next one not everything is seen.
        let mut whole = Returns::default();
        Car { centre: next, yaw: 0.0 }.add_to(&mut whole, random);
        let seen = whole.placed.iter().filter(|p| p.at[0] > next[0] - 3.0);
        seen.for_each(|p| returns.add(p.at, 0));
        returns
    };
    let sweeps: Vec<Returns> = (1..3).map(|n| sweep(n, &mut random)).collect();
    let moved = |traffic: Option<[f32; 2]>| {
        let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
        sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
        let step = SweepUniform { side: SIDE as i32, ..SweepUniform::default() };
        let flows = vec![pack_flow([-5, 0]); SIDE * SIDE];
        // Tracklets elsewhere.
        let predict = |c: usize| {
            traffic.filter(|_| c % SIDE < 4).map(|by| Prediction {
                by,
                certainty: 3.0,
                probability: 1.0,
            })
        };
        refinement.run(&SingleThread, &step, &flows, &[], predict);
        let first_car = motions(&refinement).split_off(29 * SIDE);
        let mut moved: Vec<f32> = first_car.iter().flatten().map(|m| m.0[0]).collect();
        moved.sort_by(f32::total_cmp);
        moved.get(moved.len() / 2).copied()
    };
    let [alone, in_traffic] = [None, Some([by, 0.0])].map(moved);
    assert!(alone.is_some_and(|m| m < 0.0), "{alone:?}");
    assert!(in_traffic.is_some_and(|m| (m - by).abs() < 0.05), "{in_traffic:?}");
}
