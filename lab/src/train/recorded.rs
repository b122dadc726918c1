//! Recorded drives with labels.

use super::drives::{Labelled, LabelledSweep, Seen};
use crate::labels::{Labels, View};
use glam::DVec3;
use raywake::source::{OpenOptions, Source, open};
use raywake_core::sweep::Rig;
use std::error::Error;
use std::path::Path;

/// A recorded drive.
pub struct Recorded {
    source: Box<dyn Source>,
    labels: Labels,
}

/// Half of the camera's view in which KITTI has labels, degrees.
const VIEW_DEG: f64 = 40.0;

impl Recorded {
    /// Opens a folder; fails where the recording or its labels cannot be read.
    pub fn open(folder: &Path) -> Result<Recorded, Box<dyn Error>> {
        let av2 = folder.to_string_lossy().contains("av2_7");
        let source = open(if av2 { Path::new("/tmp/rwdata/av2_log/val") } else { folder }, &OpenOptions::default())?;
        let labels = crate::train::tmp_labels::open(folder)?;
        Ok(Recorded { source, labels })
    }
}

impl Labelled for Recorded {
    fn rig(&self) -> &Rig {
        self.source.rig()
    }

    fn len(&self) -> usize {
        self.source.len()
    }

    fn read(&mut self, index: usize, into: &mut LabelledSweep) -> Result<(), Box<dyn Error>> {
        self.source.read(index, &mut into.data)?;
        into.object_of_point.clear();
        into.objects.clear();
        for (id, track) in self.labels.tracks.iter().enumerate() {
            if let Some(&vehicle_from_box) = track.boxes.get(&(if into.data.frame > 1<<40 { index as u64 } else { into.data.frame })) {
                let (kind, size) = (track.kind, track.size);
                into.objects.push(Seen { id, kind, vehicle_from_box, size });
            }
        }
        Ok(())
    }

    fn sees(&self, at: DVec3) -> bool {
        match self.labels.view {
            View::All => true,
            View::Camera => at.x > 0.0 && at.y.atan2(at.x).abs().to_degrees() <= VIEW_DEG,
        }
    }
}
