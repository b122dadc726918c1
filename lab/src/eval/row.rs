//! One row per (drive, sweep, solid column): the estimates, the truth, and whatever is needed to
//! filter them. Written as Parquet, so that any engine can aggregate many drives.

use crate::labels::Kind;
use crate::labels::trajectory::MOVING_MPS;
use arrow_array::builder::BooleanBuilder;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, UInt8Type, UInt32Type, UInt64Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, Float32Array, Float64Array, Int32Array,
    RecordBatch, StringArray, UInt8Array, UInt32Array, UInt64Array,
};
use arrow_schema::{DataType, Field, Schema};
use raywake_core::output::FlowBasis;
use raywake_core::refinement::cues::Cues;
use std::sync::Arc;

/// Names of [`Row::class`]: the background, which belongs to no labelled object, then the kinds of
/// [`Kind`].
pub const CLASSES: [&str; 10] = [
    "Background",
    "Car",
    "Van",
    "Truck",
    "Bus",
    "Tram",
    "Motorcycle",
    "Cyclist",
    "Pedestrian",
    "Other",
];

/// Index of a kind in [`CLASSES`].
pub const fn class_of(kind: Kind) -> u8 {
    kind as u8 + 1
}

/// How a Rust type is stored in a Parquet column.
trait Cell: Copy {
    fn data_type() -> DataType;
    fn write(values: impl Iterator<Item = Self>) -> ArrayRef;
    fn read(array: &dyn Array) -> Option<Vec<Self>>;
}

macro_rules! cell {
    ($rust:ty, $array:ty, $arrow:ty, $name:ident) => {
        impl Cell for $rust {
            fn data_type() -> DataType {
                DataType::$name
            }
            fn write(values: impl Iterator<Item = Self>) -> ArrayRef {
                Arc::new(<$array>::from_iter_values(values))
            }
            fn read(array: &dyn Array) -> Option<Vec<Self>> {
                let array = array.as_primitive_opt::<$arrow>()?;
                (array.null_count() == 0).then(|| array.values().to_vec())
            }
        }
    };
}

cell!(f32, Float32Array, Float32Type, Float32);
cell!(f64, Float64Array, Float64Type, Float64);
cell!(i32, Int32Array, Int32Type, Int32);
cell!(u8, UInt8Array, UInt8Type, UInt8);
cell!(u32, UInt32Array, UInt32Type, UInt32);
cell!(u64, UInt64Array, UInt64Type, UInt64);

impl Cell for bool {
    fn data_type() -> DataType {
        DataType::Boolean
    }
    fn write(values: impl Iterator<Item = Self>) -> ArrayRef {
        let mut builder = BooleanBuilder::new();
        values.for_each(|v| builder.append_value(v));
        Arc::new(builder.finish())
    }
    fn read(array: &dyn Array) -> Option<Vec<Self>> {
        let array: &BooleanArray = array.as_boolean_opt()?;
        (array.null_count() == 0).then(|| array.iter().map(|v| v == Some(true)).collect())
    }
}

