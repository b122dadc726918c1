//! The heavy half of the pipeline, from rays to flow: on the CPU or on a Vulkan device.

pub mod device;

use raywake_core::encoder::EncoderWeights;
use raywake_core::params::Profile;
use raywake_core::perceive::{self, Perceive, Perceived, RayInput, StageTimer};
use raywake_core::record::SweepUniform;
use raywake_core::refinement::forest::MovesForest;
use raywake_core::stages::background_filter::{self, TABLE_WORDS};
use raywake_core::stages::occupancy_constancy::{self, SCORES_MAX, Scores, WEIGHT_WORDS};
use raywake_core::team::Team;
use raywake_core::weights::WeightsError;
use raywake_gpu::{Census, GpuError};

/// A learned part of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LearnedPart {
    /// The background filter.
    Filter,
    /// The occupancy constancy.
    Constancy,
    /// The encoder.
    Encoder,
    /// P(moves).
    Moves,
}

/// Why a weights file does not fit a profile.
#[derive(Debug, thiserror::Error)]
#[error("{}: {why}", match .of {
    LearnedPart::Filter => "background filter",
    LearnedPart::Constancy => "occupancy constancy",
    LearnedPart::Encoder => "encoder",
    LearnedPart::Moves => "P(moves)",
})]
pub struct TablesError {
    /// Which file.
    pub of: LearnedPart,
    /// What is wrong with it.
    pub why: WeightsError,
}

/// The learned weights in the form the kernels and their twins use.
#[derive(Clone)]
pub struct Tables {
    /// See [`background_filter::load`]; all zero if every solid column passes.
    pub filter: Vec<i32>,
    /// See [`occupancy_constancy::load`].
    pub constancy: Vec<i32>,
    /// Costs of the constancy scores.
    pub costs: Vec<u32>,
    /// The range of the scores.
    pub scores: Scores,
    /// Where the filter comes from, or a note that there is none.
    pub provenance: String,
    /// Whether every solid column is foreground.
    pub unfiltered: bool,
    /// See [`EncoderWeights::load`]; `None` if nothing is encoded.
    pub encoder: Option<Box<EncoderWeights>>,
    /// See [`MovesForest::load`].
    pub moves: MovesForest,
}

impl Tables {
    /// Reads the weights files for a profile; without a filter every solid column is foreground.
    /// Nothing is encoded unless the profile refines.
    pub fn load(
        profile: &Profile,
        filter: Option<&str>,
        constancy: &str,
        encoder: Option<&str>,
        moves: &str,
    ) -> Result<Tables, TablesError> {
        let levels = profile.levels as usize;
        let mut table = vec![0; TABLE_WORDS];
        let mut provenance = "none: every solid column is foreground".to_string();
        if let Some(text) = filter {
            background_filter::load(text, levels, &mut table)
                .map_err(|why| TablesError { of: LearnedPart::Filter, why })?;
            provenance = text
                .lines()
                .find_map(|l| l.strip_prefix("provenance "))
                .unwrap_or_default()
                .to_string();
        }
        let encoder = encoder.filter(|_| profile.refinement_sweeps > 0);
        let (mut weights, mut costs) = (vec![0; WEIGHT_WORDS], vec![0; SCORES_MAX]);
        let scores = occupancy_constancy::load(constancy, levels, &mut weights, &mut costs)
            .map_err(|why| TablesError { of: LearnedPart::Constancy, why })?;
        Ok(Tables {
            filter: table,
            constancy: weights,
            costs,
            scores,
            provenance,
            unfiltered: filter.is_none(),
            encoder: encoder.map(|text| encoder_weights(text, levels)).transpose()?,
            moves: MovesForest::load(moves)
                .map_err(|why| TablesError { of: LearnedPart::Moves, why })?,
        })
    }
}

fn encoder_weights(text: &str, levels: usize) -> Result<Box<EncoderWeights>, TablesError> {
    let mut weights = raywake_alloc_guard::boxed!(EncoderWeights, EncoderWeights::new());
    let loaded = weights.load(text, levels);
    loaded.map_err(|why| TablesError { of: LearnedPart::Encoder, why })?;
    Ok(weights)
}

/// The twins, with their buffers on the heap.
pub type Scalar = perceive::ScalarBackend<Vec<u32>>;

/// Either backend.
pub enum Backend {
    /// The core's twins.
    Scalar(Box<Scalar>),
    /// The kernels on a Vulkan device.
    Device(Box<device::Device>),
}

impl Perceive for Backend {
    type Error = GpuError;

    fn input(&mut self) -> Result<RayInput<'_>, GpuError> {
        match self {
            Backend::Scalar(b) => b.input().map_err(|e| match e {}),
            Backend::Device(b) => b.input(),
        }
    }

    fn perceive(
        &mut self,
        sweep: &SweepUniform,
        team: &impl Team,
        timer: &mut (impl StageTimer + Send),
        meanwhile: impl FnOnce() + Send,
    ) -> Result<Perceived<'_>, GpuError> {
        match self {
            Backend::Scalar(b) => {
                Ok(b.perceive(sweep, team, timer, meanwhile).unwrap_or_else(|e| match e {}))
            }
            Backend::Device(b) => b.perceive(sweep, team, timer, meanwhile),
        }
    }
}

impl Backend {
    /// The scalar backend for a profile.
    pub fn scalar(profile: &Profile, tables: &Tables) -> Backend {
        let words = vec![0; Scalar::words(profile)];
        let tables = perceive::LearnedTables {
            filter_table: &tables.filter,
            constancy_weights: &tables.constancy,
            constancy_costs: &tables.costs,
        };
        Backend::Scalar(Box::new(Scalar::new(words, profile, &tables)))
    }

    /// `scalar` or `vulkan`.
    pub fn name(&self) -> &'static str {
        match self {
            Backend::Scalar(_) => "scalar",
            Backend::Device(_) => "vulkan",
        }
    }

    /// The device's name.
    pub fn device(&self) -> &str {
        match self {
            Backend::Scalar(_) => "CPU",
            Backend::Device(b) => b.name(),
        }
    }

    /// Counts of what a device allocated and created.
    pub fn census(&self) -> Option<Census> {
        match self {
            Backend::Scalar(_) => None,
            Backend::Device(b) => Some(b.census()),
        }
    }

    /// The first few messages of the validation layer.
    pub fn messages(&self) -> Vec<String> {
        match self {
            Backend::Scalar(_) => Vec::new(),
            Backend::Device(b) => b.messages(),
        }
    }
}
