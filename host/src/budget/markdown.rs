//! The memory layout as a Markdown document.

use std::fmt::Write;

use raywake_core::params::{Profile, REACH};
use raywake_core::record::{PACKED, SweepUniform};
use raywake_core::stages::BufferRow;
use raywake_gpu::{Buffer, CommandCounts, Heap, Op, Program};
use raywake_kernels::schedule::Schedule;

use super::traffic::{self, Traffic};
use super::{
    ALIGNMENT, HEAPS, device_bytes, heap_bytes, host_bytes, host_parts, is_map, schedule,
    track_parts,
};

const HEAD: &str = "\
# Memory layout

What `raywake run` holds from its first sweep to its last, in bytes; nothing is allocated between.
The memory of `raywake map` and `raywake track` is just as fixed; see `Sparse map` and `Tracks`.
`raywake budget` prints this file from the declarations the program allocates by, and a test
compares the two.

A buffer is a number of elements of a given size. Words are 32-bit, little-endian; an element is
aligned to its own size. Each heap is one allocation of device memory; in it every buffer begins at
a multiple of 16 bytes, or of more if the device requires it. No two buffers alias: each has its
bytes to itself throughout. Writers and readers are the steps of the schedule in the order they
first touch the buffer; `fill` sets every word, `copy` copies a whole buffer.
";

const MAP_HEAD: &str = "
## Sparse map

`raywake map` holds these buffers instead. A sweep passes through `map rays` once, then through
`map count` and `map band` for every band of keys.
";

/// Text below the host table of the sparse map.
const MAP_HOST: &str = "
The voxels of a sweep, and the file made from them, grow with what is seen and are not counted.
";

/// Text below either host table.
const CAPACITY: &str = "
A sweep of more returns than the capacity is read whole; the pipeline counts the returns that it
leaves out.
";

const COMMANDS_HEAD: &str = "\
Every program runs once a sweep, except `load`, which runs before the first, and `map count` and
`map band`. What kernels read and write depends on the sweep.
";

const TRACKS_HEAD: &str = "
## Tracks

`raywake track` holds these parts on the host, and two sweeps; with the flow, also what `raywake
run` holds. The last part replaces all others when objects are tracked on board, by `raywake live
--objects` and in the libraries.

| part | type | bytes |
|---|---|--:|
";

/// Text below the table of the tracks.
const TRACKS_HOST: &str = "
The states of ended tracks, held until their file is written, are not counted.
";

const RECORDS_HEAD: &str = "
## Records

`sweep_in` and `sweep` each hold one `SweepUniform` record, for the sweep or, in the sparse map, for
the band.

| word | byte | field | type |
|--:|--:|---|---|
";

/// Profiles with identical buffer sizes, which share a column.
struct Sizes<'a> {
    names: String,
    profile: &'a Profile,
}

/// The layout of buffers that are allocated together.
struct Layout<'a> {
    /// Markdown heading prefix of a section.
    level: &'static str,
    schedule: Schedule,
    sizes: Vec<Sizes<'a>>,
    traffic: Vec<Traffic>,
    /// Text below the host table.
    host: &'static str,
}

/// Returns `memory-layout.md` for some profiles. The steps of the flow are named by the schedule of
/// its first profile.
pub fn memory_layout(profiles: &[Profile]) -> String {
    let (maps, flows): (Vec<&Profile>, Vec<&Profile>) = profiles.iter().partition(|p| is_map(p));
    let mut out = String::from(HEAD);
    // Writing to a string cannot fail.
    if let Some(first) = flows.first() {
        let _ = flow(first, &flows).write(&mut out);
    }
    if !maps.is_empty() {
        out += MAP_HEAD;
        let _ = map(&maps).write(&mut out);
    }
    out += TRACKS_HEAD;
    for part in track_parts() {
        let _ = writeln!(out, "| {} | `{}` | {} |", part.name, part.kind, grouped(part.bytes));
    }
    out += TRACKS_HOST;
    let _ = records(&mut out);
    out
}

