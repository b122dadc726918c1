//! The layout as a document.

use std::fmt::Write;

use raywake_core::layout::{BUFFERS, Heap, Row};
use raywake_core::params::Profile;
use raywake_kernels::schedule;

use super::traffic::{self, Traffic};
use super::{ALIGNMENT, HEAPS, device_bytes, heap_bytes, host_bytes, host_parts};

const HEAD: &str = "\
# Memory layout

What `raywake run` holds from its first sweep to its last, in bytes; nothing is allocated between.
`raywake budget` prints this file from the declarations the program allocates by, and a test
compares the two.

A buffer is so many elements of so many bytes. Words are 32-bit, little-endian; an element is
aligned to its own size. Each heap is one allocation of device memory; in it every buffer begins at
a multiple of 16 bytes, more where a device asks for it. Writers and readers are the steps of the
schedule in the order they first touch the buffer; `fill` sets every word, `copy` moves a whole
buffer.
";

/// Profiles that take the same bytes share a column.
struct Sizes<'a> {
    names: String,
    profile: &'a Profile,
}

/// `memory-layout.md` for some profiles, of which the first one's schedule names the steps.
pub fn memory_layout(profiles: &[Profile]) -> String {
    let mut out = String::from(HEAD);
    if let Some(first) = profiles.first() {
        let traffic = traffic::of(&[schedule::load(), schedule::flow(first)]);
        let sizes = sizes(profiles);
        // Writing to a string cannot fail.
        let _ = HEAPS.iter().try_for_each(|heap| heap_table(&mut out, *heap, &sizes, &traffic));
        let _ = host_table(&mut out, &sizes).and_then(|()| totals(&mut out, &sizes));
    }
    out
}

fn sizes(profiles: &[Profile]) -> Vec<Sizes<'_>> {
    let bytes = |p: &Profile| -> Vec<usize> { BUFFERS.iter().map(|b| b.bytes(p)).collect() };
    let mut all: Vec<Sizes> = Vec::new();
    for profile in profiles {
        match all.iter_mut().find(|s| bytes(s.profile) == bytes(profile)) {
            Some(same) => same.names += &format!(", {}", profile.name),
            None => all.push(Sizes { names: profile.name.to_string(), profile }),
        }
    }
    all
}

/// One cell for each size.
fn cells(sizes: &[Sizes], cell: impl Fn(&Sizes) -> String) -> String {
    sizes.iter().map(cell).collect::<Vec<_>>().join(" | ")
}

fn heap_table(
    out: &mut String,
    heap: Heap,
    sizes: &[Sizes],
    traffic: &[Traffic],
) -> std::fmt::Result {
    let title = match heap {
        Heap::Upload => "Upload: the host writes through a mapping, copies read",
        Heap::Device => "Device: kernels only",
        Heap::Readback => "Readback: copies write, the host reads through a mapping",
    };
    writeln!(out, "\n## {title}\n")?;
    let names = cells(sizes, |s| s.names.clone());
    writeln!(out, "| buffer | element | {names} | align | written by | read by | holds |")?;
    let rule = cells(sizes, |_| "--:".into());
    writeln!(out, "|---|---|{}|--:|---|---|---|", rule.replace(' ', ""))?;
    let rows = BUFFERS.iter().zip(traffic).filter(|(row, _)| row.heap == heap);
    for (row, traffic) in rows {
        let bytes = cells(sizes, |s| amount(row, s.profile));
        let (writers, readers) = (traffic.writers.join(", "), traffic.readers.join(", "));
        writeln!(
            out,
            "| `{}` | `{}` | {bytes} | {ALIGNMENT} | {writers} | {readers} | {} |",
            row.name, row.element, row.doc
        )?;
    }
    let sums = cells(sizes, |s| grouped(heap_bytes(heap, s.profile)));
    writeln!(out, "| total, with padding | | {sums} | | | | |")
}

/// `27,889 x 8 = 223,112`.
fn amount(row: &Row, profile: &Profile) -> String {
    let [count, of] = [(row.count)(profile), 4 * row.words].map(|n| grouped(n as u64));
    format!("{count} x {of} = {}", grouped(row.bytes(profile) as u64))
}

fn host_table(out: &mut String, sizes: &[Sizes]) -> std::fmt::Result {
    writeln!(out, "\n## Host\n")?;
    writeln!(out, "| part | type | {} |", cells(sizes, |s| s.names.clone()))?;
    writeln!(out, "|---|---|{}|", cells(sizes, |_| "--:".into()).replace(' ', ""))?;
    let parts: Vec<_> = sizes.iter().map(|s| host_parts(s.profile, true)).collect();
    for (n, part) in parts[0].iter().enumerate() {
        let bytes: Vec<_> = parts.iter().map(|p| grouped(p[n].bytes)).collect();
        writeln!(out, "| {} | `{}` | {} |", part.name, part.kind, bytes.join(" | "))?;
    }
    writeln!(
        out,
        "\nA sweep of more returns than the capacity is read whole; what the pipeline leaves out of \
         it is counted."
    )
}

fn totals(out: &mut String, sizes: &[Sizes]) -> std::fmt::Result {
    writeln!(out, "\n## Totals\n")?;
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

/// Thousands apart.
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
