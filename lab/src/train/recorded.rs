//! Recorded drives with labels.

use super::drives::{Labelled, LabelledSweep, Seen};
use crate::labels::{self, Labels};
use glam::DVec3;
use raywake_core::sweep::Rig;
use raywake_io::Error;
use raywake_io::source::{OpenOptions, Source, open};
use std::path::Path;

pub struct Recorded {
    source: Box<dyn Source>,
    labels: Labels,
}

impl Recorded {
    /// Opens a folder; fails if the recording or its labels cannot be read.
    pub fn open(folder: &Path) -> Result<Recorded, Error> {
        let source = open(folder, &OpenOptions::default())?;
        let labels = labels::open(folder, source.as_ref())?;
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

    fn read(&mut self, index: usize, into: &mut LabelledSweep) -> Result<(), Error> {
        self.source.read(index, &mut into.data)?;
        into.object_of_point.clear();
        into.class_of_point.clear();
        into.objects.clear();
        for (id, track) in self.labels.tracks.iter().enumerate() {
            if let Some(&vehicle_from_box) = track.boxes.get(&into.data.frame) {
                let (kind, size) = (track.kind, track.size);
                into.objects.push(Seen { id, kind, vehicle_from_box, size });
            }
        }
        Ok(())
    }

    fn sees(&self, at: DVec3) -> bool {
        self.labels.view.holds(at)
    }
}
