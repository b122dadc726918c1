//! Real recordings, if `RAYWAKE_DATA` names their folder.

use raywake_core::sweep::Timing;

use super::*;

fn data(name: &str) -> PathBuf {
    let root = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names the folder of the data");
    PathBuf::from(root).join(name)
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn kitti_city_drive() {
    let mut source = opened(&data("kitti_raw_0005"));
    assert_eq!(source.len(), 154);
    assert!(source.notes().is_empty(), "{:?}", source.notes());
    // The stamps are from a clock of 10 ms; the scanner's revolution takes 0.1035 s.
    let turn = source.rig().timing;
    let Timing::Azimuth { span_s } = turn else { panic!("{turn:?}") };
    assert!((span_s - 0.1035).abs() < 3e-4, "{span_s}");
    let mut sweep = SweepData::default();
    for i in 0..source.len() {
        source.read(i, &mut sweep).unwrap();
        assert!((90_000..140_000).contains(&sweep.points.len()));
        assert!(sweep.twist.linear.length() < 15.0 && sweep.twist.angular.length() < 1.0);
    }
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn kitti_stationary_vehicle() {
    let mut source = opened(&data("kitti_raw_20110926_1430_11"));
    assert_eq!(source.len(), 11);
    let sweep = read(source.as_mut(), 5).unwrap();
    assert!(sweep.twist.linear.length() < 0.05);
    // The ground is where the rig says.
    let near = |p: &&raywake_core::sweep::Point| {
        let [x, y, z] = p.position;
        (4.0..10.0).contains(&x.hypot(y)) && z < -1.2
    };
    let mut z: Vec<f32> = sweep.points.iter().filter(near).map(|p| p.position[2]).collect();
    z.sort_by(f32::total_cmp);
    assert!((f64::from(z[z.len() / 2]) - source.rig().ground_m).abs() < 0.15);
}

#[cfg(feature = "arrow")]
#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn argoverse_pair() {
    let mut log = opened(&data("av2_log"));
    assert_eq!((log.len(), log.frame(0)), (2, 315_966_265_259_836_000));
    assert!(log.notes().is_empty(), "{:?}", log.notes());
    let mut same = opened(&data("av2_7fab2350"));
    for i in 0..2 {
        let (a, b) = (read(log.as_mut(), i).unwrap(), read(same.as_mut(), i).unwrap());
        assert_eq!(a.points.len(), b.points.len());
        for (p, q) in a.points.iter().zip(&b.points) {
            assert_eq!(p.position, q.position);
            assert!((p.intensity - q.intensity).abs() < 1e-6 && p.offset_s < 0.11);
        }
        assert!((a.stamp_s - b.stamp_s).abs() < 1e-6);
        assert!((a.twist.linear - b.twist.linear).length() < 1e-4);
    }
}
