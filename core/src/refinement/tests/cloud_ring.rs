//! The sweeps that are remembered and when their returns were seen.

use super::super::places::Places;
use super::*;
use crate::params::SENSORS_MAX;

#[test]
fn clusters_are_compared_with_the_oldest_sweep() {
    let mut ring = raywake_alloc_guard::boxed!(CloudRing, CloudRing::new());
    let mut scratch = raywake_alloc_guard::boxed!(Scratch, Scratch::new());
    let mut apart = [false; SIDE * SIDE + 1];
    assert_eq!(ring.span_s(), None);
    for n in 0..12 {
        // One return per sweep above flat ground, each on a different level.
        let mut returns = Returns::flat();
        returns.add([10.5, 10.5, GROUND + 1.5 + n as f32], 0);
        let profile = profile();
        let sweep = returns.of_sweep(&profile, n as f64, &SENSORS);
        ring.insert(&SingleThread, &scaled(), sweep, &mut apart, &mut scratch);
        let Some(span_s) = ring.span_s() else { continue };
        let shares: Vec<f32> = ring.targets(span_s).iter().map(|t| t.share).collect();
        let wanted = match n {
            1 => vec![1.0],
            2 => vec![1.0, -1.0],
            _ => vec![1.0, -1.0, 1.0 - n.min(6) as f32],
        };
        assert_eq!((span_s, shares), (1.0, wanted), "{n}");
        // Each has its own detail.
        for (sweep, n) in [(ring.first(), n - 1), (ring.second(), n)] {
            let at = [10.5, 10.5, GROUND + 1.5 + n as f32];
            assert!(sweep.stamp_s == n as f64 && sweep.is_hit(at), "{n}");
        }
    }
    ring.clear();
    assert_eq!(ring.span_s(), None);
}

#[test]
fn sensors_and_times_come_back() {
    let mut places = raywake_alloc_guard::boxed!(Places, Places::new());
    let times = [0.0, 0.1, -0.05, 1e-6, -1e-6, 8.0, -8.0, 1e9, -1e9, f32::NAN];
    let kept = [0.0, 0.1, -0.05, 1e-6, -1e-6, 8.0, -8.0, 8.388607, -8.388607, 0.0];
    for sensor in 0..SENSORS_MAX as u32 {
        places.clear();
        for (n, time) in times.into_iter().enumerate() {
            assert!(places.push([0.0; 3], sensor, time));
            let (by, at) = places.seen(n);
            assert!(by == sensor && (at - kept[n]).abs() < 2e-6, "{sensor} {time}: {by} {at}");
        }
    }
}