fn flow<'a>(first: &Profile, profiles: &[&'a Profile]) -> Layout<'a> {
    Layout {
        level: "##",
        sizes: sizes(profiles),
        traffic: traffic::of(&schedule(first)),
        schedule: schedule(first),
        host: "",
    }
}

fn map<'a>(profiles: &[&'a Profile]) -> Layout<'a> {
    Layout {
        level: "###",
        sizes: sizes(profiles),
        traffic: traffic::of(&schedule(profiles[0])),
        schedule: schedule(profiles[0]),
        host: MAP_HOST,
    }
}

impl Layout<'_> {
    fn write(&self, out: &mut String) -> std::fmt::Result {
        HEAPS.iter().try_for_each(|heap| heap_table(out, *heap, self))?;
        host_table(out, self)?;
        totals(out, self)?;
        commands(out, self)
    }
}

fn sizes<'a>(profiles: &[&'a Profile]) -> Vec<Sizes<'a>> {
    let bytes = |p: &Profile| -> Vec<u64> {
        schedule(p).buffers(p).iter().map(|b: &Buffer| b.bytes).collect()
    };
    let mut all: Vec<Sizes> = Vec::new();
    for &profile in profiles {
        match all.iter_mut().find(|s| bytes(s.profile) == bytes(profile)) {
            Some(same) => same.names += &format!(", {}", profile.name),
            None => all.push(Sizes { names: profile.name.to_string(), profile }),
        }
    }
    all
}

fn cells(sizes: &[Sizes], cell: impl Fn(&Sizes) -> String) -> String {
    sizes.iter().map(cell).collect::<Vec<_>>().join(" | ")
}

fn heap_table(out: &mut String, heap: Heap, layout: &Layout) -> std::fmt::Result {
    let (level, sizes) = (layout.level, &layout.sizes[..]);
    let title = match heap {
        Heap::Upload => "Upload: the host writes through a mapping, copies read",
        Heap::Device => "Device: kernels only",
        Heap::Readback => "Readback: copies write, the host reads through a mapping",
    };
    writeln!(out, "\n{level} {title}\n")?;
    let names = cells(sizes, |s| s.names.clone());
    writeln!(out, "| buffer | element | {names} | align | written by | read by | holds |")?;
    let rule = cells(sizes, |_| "--:".into());
    writeln!(out, "|---|---|{}|--:|---|---|---|", rule.replace(' ', ""))?;
    let rows = layout.schedule.rows.iter().zip(&layout.traffic).filter(|(row, _)| row.heap == heap);
    for (row, traffic) in rows {
        let bytes = cells(sizes, |s| amount(row.buffer.row(), s.profile));
        let (writers, readers) = (traffic.writers.join(", "), traffic.readers.join(", "));
        writeln!(
            out,
            "| `{}` | `{}` | {bytes} | {ALIGNMENT} | {writers} | {readers} | {} |",
            row.name(),
            row.buffer.row().element,
            row.buffer.row().doc
        )?;
    }
    let sums = cells(sizes, |s| grouped(heap_bytes(heap, s.profile)));
    writeln!(out, "| total, with padding | | {sums} | | | | |")?;
    Ok(())
}

/// `27,889 x 8 = 223,112`.
fn amount(row: &BufferRow, profile: &Profile) -> String {
    let [count, of] = [(row.count)(profile), row.element_bytes].map(|n| grouped(n as u64));
    format!("{count} x {of} = {}", grouped(row.bytes(profile) as u64))
}

