//! The clouds of static and of moving returns, stored in the recording's format.

use std::path::{Path, PathBuf};

use raywake_core::sweep::Point;
use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::streams::{Content, StreamTargets};
use raywake_io::sink::{atomic, clouds};
use raywake_io::source::{Overview, SweepData};

use super::verdict::ReturnVerdict;

/// Names of the folders or files.
const NAMES: [&str; 2] = ["static", "moving"];

/// Where clouds go.
pub enum KeptClouds {
    /// A file per sweep in each of two folders, for static and for moving returns.
    Files { root: PathBuf, extension: String },
    /// Two MCAP recordings.
    Bags(Box<[BagSink; 2]>),
}

impl KeptClouds {
    /// Creates folders for files with this extension or, without one, MCAP files.
    pub fn create(
        root: &Path,
        extension: Option<&str>,
        of: &Overview,
    ) -> Result<KeptClouds, Error> {
        let Some(extension) = extension else {
            let bag = |name| {
                let mcap = Some(root.join(format!("{name}.mcap")));
                let targets = StreamTargets { mcap, ..StreamTargets::default() };
                BagSink::create(&targets, of.epoch_ns, Content::Clouds)
            };
            let [still, moving] = NAMES.map(bag);
            let bags = still?.zip(moving?).map(|(still, moving)| Box::new([still, moving]));
            let absent = || Error::missing_feature("an MCAP file", "mcap");
            return bags.map(KeptClouds::Bags).ok_or_else(absent);
        };
        NAMES.iter().try_for_each(|name| atomic::create_folder(&root.join(name)))?;
        Ok(KeptClouds::Files { root: root.to_path_buf(), extension: extension.into() })
    }

    /// Writes the returns of a sweep by verdict.
    pub fn sweep(&mut self, sweep: &SweepData, judged: &[ReturnVerdict]) -> Result<(), Error> {
        let of = |moves: bool| -> Vec<Point> {
            let all = sweep.points.iter().zip(judged);
            let kept = all.filter(|(_, judged)| match judged {
                ReturnVerdict::None => false,
                ReturnVerdict::Unknown | ReturnVerdict::Static => !moves,
                ReturnVerdict::Moving => moves,
            });
            kept.map(|(point, _)| *point).collect()
        };
        for (n, points) in [of(false), of(true)].iter().enumerate() {
            match self {
                KeptClouds::Bags(bags) => bags[n].cloud(sweep, points)?,
                KeptClouds::Files { root, extension } => {
                    let name = format!("{}/{:010}.{extension}", NAMES[n], sweep.frame);
                    clouds::write_cloud(&root.join(name), points)?;
                }
            }
        }
        Ok(())
    }

    /// Completes the files.
    pub fn finish(self) -> Result<(), Error> {
        match self {
            KeptClouds::Files { .. } => Ok(()),
            KeptClouds::Bags(bags) => bags.into_iter().try_for_each(BagSink::finish),
        }
    }
}