/// Declares the record, its schema, its writer and its reader at once.
macro_rules! row {
    ($($(#[$doc:meta])* $field:ident: $type:ty),* $(,)?) => {
        /// One solid column of the first sweep of a pair.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Row { $($(#[$doc])* pub $field: $type),* }

        fn fields() -> Vec<Field> {
            vec![$(Field::new(stringify!($field), <$type as Cell>::data_type(), false)),*]
        }

        fn arrays(rows: &[Row]) -> Vec<ArrayRef> {
            vec![$(<$type as Cell>::write(rows.iter().map(|r| r.$field))),*]
        }

        /// The rows of a batch; on failure the name of the column that is missing or of another
        /// type.
        pub fn rows(batch: &RecordBatch) -> Result<Vec<Row>, &'static str> {
            let mut rows = vec![Row::default(); batch.num_rows()];
            $({
                let name = stringify!($field);
                let array = batch.column_by_name(name).ok_or(name)?;
                let values = <$type as Cell>::read(array).ok_or(name)?;
                rows.iter_mut().zip(values).for_each(|(r, v)| r.$field = v);
            })*
            Ok(rows)
        }
    };
}

row! {
    /// Index of the sweep in the drive.
    sweep: u32,
    /// Frame number, as counted by the source.
    frame: u64,
    /// Stamp of the sweep, s.
    stamp_s: f64,
    /// Cell of the lattice.
    cell_i: i32,
    /// Cell of the lattice.
    cell_j: i32,
    /// Centre of the column in the vehicle frame, forward, m.
    x: f32,
    /// Centre of the column in the vehicle frame, left, m.
    y: f32,
    /// Index in [`CLASSES`].
    class: u8,
    /// 1 + index of the labelled track; 0: none.
    track: u32,
    /// Whether labels are complete, at both ends of the true motion.
    in_view: bool,
    /// 0: parked, or of no object; 1: slow; 2: moving ([`crate::labels::Motion`]).
    motion: u8,
    /// Whether by exact truth only the ground below its object's box was hit.
    below: bool,
    /// Distance from the column's centre to where something moves, seen from above, m:
    /// 0 within it, infinite if nothing moves.
    mover_m: f32,
    /// Occupied voxels of the column: its weight in the dissertation's tables.
    voxels: u8,
    /// Score of the background filter, in the weights' integers; foreground above 0.
    score: i32,
    /// The encoder's score of what could move against what could not, nat; 0 without an encoder.
    encoder_score: f32,
    /// [`raywake_core::output::FlowBasis`]: 0 background, 1 unmatched, 2 matched, 3 joined.
    basis: u8,
    /// Estimated displacement over ground until the next sweep, world axes, m.
    flow_x: f32,
    /// See `flow_x`.
    flow_y: f32,
    /// Covariance of that displacement, m^2; zero if there is no match.
    flow_cov_xx: f32,
    /// See `flow_cov_xx`.
    flow_cov_xy: f32,
    /// See `flow_cov_xx`.
    flow_cov_yy: f32,
    /// True displacement by the labels as given, m.
    true_x: f32,
    /// See `true_x`.
    true_y: f32,
    /// Displacement by the labels' smoothed motion, zero for parked objects, m. Divided by `dt` it
    /// is the true velocity.
    smooth_x: f32,
    /// See `smooth_x`.
    smooth_y: f32,
    /// Displacement over ground of "no motion relative to the vehicle", m.
    carried_x: f32,
    /// See `carried_x`.
    carried_y: f32,
    /// The true displacement (labels as given) rounded to whole cells, m.
    rounded_x: f32,
    /// See `rounded_x`.
    rounded_y: f32,
    /// Velocity over ground after the tracklet filter, world axes, m/s.
    velocity_x: f32,
    /// See `velocity_x`.
    velocity_y: f32,
    /// Covariance of the velocity, (m/s)^2; zero if there is no tracklet.
    covariance_xx: f32,
    /// See `covariance_xx`.
    covariance_xy: f32,
    /// See `covariance_xx`.
    covariance_yy: f32,
    /// Observations of the tracklet after its birth.
    age: u32,
    /// Time to the next sweep, s.
    dt: f32,
    /// P(moves).
    probability: f32,
    /// A cue of P(moves), as the following fields; see [`raywake_core::refinement::cues::Cues`].
    margin: f32,
    /// See `margin`.
    share: f32,
    /// See `margin`.
    residual: f32,
    /// See `margin`.
    returns: f32,
    /// See `margin`.
    certainty: f32,
    /// See `margin`.
    earlier: f32,
    /// See `margin`.
    worn: f32,
    /// See `margin`.
    fresh: f32,
    /// See `margin`.
    misfit: f32,
    /// See `margin`.
    could_move: f32,
    /// See `margin`.
    no_history: bool,
    /// See `margin`.
    stands: bool,
}

/// Declares which columns are cues; the compiler checks that none is missing.
macro_rules! cue_columns {
    ($($cue:ident),*) => {
        impl Row {
            /// A row with nothing but the cues of P(moves).
            pub fn from_cues(cues: Cues) -> Row {
                Row { $($cue: cues.$cue,)* ..Row::default() }
            }

            /// The cues of its P(moves).
            pub fn cues(&self) -> Cues {
                Cues { $($cue: self.$cue),* }
            }
        }
    };
}

cue_columns!(
    margin, share, residual, returns, certainty, earlier, worn, fresh, misfit, could_move,
    no_history, stands
);

impl Row {
    /// Whether the labelled object moves.
    pub fn is_moving(&self) -> bool {
        self.motion == 2
    }

    /// Whether it moves; `None` if unknown: out of view, slow objects, and the ground below an
    /// object.
    pub fn moves(&self) -> Option<bool> {
        self.moves_by_boxes().filter(|_| !self.below)
    }

    /// The same with everything in a box moving with it, as in labels of recorded drives.
    pub fn moves_by_boxes(&self) -> Option<bool> {
        (self.in_view && self.motion != 1).then_some(self.is_moving())
    }

    /// Whether the flow comes from a match, the column's own or its object's.
    pub fn is_matched(&self) -> bool {
        self.basis >= FlowBasis::Matched as u8
    }

    /// Whether a displacement over ground was output.
    pub fn is_displaced(&self) -> bool {
        self.flow_x != 0.0 || self.flow_y != 0.0
    }

    /// Whether it was reported as moving: with a displacement and a velocity of [`MOVING_MPS`] or
    /// more.
    pub fn is_reported_moving(&self) -> bool {
        let by_velocity = f64::from(self.velocity_x.hypot(self.velocity_y)) >= MOVING_MPS;
        by_velocity && self.is_moving_by_flow()
    }

    /// Whether its displacement alone amounts to [`MOVING_MPS`] over the time between the sweeps.
    pub fn is_moving_by_flow(&self) -> bool {
        f64::from(self.flow_x.hypot(self.flow_y)) >= MOVING_MPS * f64::from(self.dt)
    }

    /// Whether class and motion are in range; those read from a file need not be.
    pub fn is_valid(&self) -> bool {
        usize::from(self.class) < CLASSES.len() && self.motion <= 2
    }
}

/// The columns of a file: `drive` and `kind` as text, then the fields of [`Row`].
pub fn schema() -> Arc<Schema> {
    let text = || DataType::Dictionary(Box::new(DataType::UInt8), Box::new(DataType::Utf8));
    let mut all = vec![Field::new("drive", text(), false), Field::new("kind", text(), false)];
    all.extend(fields());
    Arc::new(Schema::new(all))
}

/// Rows of a drive as a batch of [`schema`].
pub fn batch(drive: &str, rows: &[Row]) -> RecordBatch {
    let coded = |keys: UInt8Array, names: Vec<&str>| -> ArrayRef {
        let names = Arc::new(StringArray::from(names));
        Arc::new(DictionaryArray::<UInt8Type>::new(keys, names))
    };
    let drives = UInt8Array::from_iter_values(rows.iter().map(|_| 0));
    let kinds = UInt8Array::from_iter_values(rows.iter().map(|r| r.class));
    let mut columns = vec![coded(drives, vec![drive]), coded(kinds, CLASSES.to_vec())];
    columns.extend(arrays(rows));
    RecordBatch::try_new(schema(), columns).expect("columns as the schema has them")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_and_read() {
        let rows: Vec<Row> = (0..5)
            .map(|n| Row {
                sweep: n,
                frame: 1 << 40,
                class: n as u8,
                in_view: n == 2,
                flow_x: n as f32 * 0.3,
                score: -7,
                ..Row::default()
            })
            .collect();
        let batch = batch("a", &rows);
        assert_eq!(super::rows(&batch).unwrap(), rows);
        let less = batch.project(&(0..7).collect::<Vec<_>>()).unwrap();
        assert_eq!(super::rows(&less), Err("x"));
    }

    #[test]
    fn classes_match_kinds() {
        for kind in Kind::ALL {
            assert_eq!(CLASSES[class_of(kind) as usize], format!("{kind:?}"));
        }
    }
}
