//! Which steps have to be ordered: the conflict rule, independent of Vulkan.

use crate::{Groups, Op, Program};

/// What one step does to one buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Row of the buffer table.
    pub buffer: usize,
    /// Whether it is read.
    pub reads: bool,
    /// Whether it is written.
    pub writes: bool,
}

impl Access {
    pub(crate) fn read(buffer: usize) -> Self {
        Self { buffer, reads: true, writes: false }
    }

    pub(crate) fn write(buffer: usize) -> Self {
        Self { buffer, reads: false, writes: true }
    }
}

/// Everything a step accesses. An indirect dispatch also reads its group counts.
pub fn accesses(op: &Op) -> Vec<Access> {
    match op {
        Op::Fill { buffer, .. } => vec![Access::write(*buffer)],
        Op::Copy { from, to } => vec![Access::read(*from), Access::write(*to)],
        Op::Dispatch { kernel, buffers, groups, .. } => {
            let bound = buffers.iter().zip(kernel.bindings);
            let mut touched: Vec<_> = bound
                .map(|(&buffer, binding)| Access {
                    buffer,
                    reads: binding.reads,
                    writes: binding.writes,
                })
                .collect();
            if let Groups::Indirect { buffer, .. } = groups {
                touched.push(Access::read(*buffer));
            }
            touched
        }
    }
}

/// What was read and written since the last barrier.
struct Hazards {
    read: Vec<bool>,
    written: Vec<bool>,
}

impl Hazards {
    /// Takes in the next step. Returns whether it needs a barrier before it.
    fn admit(&mut self, step: &[Access]) -> bool {
        let barrier = step.iter().any(|a| {
            let (read, written) = (self.read[a.buffer], self.written[a.buffer]);
            (a.reads && written) || (a.writes && (read || written))
        });
        if barrier {
            self.read.fill(false);
            self.written.fill(false);
        }
        for a in step {
            self.read[a.buffer] |= a.reads;
            self.written[a.buffer] |= a.writes;
        }
        barrier
    }
}

/// For each step, whether it needs a barrier before it.
pub(crate) fn barriers(steps: &[Vec<Access>], buffers: usize) -> Vec<bool> {
    let mut hazards = Hazards { read: vec![false; buffers], written: vec![false; buffers] };
    steps.iter().map(|step| hazards.admit(step)).collect()
}

/// Number of commands of a program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommandCounts {
    /// Dispatches of kernels.
    pub dispatches: usize,
    /// Fills of buffers.
    pub fills: usize,
    /// Copies between buffers.
    pub copies: usize,
    /// Barriers between these.
    pub barriers: usize,
}

