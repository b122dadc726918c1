//! The report printed at the end of a run.

use std::fmt::Write;

use crate::console::bytes;
use crate::order_statistics::Spread;
use crate::summary::RunSummary;

/// Formats everything in a summary for the user.
pub fn text(s: &RunSummary) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut out, s);
    out
}

fn write(out: &mut String, s: &RunSummary) -> std::fmt::Result {
    let end = if s.facts.interrupted { ", INTERRUPTED" } else { "" };
    writeln!(out, "\n{} sweeps, {} pairs{end}", s.sweeps, s.pairs)?;
    times(out, s)?;
    amounts(out, s)?;
    tracklets(out, s)?;
    dropped(out, s)?;
    writeln!(
        out,
        "memory     {} device, {} host; {} Vulkan allocations, none during sweeps",
        bytes(s.facts.device_bytes),
        bytes(s.facts.host_bytes),
        s.facts.vulkan_allocations
    )?;
    if let Some(failure) = &s.facts.device_failure {
        writeln!(out, "device     {failure}: the scalar backend took over")?;
    }
    if let Some(messages) = &s.facts.validation_messages {
        writeln!(out, "validation {} messages", messages.len())?;
        messages.iter().try_for_each(|m| writeln!(out, "  {m}"))?;
    }
    writeln!(out, "digest     {}", s.digest)
}

fn times(out: &mut String, s: &RunSummary) -> std::fmt::Result {
    let Some(total) = &s.total_ms else {
        return writeln!(out, "no pair of consecutive sweeps, thus neither flow nor times");
    };
    let names = s.stage_ms.0.iter().map(|(name, _)| name.len());
    let width = names.max().unwrap_or(0).max(5);
    let head = ["median", "sd", "p99", "max"];
    writeln!(out, "\n{:width$}  {}   ms", "stage", head.map(|h| format!("{h:>8}")).join(""))?;
    let mut row = |name: &str, t: &Spread| {
        let values = [t.median, t.sd, t.p99, t.max].map(|v| format!("{v:8.2}"));
        writeln!(out, "{name:width$}  {}", values.join(""))
    };
    s.stage_ms.0.iter().try_for_each(|(name, spread)| row(name, spread))?;
    row("total", total)?;
    let share = 100.0 * s.share_under_100_ms.unwrap_or(0.0);
    writeln!(
        out,
        "{share:.1} % of the pairs in under 100 ms; {:.0} occupied columns, {:.0} foreground",
        s.solid_columns, s.foreground_columns
    )?;
    writeln!(out, "file I/O per sweep: {:.1} ms read, {:.1} ms write", s.read_ms, s.write_ms)
}

fn amounts(out: &mut String, s: &RunSummary) -> std::fmt::Result {
    writeln!(
        out,
        "\nper sweep  {:.0} returns, {:.0} distinct rays, {:.0} occupied columns, {:.0} foreground \
         columns, {:.0} valid flows",
        s.points, s.distinct_rays, s.solid_columns, s.foreground_columns, s.valid_flows_per_sweep
    )
}

fn tracklets(out: &mut String, s: &RunSummary) -> std::fmt::Result {
    let ages = &s.tracklets_by_age.0;
    let cells = |cell: &dyn Fn(usize) -> String| -> String {
        (0..ages.len()).map(|n| format!("{:>8}", cell(n))).collect()
    };
    writeln!(out, "tracklets  age    {}", cells(&|n| ages[n].0.to_string()))?;
    writeln!(out, "           mean   {}", cells(&|n| format!("{:.0}", ages[n].1.mean)))?;
    writeln!(out, "           at end {}", cells(&|n| ages[n].1.end.to_string()))?;
    let t = &s.tracklet_turnover;
    writeln!(
        out,
        "           {} born, {} updated, {} coasting; {} lost, {} gated out, {} merged, \
         {} left the window",
        t.born, t.updated, t.waiting, t.lost, t.gated, t.merged, t.left
    )
}

fn dropped(out: &mut String, s: &RunSummary) -> std::fmt::Result {
    writeln!(out, "dropped    {}", s.dropped)?;
    for (n, reset) in s.resets.iter().enumerate() {
        let label = if n == 0 { "resets" } else { "" };
        writeln!(out, "{label:10} sweep {} (frame {}): {}", reset.sweep, reset.frame, reset.text)?;
    }
    Ok(())
}
