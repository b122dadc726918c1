#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! A small deterministic LIDAR simulator: a street with buildings, trees, parked and moving
//! traffic, or another [`Scenery`], seen by spinning sensors on a moving vehicle, with the exact
//! truth of every return.
//!
//! [`Drive::new`] draws a scene and iterates over its sweeps; [`Drive::through`] takes a [`Scene`]
//! built by hand. The same seed gives the same bytes on the same machine, whatever the number of
//! threads.
//!
//! Frames are right-handed, x forward, y left, z up; metres, seconds, radians. The street frame (x
//! along the main road) has an arbitrary position and heading in the world frame; everything that
//! leaves the crate is in the world or vehicle frame unless stated otherwise. The rig chooses where
//! the vehicle frame lies on the vehicle ([`SensorRig::origin`]).

mod bend;
mod cast;
mod clutter;
#[cfg(test)]
mod collisions;
mod dimensions;
mod drive;
mod ego;
mod ground;
pub mod models;
mod object;
mod outskirts;
pub mod packets;
mod path;
mod relief;
mod rig;
mod rng;
mod roughness;
mod scene;
mod scenery;
mod sensor;
mod shape;
mod static_scene;
mod street;
mod target;
mod traffic;
mod truth;

pub use clutter::{Clutter, UnknownClutter};
pub use drive::{Drive, Options, SimSweep};
pub use ego::Ego;
pub use ground::{Contact, Ground};
pub use object::{Class, Fixture, Object, Part, Surface, Swing};
pub use outskirts::Place;
pub use path::{Path, State};
pub use rig::{Mount, PERIOD_S, SensorRig, UnknownRig, stamp_s};
pub use rng::Rng;
pub use scene::{ObjectState, Scene};
pub use scenery::{Scenery, UnknownScenery};
pub use sensor::{Beam, Sensor};
pub use shape::{Crossing, Shape};
pub use truth::Truth;