impl Program {
    /// Counts the commands that it is recorded as, over a table of this many buffers.
    pub fn commands(&self, buffers: usize) -> CommandCounts {
        let steps: Vec<_> = self.ops.iter().map(accesses).collect();
        let barriers = barriers(&steps, buffers).into_iter().filter(|&b| b).count();
        self.ops.iter().fold(CommandCounts { barriers, ..Default::default() }, |mut counts, op| {
            *match op {
                Op::Dispatch { .. } => &mut counts.dispatches,
                Op::Fill { .. } => &mut counts.fills,
                Op::Copy { .. } => &mut counts.copies,
            } += 1;
            counts
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Binding, Kernel, Spirv};

    fn barriers(steps: &[Vec<Access>]) -> Vec<bool> {
        super::barriers(steps, 4)
    }

    /// The first two steps that conflict without a barrier between them. It compares every pair, so
    /// that it can prove the rule wrong.
    fn unordered(steps: &[Vec<Access>], barriers: &[bool]) -> Option<(usize, usize)> {
        let pairs = (0..steps.len()).flat_map(|later| (0..later).map(move |first| (first, later)));
        pairs
            .filter(|&(first, later)| !barriers[first + 1..=later].contains(&true))
            .find(|&(first, later)| conflict(&steps[first], &steps[later]))
    }

    fn conflict(first: &[Access], second: &[Access]) -> bool {
        let pairs = first.iter().flat_map(|a| second.iter().map(move |b| (a, b)));
        pairs
            .filter(|(a, b)| a.buffer == b.buffer)
            .any(|(a, b)| (a.writes && (b.reads || b.writes)) || (a.reads && b.writes))
    }

    #[test]
    fn barriers_are_placed_only_where_accesses_conflict() {
        let (r, w) = (vec![Access::read(0)], vec![Access::write(0)]);
        let elsewhere = vec![Access::write(1)];
        assert_eq!(barriers(&[r.clone(), r.clone()]), [false, false]);
        assert_eq!(barriers(&[w.clone(), elsewhere]), [false, false]);
        assert_eq!(barriers(&[w.clone(), r.clone()]), [false, true]);
        assert_eq!(barriers(&[r.clone(), w.clone()]), [false, true]);
        assert_eq!(barriers(&[w.clone(), w.clone()]), [false, true]);
    }

    #[test]
    fn a_barrier_orders_everything_before_it() {
        let both = vec![Access::write(0), Access::write(1)];
        let steps = [both, vec![Access::read(0)], vec![Access::read(1)]];
        assert_eq!(barriers(&steps), [false, true, false]);
        let again = [steps.to_vec(), vec![vec![Access::write(0)]]].concat();
        assert_eq!(barriers(&again), [false, true, false, true]);
    }

    #[test]
    fn fills_write_copies_read_and_write_indirect_counts_are_read() {
        static KERNEL: Kernel = Kernel {
            name: "k",
            // SAFETY: it is never run.
            spirv: unsafe { Spirv::new(&[]) },
            workgroup: [1; 3],
            bindings: &[Binding::storage("b", true, true)],
        };
        let fill = Op::Fill { buffer: 2, value: 0 };
        let indirect = Op::Dispatch {
            name: "d",
            kernel: &KERNEL,
            buffers: vec![1],
            groups: Groups::Indirect { buffer: 2, offset_bytes: 0 },
        };
        let changed = Access { buffer: 1, reads: true, writes: true };
        assert_eq!(accesses(&fill), [Access::write(2)]);
        assert_eq!(accesses(&Op::Copy { from: 0, to: 1 }), [Access::read(0), Access::write(1)]);
        assert_eq!(accesses(&indirect), [changed, Access::read(2)]);
        let steps = [accesses(&fill), accesses(&indirect)];
        assert_eq!(barriers(&steps), [false, true]);
    }

    #[test]
    fn a_missing_barrier_is_found() {
        let (r, w) = (vec![Access::read(0)], vec![Access::write(0)]);
        let other = vec![Access::write(1)];
        let missing = |steps: &[&Vec<Access>], barriers: &[bool]| {
            let steps: Vec<_> = steps.iter().map(|&s| s.clone()).collect();
            unordered(&steps, barriers)
        };
        assert_eq!(missing(&[&r, &r, &other], &[false; 3]), None);
        assert_eq!(missing(&[&w, &other, &r], &[false; 3]), Some((0, 2)));
        assert_eq!(missing(&[&r, &w], &[false; 2]), Some((0, 1)));
        assert_eq!(missing(&[&w, &w], &[false, true]), None);
        assert_eq!(missing(&[&w, &r, &w], &[false, true, false]), Some((1, 2)));
    }

    /// Random schedules: the rule leaves no pair unordered, and none of its barriers is redundant.
    #[test]
    fn the_rule_and_the_pairs_agree() {
        let mut state = 1u32;
        let mut next = |n: u32| {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 16) % n
        };
        let mut access =
            || Access { buffer: next(4) as usize, reads: next(2) == 0, writes: next(3) == 0 };
        for round in 0..200 {
            let steps: Vec<_> =
                (0..12).map(|i| (0..1 + (round + i) % 2).map(|_| access()).collect()).collect();
            let barriers = barriers(&steps);
            assert_eq!(unordered(&steps, &barriers), None);
            for i in (0..steps.len()).filter(|&i| barriers[i]) {
                let mut without = barriers.clone();
                without[i] = false;
                assert!(unordered(&steps[..=i], &without[..=i]).is_some());
            }
        }
    }
}
