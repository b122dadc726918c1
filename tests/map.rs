//! The sparse map (B.2.3) equals the dense window within its extent, on either backend.

#![forbid(unsafe_code)]

use raywake::map::{MapBackend, Mapped, Mapper, device::DeviceMap, scalar::ScalarMap};
use raywake_core::frame::place;
use raywake_core::params::Profile;
use raywake_core::record::Update;
use raywake_core::sweep::Rig;
use raywake_gpu::Options;
use raywake_sim::SimSweep;
use raywake_tests::drives::{Setup, street, sweep};
use raywake_tests::grid::{Rays, Tracer};
use raywake_tests::{difference, vulkan};
use std::sync::OnceLock;

/// Number of sweeps of the street to map.
const SWEEPS: usize = 3;

/// A sweep's map: its placement, its voxels in the order of the backend, and their lattice indices
/// and log-odds.
struct Map {
    mapped: Mapped,
    voxels: Vec<Update>,
    cells: Vec<([i32; 3], i32)>,
}

fn rig() -> Rig {
    Setup::new(Profile::map(), None).rig
}

fn maps(backend: MapBackend) -> Vec<Map> {
    let mut mapper = Mapper::new(Profile::map(), rig(), backend);
    let mut one = |simulated: &SimSweep| {
        let mut voxels = Vec::new();
        let mapped = mapper.map(&sweep(simulated), &mut |v| voxels.extend_from_slice(v));
        let mapped = mapped.unwrap_or_else(|e| panic!("{e}"));
        let cell = |v: &Update| (mapper.cell(&mapped, v[0]), v[1] as i32);
        Map { mapped, cells: voxels.iter().map(cell).collect(), voxels }
    };
    street()[..SWEEPS].iter().map(&mut one).collect()
}

fn scalar() -> &'static [Map] {
    static MAPS: OnceLock<Vec<Map>> = OnceLock::new();
    MAPS.get_or_init(|| maps(MapBackend::Scalar(Box::new(ScalarMap::new(&Profile::map())))))
}

/// `None` if there is no device.
fn device() -> Option<&'static [Map]> {
    static MAPS: OnceLock<Option<Vec<Map>>> = OnceLock::new();
    let maps = MAPS.get_or_init(|| {
        let device = vulkan::expect(DeviceMap::new(&Profile::map(), &Options::default()))?;
        Some(maps(MapBackend::Device(Box::new(device))))
    });
    maps.as_deref()
}

/// Checks every voxel of the dense window against the map, which lies in the same lattice.
fn check_dense(profile: &Profile, simulated: &SimSweep, map: &Map) {
    let (rig, origin) = (rig(), map.mapped.window.lattice_origin);
    let window = place(profile, &rig, &simulated.world_from_vehicle, Some(origin));
    let rays = Rays::new(profile, &rig, &window, &sweep(simulated));
    assert_eq!(rays.rays.len(), map.mapped.rays);
    let (side, levels) = (profile.side as i32, profile.levels as i32);
    let index = |cell: [i32; 3]| {
        let [i, j, k]: [i32; 3] = std::array::from_fn(|a| cell[a] - window.corner[a]);
        let inside = (0..side).contains(&i) && (0..side).contains(&j) && (0..levels).contains(&k);
        inside.then_some(((i * side + j) * levels + k) as usize)
    };
    let mut sparse = vec![0; profile.voxels()];
    let mut met = 0;
    for (cell, log_odds) in &map.cells {
        if let Some(index) = index(*cell) {
            met += 1;
            sparse[index] = *log_odds;
        }
    }
    let mut dense = vec![0; profile.voxels()];
    let mut tracer = Tracer::default();
    tracer.merge(&rays);
    tracer.trace(&rays, &mut dense);
    assert_eq!(difference(&sparse, &dense), None, "{}", profile.name);
    assert!(met > 50_000 && map.cells.len() > met + 100_000, "{met} of {}", map.cells.len());
}

#[test]
fn both_routes_give_the_same_answer() {
    for maps in [Some(scalar()), device()].into_iter().flatten() {
        for (simulated, map) in street().iter().zip(maps) {
            check_dense(&Profile::hdl64(), simulated, map);
            check_dense(&Profile::wide(), simulated, map);
        }
        let corners = [0, SWEEPS - 1].map(|n| maps[n].mapped.window.corner);
        assert!(corners[0] != corners[1], "the window moves");
    }
}

#[test]
fn both_backends_give_the_same_map() {
    let Some(device) = device() else { return };
    for (n, (found, wanted)) in device.iter().zip(scalar()).enumerate() {
        assert_eq!(difference(&found.voxels, &wanted.voxels), None, "sweep {n}");
        assert_eq!(
            (found.mapped.window, found.mapped.rays),
            (wanted.mapped.window, wanted.mapped.rays)
        );
    }
}

#[test]
fn every_voxel_occurs_once() {
    for map in scalar() {
        assert!(map.voxels.windows(2).all(|w| w[0][0] < w[1][0]), "keys ascend");
        assert!(map.voxels.iter().all(|v| v[0] < Mapper::keys(&Profile::map())));
    }
}
