//! Sensors whose packets are read as they arrive.

use std::path::Path;
use std::sync::Arc;

use clap::ValueEnum;
use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;

use super::hdl64::Hdl64;
use super::ouster::Ouster;
use super::sensor::Sensor;
use super::velodyne::{self, Velodyne};
use crate::Error;
use crate::source::{OpenOptions, Overview, SweepData, first_sweep, plausible};

/// Known sensor models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SensorModel {
    /// Velodyne's VLP-16 (Puck)
    Vlp16,
    /// Velodyne's Puck Hi-Res
    PuckHiRes,
    /// Velodyne's VLP-32C (Ultra Puck)
    Vlp32c,
    /// Velodyne's HDL-32E
    Hdl32e,
    /// Velodyne's HDL-64E, S2 or S3; needs --metadata
    Hdl64e,
    /// Ouster's OS0, OS1 or OS2; needs --metadata
    #[value(alias = "os1-128")]
    Ouster,
}

/// A sensor, known before its first packet.
#[derive(Clone)]
pub struct LiveSensor(pub(super) Sensor);

impl LiveSensor {
    /// A sensor of a model. Fails if metadata that it needs is missing or makes no sense, or if
    /// metadata is given that it does not need.
    pub fn of(model: SensorModel, metadata: Option<&Path>) -> Result<LiveSensor, Error> {
        let code = match (model, metadata) {
            (SensorModel::Ouster, Some(path)) => {
                return Ok(LiveSensor(Sensor::Ouster(Arc::new(Ouster::read(path)?))));
            }
            (SensorModel::Ouster, None) => {
                let what = "an Ouster's packets need --metadata, the sensor's own JSON \
                            (http://SENSOR/api/v1/sensor/metadata)";
                return Err(Error::Usage(what.into()));
            }
            (SensorModel::Hdl64e, Some(path)) => {
                return Ok(LiveSensor(Sensor::Hdl64(Arc::new(Hdl64::read(path)?))));
            }
            (SensorModel::Hdl64e, None) => {
                let what = "an HDL-64E's packets need --metadata, the db.xml that came with it";
                return Err(Error::Usage(what.into()));
            }
            (_, Some(_)) => {
                let what = "--metadata applies only to Ouster sensors and the HDL-64E";
                return Err(Error::Usage(what.into()));
            }
            (SensorModel::Vlp16, _) => velodyne::VLP_16,
            (SensorModel::PuckHiRes, _) => velodyne::PUCK_HI_RES,
            (SensorModel::Vlp32c, _) => velodyne::VLP_32C,
            (SensorModel::Hdl32e, _) => velodyne::HDL_32E,
        };
        let sensor = Velodyne::coded(code).expect("every model has its numbers");
        Ok(LiveSensor(Sensor::Velodyne(Arc::new(sensor))))
    }

    /// Its model.
    pub fn name(&self) -> &str {
        self.0.name()
    }

    /// Maximum number of returns in a revolution.
    pub fn returns_max(&self) -> usize {
        self.0.returns_max()
    }

    /// Time of a revolution, ns, if the sensor's settings give it.
    pub(super) fn period_ns(&self) -> Option<f64> {
        self.0.period_ns()
    }

    /// Learns from the first sweep when returns were measured and where the ground is. The vehicle
    /// frame is that of the sensor. Fails if no ground is found and none is given.
    pub fn learn(&self, first: &SweepData, options: &OpenOptions) -> Result<LiveRig, Error> {
        let sensors = core::iter::once(Pose::IDENTITY).collect();
        let mut overview = first_sweep::before(String::new(), sensors, Vec::new(), options);
        if let Some(ground_m) = options.ground_m {
            plausible::ground(ground_m).map_err(Error::Usage)?;
        }
        first_sweep::learn(&mut overview, (&first.points, true), &[self.name()], options)
            .map_err(|what| Error::Usage(format!("{}: {what}", self.name())))?;
        let Overview { rig, notes, .. } = overview;
        Ok(LiveRig { rig, notes })
    }
}

/// The rig of a single sensor.
pub struct LiveRig {
    /// Sensors, timing and ground.
    pub rig: Rig,
    /// Notes on it for the user.
    pub notes: Vec<String>,
}
