//! Windows whose solid columns are labelled by class.

use super::super::drives::{Labelled, LabelledSweep};
use super::super::inputs::Visit;
use super::super::owner::{Owner, owners};
use super::network::Input;
use crate::grid::Grid;
use crate::labels::Kind;
use raywake_core::encoder::ColumnClass;
use raywake_core::encoder::layers::OCTET;
use raywake_core::record::{Column, NONE};
use raywake_io::Error;
use raywake_sim::{Class, Rng};

/// Nothing is known of the column, or it is not solid.
pub const UNKNOWN: u8 = 255;
/// The column cannot move, and its class is not labelled.
pub const IMMOVABLE: u8 = 8;

/// A window of one sweep.
#[derive(Clone)]
pub struct Sample {
    pub side: usize,
    /// First column of the window, in columns of the world.
    pub corner: [i32; 2],
    pub masks: Vec<u32>,
    /// [`ColumnClass`] of each column, [`IMMOVABLE`] or [`UNKNOWN`].
    pub labels: Vec<u8>,
}

/// Whether a label is of something that could move.
pub fn could_move(label: u8) -> bool {
    (ColumnClass::Car as u8..IMMOVABLE).contains(&label)
}

/// The samples of a drive.
pub fn of_drive(visit: Visit) -> Result<Vec<Sample>, Error> {
    let mut sweep = LabelledSweep::default();
    let mut samples = Vec::new();
    for index in visit.sweeps {
        visit.drive.read(index, &mut sweep)?;
        samples.push(sample(visit.grid, visit.drive, &sweep));
    }
    Ok(samples)
}

pub fn sample(grid: &mut Grid, drive: &dyn Labelled, sweep: &LabelledSweep) -> Sample {
    let window = grid.sweep(drive.rig(), &sweep.data.sweep());
    // Returns of static structure, by class.
    let mut hits = vec![[0u16; 4]; grid.columns.len()];
    for (&column, &class) in grid.of_point.iter().zip(&sweep.class_of_point) {
        if let (true, Some(class)) = (column != NONE, static_class(class)) {
            hits[column as usize][class as usize] += 1;
        }
    }
    let mut labels = vec![UNKNOWN; grid.columns.len()];
    for (column, owner) in owners(grid, &window, drive, sweep) {
        labels[column] = match owner {
            Owner::Object(n) => mover_class(sweep.objects[n].kind).map_or(UNKNOWN, |c| c as u8),
            Owner::Unknown => UNKNOWN,
            Owner::Background => most(&hits[column]),
        };
    }
    Sample {
        side: grid.step.side as usize,
        corner: [window.corner[0], window.corner[1]],
        masks: grid.columns.iter().map(|c| c[0]).collect(),
        labels,
    }
}

/// The class of most returns above the ground; the ground if there are none.
fn most(hits: &[u16; 4]) -> u8 {
    let above = (1..4).max_by_key(|n| hits[*n]).filter(|n| hits[*n] > 0);
    match above {
        Some(class) => class as u8,
        None if hits[0] > 0 => ColumnClass::Ground as u8,
        None => IMMOVABLE,
    }
}

fn static_class(class: Class) -> Option<ColumnClass> {
    match class {
        Class::Ground => Some(ColumnClass::Ground),
        Class::Building | Class::Fixture => Some(ColumnClass::Structure),
        Class::Vegetation => Some(ColumnClass::Vegetation),
        Class::Pole => Some(ColumnClass::Pole),
        _ => None,
    }
}

fn mover_class(kind: Kind) -> Option<ColumnClass> {
    match kind {
        Kind::Car | Kind::Van => Some(ColumnClass::Car),
        Kind::Truck | Kind::Bus | Kind::Tram => Some(ColumnClass::LargeVehicle),
        Kind::Pedestrian => Some(ColumnClass::Person),
        Kind::Cyclist | Kind::Motorcycle => Some(ColumnClass::TwoWheeler),
        Kind::Other => None,
    }
}

/// Share of the ground columns that a training step uses: there are three times as many of them as
/// of all others.
const GROUND_KEPT: f64 = 0.25;
/// Shares of voxels, in eighths, that are treated as unknown; one is drawn for each sample. This
/// imitates sensors with fewer beams, and chapter 4's dropout of its input.
const LOST_EIGHTHS: [u8; 4] = [0, 0, 1, 2];

impl Sample {
    /// The columns in core's form.
    pub fn columns(&self) -> Vec<Column> {
        let solid = self.labels.iter().map(|l| u32::from(*l != UNKNOWN));
        self.masks.iter().zip(solid).map(|(m, solid)| [*m, solid]).collect()
    }

    /// The sample as it is, asking about every labelled column.
    #[cfg(test)]
    pub fn input(&self) -> (Input, Vec<u8>) {
        let at = |i, j| (i, j);
        self.laid(self.corner.map(|c| c.rem_euclid(OCTET as i32) as usize), at, |_| true)
    }

    /// Rotated or mirrored, anywhere on the lattice, with some voxels missing: the square's
    /// symmetries as in section 4.4.3.1.
    pub fn drawn(&self, rng: &mut Rng) -> (Input, Vec<u8>) {
        let draw = rng.bits();
        let phase = [draw >> 8, draw >> 16].map(|d| d as usize % OCTET);
        let last = self.side - 1;
        let at = |i: usize, j: usize| {
            let i = if draw & 1 == 0 { i } else { last - i };
            let j = if draw & 2 == 0 { j } else { last - j };
            if draw & 4 == 0 { (i, j) } else { (j, i) }
        };
        let mut keeps = rng.clone();
        let kept = |label| label != ColumnClass::Ground as u8 || keeps.chance(GROUND_KEPT);
        let (mut input, labels) = self.laid(phase, at, kept);
        let lost = LOST_EIGHTHS[(draw >> 24) as usize % LOST_EIGHTHS.len()];
        for masks in input.masks.iter_mut().filter(|m| lost > 0 && **m != 0) {
            // Of three random bits per voxel, all are set in an eighth, the first two in a quarter.
            let (a, b) = (rng.bits(), rng.bits());
            let quarter = (a & a >> 32) as u32;
            *masks &= !(if lost == 2 { quarter } else { quarter & b as u32 });
        }
        (input, labels)
    }

    fn laid(
        &self,
        phase: [usize; 2],
        at: impl Fn(usize, usize) -> (usize, usize),
        mut kept: impl FnMut(u8) -> bool,
    ) -> (Input, Vec<u8>) {
        let side = (self.side + OCTET - 1).next_multiple_of(OCTET);
        let mut input = Input { side, masks: vec![0; side * side], asked: Vec::new() };
        let mut labels = Vec::new();
        for i in 0..self.side {
            for j in 0..self.side {
                let (from_i, from_j) = at(i, j);
                let from = from_i * self.side + from_j;
                let to = (i + phase[0]) * side + j + phase[1];
                input.masks[to] = self.masks[from];
                let label = self.labels[from];
                if label != UNKNOWN && kept(label) {
                    input.asked.push(to);
                    labels.push(label);
                }
            }
        }
        (input, labels)
    }
}
