//! CDR, little-endian: the encoding of ROS 2 messages.

use raywake_core::pose::Pose;

/// Kind of encapsulation: plain, little-endian.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// A message being written, field by field.
pub(crate) struct Cdr(Vec<u8>);

impl Cdr {
    pub fn new() -> Cdr {
        Cdr(HEAD.to_vec())
    }

    /// Appends bytes, aligned to a multiple of `alignment` after the head.
    fn aligned(&mut self, alignment: usize, bytes: &[u8]) {
        let length = (self.0.len() - HEAD.len()).next_multiple_of(alignment) + HEAD.len();
        self.0.resize(length, 0);
        self.0.extend_from_slice(bytes);
    }

    pub fn byte(&mut self, value: u8) {
        self.0.push(value);
    }

    pub fn word(&mut self, value: u32) {
        self.aligned(4, &value.to_le_bytes());
    }

    pub fn float(&mut self, value: f32) {
        self.aligned(4, &value.to_le_bytes());
    }

    pub fn double(&mut self, value: f64) {
        self.aligned(8, &value.to_le_bytes());
    }

    pub fn text(&mut self, value: &str) {
        self.word(value.len() as u32 + 1);
        self.0.extend_from_slice(value.as_bytes());
        self.0.push(0);
    }

    /// A byte sequence, preceded by its length, as `fill` appends it.
    pub fn bytes(&mut self, fill: impl FnOnce(&mut Vec<u8>)) {
        self.word(0);
        let begin = self.0.len();
        fill(&mut self.0);
        let length = (self.0.len() - begin) as u32;
        self.0[begin - 4..begin].copy_from_slice(&length.to_le_bytes());
    }

    /// A header: time and frame name.
    pub fn header(&mut self, stamp_ns: u64, frame: &str) {
        self.word((stamp_ns / 1_000_000_000) as u32);
        self.word((stamp_ns % 1_000_000_000) as u32);
        self.text(frame);
    }

    pub fn doubles(&mut self, values: impl IntoIterator<Item = f64>) {
        values.into_iter().for_each(|value| self.double(value));
    }

    /// Translation and quaternion.
    pub fn pose(&mut self, pose: &Pose) {
        self.doubles(pose.translation.to_array());
        self.doubles(pose.rotation.to_array());
    }

    /// A position and a direction about +z, rad.
    pub fn planar(&mut self, at: [f64; 3], direction: f64) {
        let (sin, cos) = libm::sincos(0.5 * direction);
        self.doubles(at.into_iter().chain([0.0, 0.0, sin, cos]));
    }

    /// A point field: its name, offset and type, and a count of one.
    pub fn field(&mut self, name: &str, offset: u32, kind: u8) {
        self.text(name);
        self.word(offset);
        self.byte(kind);
        self.word(1);
    }

    /// The message.
    pub fn message(self) -> Vec<u8> {
        self.0
    }
}
