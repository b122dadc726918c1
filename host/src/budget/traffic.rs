//! Which steps write and read each buffer, according to the schedules.

use raywake_gpu::{Heap, Op, accesses};
use raywake_kernels::schedule::Schedule;

/// Names of the steps that touch a buffer, each once, in the order of first use.
#[derive(Clone, Debug, Default)]
pub(super) struct Traffic {
    pub writers: Vec<&'static str>,
    pub readers: Vec<&'static str>,
}

/// The traffic of every buffer over the programs, in execution order.
pub(super) fn of(schedule: &Schedule) -> Vec<Traffic> {
    let mut all: Vec<Traffic> = vec![Traffic::default(); schedule.rows.len()];
    for (buffer, traffic) in schedule.rows.iter().zip(&mut all) {
        if buffer.heap == Heap::Upload {
            note(&mut traffic.writers, "host");
        }
    }
    schedule.programs.iter().flat_map(|p| &p.ops).for_each(|op| step(op, &mut all));
    for (buffer, traffic) in schedule.rows.iter().zip(&mut all) {
        if buffer.heap == Heap::Readback {
            note(&mut traffic.readers, "host");
        }
    }
    all
}

fn step(op: &Op, all: &mut [Traffic]) {
    for access in accesses(op) {
        let traffic = &mut all[access.buffer];
        if access.writes {
            note(&mut traffic.writers, op.name());
        }
        if access.reads {
            note(&mut traffic.readers, op.name());
        }
    }
}

fn note(names: &mut Vec<&'static str>, name: &'static str) {
    if !names.contains(&name) {
        names.push(name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::params::Profile;
    use raywake_core::stages::{Buffer, FLOW_PROGRAMS};

    #[test]
    fn the_largest_table_is_written_once() {
        let schedule = Schedule::new(FLOW_PROGRAMS, &Profile::hdl64());
        let pair = &of(&schedule)[schedule.index(Heap::Device, Buffer::pair_cost)];
        assert_eq!(
            (&pair.writers[..], &pair.readers[..]),
            (&["occupancy_constancy"][..], &["window", "expectation"][..])
        );
    }
}
