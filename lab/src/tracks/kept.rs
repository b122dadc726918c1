//! Simulated sets kept in a file: casting them again takes minutes.
//!
//! Little-endian: the key of the request, then every object's head, returns, ends of batches and
//! truth, then a checksum of everything.

use super::object::{Moment, Object};
use super::simulated::{Drives, Sets, Wanted, rule, simulate};
use crate::labels::Kind;
use glam::DVec3;
use raywake_core::digest::Digest;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_objects::ObjectReturn;
use std::io::Write;
use std::path::Path;

/// Version of the simulator and the format: files of another version are regenerated.
const VERSION: u32 = 4;

/// The sets of these drives, read from a folder, or simulated and stored there.
///
/// Fails if the folder cannot be written. A file that is damaged or was made from another request
/// is regenerated.
pub fn sets(folder: &Path, drives: &Drives, wanted: &Wanted) -> Result<Sets, Error> {
    let path = folder.join(format!("objects-{}.bin", drives.seed));
    let key = key(drives, wanted);
    if let Some(sets) = std::fs::read(&path).ok().and_then(|bytes| read(&bytes, key)) {
        return Ok(sets);
    }
    let sets = simulate(drives, wanted);
    atomic::create_folder(folder)?;
    atomic::write(&path, |out| out.write_all(&write(&sets, key)))?;
    Ok(sets)
}

/// Digest of everything that decides the objects.
pub fn key(drives: &Drives, wanted: &Wanted) -> u64 {
    Digest::of(format!("{VERSION} {drives:?} {wanted:?} {}", rule()).as_bytes())
}

fn write(sets: &Sets, key: u64) -> Vec<u8> {
    let mut out = key.to_le_bytes().to_vec();
    for objects in [&sets.stationary, &sets.moving] {
        count(&mut out, objects.len());
        objects.iter().for_each(|object| write_object(&mut out, object));
    }
    let check = Digest::of(&out);
    out.extend(check.to_le_bytes());
    out
}

fn count(out: &mut Vec<u8>, n: usize) {
    out.extend((n as u64).to_le_bytes());
}

fn write_object(out: &mut Vec<u8>, o: &Object) {
    count(out, o.name.len());
    out.extend(o.name.as_bytes());
    let kind = Kind::ALL.iter().position(|k| *k == o.kind).unwrap_or(0);
    count(out, kind);
    count(out, usize::from(o.stationary));
    let head = o.size.into_iter().chain(o.anchor.to_array()).chain([o.start_s]);
    out.extend(head.flat_map(f64::to_le_bytes));
    count(out, o.returns.len());
    for r in &o.returns {
        let numbers = r.position.into_iter().chain(r.origin).chain([r.time_s]);
        out.extend(numbers.flat_map(f32::to_le_bytes));
        out.extend([r.sensor, u8::from(r.passed[0]), u8::from(r.passed[1])]);
    }
    count(out, o.batches.len());
    o.batches.iter().for_each(|b| count(out, b.end));
    count(out, o.truth.len());
    for m in &o.truth {
        let numbers = [m.time_s, m.heading, m.turn_rate].into_iter();
        let numbers = numbers.chain(m.position.to_array()).chain(m.velocity.to_array());
        out.extend(numbers.flat_map(f64::to_le_bytes));
    }
}

/// The sets in a file; `None` if it is damaged or has another key.
pub fn read(bytes: &[u8], key: u64) -> Option<Sets> {
    let (content, check) = bytes.split_last_chunk::<8>()?;
    if u64::from_le_bytes(*check) != Digest::of(content) {
        return None;
    }
    let mut left = Unread(content);
    if left.word()? != key {
        return None;
    }
    Some(Sets { stationary: left.all(Unread::object)?, moving: left.all(Unread::object)? })
}

/// The bytes not yet read.
struct Unread<'a>(&'a [u8]);

impl Unread<'_> {
    fn chunk<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (chunk, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*chunk)
    }

    fn word(&mut self) -> Option<u64> {
        self.chunk().map(u64::from_le_bytes)
    }

    fn count(&mut self) -> Option<usize> {
        usize::try_from(self.word()?).ok()
    }

    /// A count, followed by that many items.
    fn all<T>(&mut self, one: impl Fn(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let count = self.count()?;
        (0..count).map(|_| one(self)).collect()
    }

    fn doubles<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut all = [0.0; N];
        for value in &mut all {
            *value = f64::from_le_bytes(self.chunk()?);
        }
        Some(all)
    }

    fn object(&mut self) -> Option<Object> {
        let name = String::from_utf8(self.all(|left| left.chunk::<1>().map(|[b]| b))?).ok()?;
        let kind = *Kind::ALL.get(self.count()?)?;
        let stationary = self.count()? == 1;
        let [length, width, height, x, y, z, start_s] = self.doubles()?;
        let returns = self.all(Unread::one_return)?;
        let ends = self.all(Unread::count)?;
        let starts = [0].into_iter().chain(ends.iter().copied());
        let batches = starts.zip(ends.iter().copied()).map(|(a, b)| a..b).collect();
        let truth = self.all(Unread::moment)?;
        Some(Object {
            name,
            kind,
            size: [length, width, height],
            stationary,
            anchor: DVec3::new(x, y, z),
            start_s,
            returns,
            batches,
            truth,
        })
    }

    fn one_return(&mut self) -> Option<ObjectReturn> {
        let mut v = [0.0; 7];
        for value in &mut v {
            *value = f32::from_le_bytes(self.chunk()?);
        }
        let [sensor, left, right] = self.chunk()?;
        let passed = [left, right].map(|side| side != 0);
        let [x, y, z, ox, oy, oz, time_s] = v;
        Some(ObjectReturn { position: [x, y, z], origin: [ox, oy, oz], time_s, sensor, passed })
    }

    fn moment(&mut self) -> Option<Moment> {
        let [time_s, heading, turn_rate, x, y, z, vx, vy, vz] = self.doubles()?;
        let (position, velocity) = (DVec3::new(x, y, z), DVec3::new(vx, vy, vz));
        Some(Moment { time_s, position, heading, velocity, turn_rate })
    }
}