fn host_table(out: &mut String, layout: &Layout) -> std::fmt::Result {
    let (level, sizes) = (layout.level, &layout.sizes[..]);
    writeln!(out, "\n{level} Host\n")?;
    writeln!(out, "| part | type | {} |", cells(sizes, |s| s.names.clone()))?;
    writeln!(out, "|---|---|{}|", cells(sizes, |_| "--:".into()).replace(' ', ""))?;
    let parts: Vec<_> = sizes.iter().map(|s| host_parts(s.profile, true)).collect();
    for (n, part) in parts[0].iter().enumerate() {
        let bytes: Vec<_> = parts.iter().map(|p| grouped(p[n].bytes)).collect();
        writeln!(out, "| {} | `{}` | {} |", part.name, part.kind, bytes.join(" | "))?;
    }
    out.push_str(CAPACITY);
    out.push_str(layout.host);
    Ok(())
}

fn totals(out: &mut String, layout: &Layout) -> std::fmt::Result {
    let (level, sizes) = (layout.level, &layout.sizes[..]);
    writeln!(out, "\n{level} Totals\n")?;
    writeln!(out, "| backend | memory | {} |", cells(sizes, |s| s.names.clone()))?;
    writeln!(out, "|---|---|{}|", cells(sizes, |_| "--:".into()).replace(' ', ""))?;
    let mut row = |name: &str, bytes: &dyn Fn(&Profile) -> u64| {
        writeln!(out, "| {name} | {} |", cells(sizes, |s| grouped(bytes(s.profile))))
    };
    row("vulkan | device", &device_bytes)?;
    row("vulkan | host", &|p| host_bytes(p, false))?;
    row("vulkan | both", &|p| device_bytes(p) + host_bytes(p, false))?;
    row("scalar | host", &|p| host_bytes(p, true))
}

/// What a sweep has the device do.
fn commands(out: &mut String, layout: &Layout) -> std::fmt::Result {
    let (level, sizes, schedule) = (layout.level, &layout.sizes[..], &layout.schedule);
    writeln!(out, "\n{level} Commands\n\n{COMMANDS_HEAD}")?;
    let names = cells(sizes, |s| format!("{}: bytes filled or copied", s.names));
    writeln!(out, "| program | dispatches | fills | copies | barriers | {names} |")?;
    let rule = cells(sizes, |_| "--:".into()).replace(' ', "");
    writeln!(out, "|---|--:|--:|--:|--:|{rule}|")?;
    for program in &schedule.programs {
        let CommandCounts { dispatches, fills, copies, barriers } =
            program.commands(schedule.rows.len());
        let moved = cells(sizes, |s| grouped(moved(program, schedule, s.profile)));
        let counts = format!("{dispatches} | {fills} | {copies} | {barriers}");
        writeln!(out, "| {} | {counts} | {moved} |", program.name)?;
    }
    Ok(())
}

/// Bytes that the fills and copies of a program write.
fn moved(program: &Program, schedule: &Schedule, profile: &Profile) -> u64 {
    let bytes = |buffer: usize| schedule.rows[buffer].buffer.row().bytes(profile) as u64;
    let written = program.ops.iter().map(|op| match op {
        Op::Fill { buffer, .. } | Op::Copy { to: buffer, .. } => bytes(*buffer),
        Op::Dispatch { .. } => 0,
    });
    written.sum()
}

/// Writes the words of records, and how elements are packed.
fn records(out: &mut String) -> std::fmt::Result {
    out.push_str(RECORDS_HEAD);
    for (word, field) in SweepUniform::FIELDS.iter().enumerate() {
        writeln!(out, "| {word} | {} | `{field}` | `i32` |", 4 * word)?;
    }
    out.push_str("\nOther elements are plain words or packed:\n\n");
    for (name, bytes, layout) in PACKED {
        writeln!(out, "- `{name}`, {bytes} bytes:{}", layout.replace("REACH", &REACH.to_string()))?;
    }
    Ok(())
}

/// Formats a number with commas between thousands.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|group| std::str::from_utf8(group).unwrap_or_default())
        .collect();
    groups.join(",")
}

#[cfg(test)]
mod tests {
    use super::grouped;

    #[test]
    fn thousands() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }
}
