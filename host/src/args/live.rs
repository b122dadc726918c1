//! `raywake live`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::BoolishValueParser;
use raywake_io::Error;
use raywake_io::source::OpenOptions;
use raywake_io::source::capture::live::SensorModel;

use super::FlowChoice;
use super::results::StreamArgs;
use super::values::{count, factor, listen, milliseconds, vehicle_box};

const ABOUT: &str = "\
Estimate scene flow live from a sensor's packets

Every sweep is processed as soon as its last packet has arrived. Of the sweeps that arrive during \
that time only the newest is kept; older ones are dropped and counted. The work per sweep is not \
reduced under load: a third of the rounds of the energy minimisation, or of the steps of the \
refinement, would still take 95 % of the time. Tracks continue across a missing sweep. A device \
that fails, or does not answer within ten deadlines, is abandoned, and the CPU takes over. \
Messages are written by a separate thread, which drops those that it has no time for. \
SIGINT or SIGTERM ends the program. Under systemd it reports readiness and feeds the watchdog.";

#[derive(Clone, Debug, clap::Args)]
#[command(about = ABOUT.lines().next(), long_about = ABOUT)]
pub struct LiveArgs {
    /// Address and port to receive packets on, or just a port, on the loopback address [default:
    /// 127.0.0.1:2368, or a free port for a replay]
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = listen)]
    pub listen: Option<SocketAddr>,
    /// Sensor model [default: that of the replay]
    #[arg(long, required_unless_present = "replay", conflicts_with = "replay")]
    pub model: Option<SensorModel>,
    /// Metadata of an Ouster: JSON, as from http://SENSOR/api/v1/sensor/metadata; for an HDL-64E,
    /// the db.xml that came with it
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub metadata: Option<PathBuf>,
    /// Where poses come from: `register`, by registration of the sweeps, or an address and port to
    /// receive them on as datagrams
    #[arg(long, value_name = "ADDRESS:PORT|register", default_value = "register")]
    #[arg(value_parser = poses_from)]
    pub poses_from: PosesFrom,
    /// Use received poses even where they jitter much more than registration
    #[arg(long)]
    pub trust_poses: bool,
    /// Latency from a sweep's last packet to its flow beyond which it counts as late, ms [default:
    /// one revolution of the sensor]
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    pub deadline: Option<Duration>,
    /// Also track objects: a box with an ID, a velocity and a class for each
    #[arg(long)]
    pub objects: bool,
    /// Stop after this many sweeps
    #[arg(short = 'n', value_name = "COUNT", value_parser = count)]
    pub count: Option<usize>,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub place: PlaceArgs,
    #[command(flatten)]
    pub flow: FlowChoice,
    #[command(flatten)]
    pub results: LiveResults,
    #[command(flatten)]
    pub replay: ReplayArgs,
}

/// Where the sensor is mounted.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Sensor")]
pub struct PlaceArgs {
    /// Ground height in the sensor's frame, m [default: estimated from the first sweep]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub ground: Option<f64>,
    /// Box around the own vehicle in the sensor's frame, m: returns in it are ignored
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true, value_parser = vehicle_box)]
    pub own_vehicle: Option<[[f32; 2]; 2]>,
    /// Correct for the vehicle's motion during a revolution of the sensor
    #[arg(long, value_name = "on|off", hide_possible_values = true)]
    #[arg(value_parser = BoolishValueParser::new())]
    pub deskew: Option<bool>,
}

/// Where results go.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Results")]
pub struct LiveResults {
    /// Send what moves to this address as datagrams (examples/live_receiver.py reads them)
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub send: Option<SocketAddr>,
    #[command(flatten)]
    pub streams: StreamArgs,
    /// At the end, write counts and latencies as JSON
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
}

/// A capture instead of a sensor.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Replay")]
pub struct ReplayArgs {
    /// Replay the packets of a capture (.pcap, .pcapng), timed as its sensor sent them
    #[arg(long, value_name = "FILE")]
    pub replay: Option<PathBuf>,
    /// How much faster than real time [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    pub speed: Option<f64>,
    /// Sensor of the capture, if it has several
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub topic: Option<String>,
}

impl ReplayArgs {
    /// Fails if an option of a replay is given without one; clap cannot check it where --model
    /// excludes one.
    pub fn check(&self) -> Result<(), Error> {
        let given = [("speed", self.speed.is_some()), ("topic", self.topic.is_some())];
        let alone = given.iter().find(|(_, given)| *given).filter(|_| self.replay.is_none());
        alone.map_or(Ok(()), |(name, _)| Err(Error::Usage(format!("--{name} requires --replay"))))
    }
}

/// Where poses come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PosesFrom {
    Register,
    Address(SocketAddr),
}

fn poses_from(text: &str) -> Result<PosesFrom, String> {
    match text {
        "register" => Ok(PosesFrom::Register),
        _ => listen(text).map(PosesFrom::Address),
    }
}

impl PlaceArgs {
    /// Options for reading the sensor.
    pub fn options(&self) -> OpenOptions {
        OpenOptions {
            ground_m: self.ground,
            own_vehicle: self.own_vehicle,
            deskew: self.deskew,
            ..OpenOptions::default()
        }
    }
}
