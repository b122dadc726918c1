#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! A small deterministic LIDAR simulator: a street with buildings, trees, parked and moving
//! traffic, seen by a spinning 64-beam sensor on a moving vehicle, with the exact truth of every
//! return.
//!
//! [`Drive::new`] draws a street and iterates its sweeps; [`Drive::through`] takes a [`Scene`] put
//! together by hand. The same seed gives the same bytes on the same machine, whatever the number
//! of threads.
//!
//! Frames are right-handed, x forward, y left, z up; metres, seconds, radians. The street frame
//! (x along the main road) lies anywhere and at any heading in the world frame; what leaves the
//! crate is in the world or vehicle frame unless it says otherwise. The vehicle frame's origin is
//! the sensor.

mod cast;
mod drive;
mod ego;
mod ground;
pub mod models;
mod object;
mod path;
mod rng;
mod scene;
mod sensor;
mod shape;
mod street;
mod target;
mod traffic;

pub use cast::Truth;
pub use drive::{Drive, Options, SimSweep};
pub use ego::Ego;
pub use ground::{Contact, Ground};
pub use object::{Class, Fixture, Object, Part, Surface, Swing};
pub use path::{Path, State};
pub use rng::Rng;
pub use scene::{ObjectState, Scene};
pub use sensor::{Beam, Sensor};
pub use shape::{Crossing, Shape};
