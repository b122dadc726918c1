//! Sweeps that make no sense, and the same sweeps twice.

use super::*;

#[test]
fn odd_sweeps_give_valid_results() {
    let mut random = Random(6);
    let mut column = Returns::flat();
    for _ in 0..50_000 {
        let [x, y] = [0; 2].map(|_| random.between(31.0, 32.0));
        column.add([x, y, GROUND + random.between(0.0, 14.0)], 0);
    }
    let mut nowhere = Returns::flat();
    for at in [[f32::NAN; 3], [f32::INFINITY; 3], [1e30, 5.0, 5.0], [5.0, 5.0, -1e30]] {
        nowhere.add(at, 0);
    }
    // A place that overflowed in a column that was found before it did.
    nowhere.add([f32::NAN, 20.5, GROUND + 1.0], 0);
    *nowhere.columns.last_mut().unwrap() = column_of([20.5; 3]);
    let mut tall = Returns::flat();
    for n in 0..2000 {
        tall.add([20.5, 20.5 + 0.002 * n as f32, GROUND + n as f32], 1);
    }
    let mut clusters = || {
        let mut returns = Returns::flat();
        for _ in 0..60 {
            let [x, y] = [0; 2].map(|_| random.between(0.0, SIDE as f32));
            for _ in 0..random.below(60) {
                let [x, y] = [x, y].map(|v| v + random.between(-1.0, 1.0));
                returns.add([x, y, GROUND + random.between(0.7, 6.0)], 0);
            }
        }
        returns
    };
    let [some, others] = [clusters(), clusters()];
    let odd = [
        some,
        others,
        Returns::default(),
        column,
        nowhere,
        tall,
        scattered(&mut random, 20_000, 16.0),
    ];
    let mut moving = 0;
    for first in &odd {
        for second in &odd {
            let flows: Vec<Flow> = (0..SIDE * SIDE)
                .map(|_| match random.below(3) {
                    0 => 0,
                    _ => pack_flow([0; 2].map(|_| random.below(31) as i32 - 15)),
                })
                .collect();
            let found = found_in(&[second.clone(), first.clone(), second.clone()], &flows);
            check_sane(&found);
            moving += found.iter().flatten().count();
        }
    }
    assert!(moving > 0, "nothing was there to be wrong");
    // A single sweep makes no pair.
    assert!(
        found_in(&[odd[0].clone(), Returns::default()], &no_flow()).iter().all(Option::is_none)
    );
    let mut alone = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    give(&mut alone, &odd[0], 0);
    run(&mut alone, &no_flow());
    assert!(motions(&alone).iter().all(Option::is_none));
}

#[test]
fn the_same_sweeps_yield_the_same_bits() {
    let mut random = Random(7);
    let mut sweep = |n: usize| {
        let car = Car { centre: [25.0 + 1.3 * n as f32, 30.0], yaw: 0.1 };
        let mut returns = scattered(&mut random, 3000, 8.0);
        car.add_to(&mut returns, &mut random);
        returns
    };
    let sweeps: Vec<Returns> = (0..4).map(&mut sweep).collect();
    let others: Vec<Returns> = (5..8).map(sweep).collect();
    let flows: Vec<Flow> = (0..SIDE * SIDE).map(|c| pack_flow([(c % 3) as i32, 0])).collect();
    let wanted = found_in(&sweeps, &flows);
    assert!(wanted.iter().flatten().count() > 10);
    assert_eq!(found_in(&sweeps, &flows), wanted);
    // Whatever came before.
    let mut used = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    others.iter().enumerate().for_each(|(n, r)| give(&mut used, r, n));
    run(&mut used, &flows);
    used.clear();
    sweeps.iter().enumerate().for_each(|(n, r)| give(&mut used, r, n));
    run(&mut used, &flows);
    assert_eq!(motions(&used), wanted);
}
