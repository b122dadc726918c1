//! Sources on small synthetic folders, and on real data if available.

#[cfg(feature = "arrow")]
mod argoverse;
mod files;
mod formats;
pub(crate) mod fuzz;
mod mistakes;
#[cfg(feature = "nuscenes")]
mod nuscenes;
mod real;
mod sidecars;
#[cfg(feature = "parquet")]
mod waymo;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::{OpenOptions, Source, SweepData, open};
use crate::Error;

/// A folder that is removed with the value.
pub(crate) struct Temp(PathBuf);

impl Temp {
    pub(crate) fn new() -> Temp {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("raywake-test-{}-{n}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Temp(path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file, creating the folders above it.
    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, content).unwrap();
        path
    }

    pub(crate) fn remove(&self, name: &str) {
        fs::remove_file(self.0.join(name)).unwrap();
    }
}

impl Drop for Temp {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The bytes of a cloud.
fn bin(points: &[[f32; 4]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

/// A pose row without rotation.
fn row(x: f64, y: f64, z: f64) -> String {
    format!("1 0 0 {x} 0 1 0 {y} 0 0 1 {z}\n")
}

fn opened(path: &Path) -> Box<dyn Source> {
    open(path, &OpenOptions::default()).unwrap()
}

/// The message of the error on opening.
fn refused(path: &Path) -> String {
    refused_with(path, &OpenOptions::default())
}

fn refused_with(path: &Path, options: &OpenOptions) -> String {
    match open(path, options) {
        Ok(source) => panic!("opened: {}", source.describe()),
        Err(e) => {
            assert!(matches!(e.exit_code(), 2 | 3));
            e.to_string()
        }
    }
}

fn read(source: &mut dyn Source, index: usize) -> Result<SweepData, Error> {
    let mut sweep = SweepData::default();
    source.read(index, &mut sweep)?;
    Ok(sweep)
}

/// A drive in KITTI's layout with `poses.txt`: frames 3, 4, 6; a metre forward every 0.1 s.
fn drive() -> Temp {
    let t = Temp::new();
    for (frame, x) in [(3, 1.0), (4, 2.0), (6, 3.0)] {
        let name = format!("velodyne_points/data/{frame:010}.bin");
        t.write(&name, bin(&[[x, -2.0, 0.5, 0.25], [f32::NAN, 0.0, 0.0, 0.0]]));
    }
    t.write("poses.txt", row(0.0, 0.0, 0.0) + &row(1.0, 0.0, 0.0) + &row(3.0, 0.0, 0.0));
    t.write("times.txt", "0\n0.1\n0.3\n");
    t
}
