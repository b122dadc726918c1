//! The programs of `raywake_core::stages` as run by a device. Barriers follow from what the kernels
//! read and write.

use raywake_core::params::{Profile, TILE};
use raywake_core::stages::{
    self, Buffer, GROUPS_DISTINCT, GROUPS_FOREGROUND, GROUPS_ROWS, GroupCount, List, Runner, Stage,
    needed, walk,
};
use raywake_gpu::{self as gpu, Heap, Kernel};

use crate::kernel::KERNELS;

/// Some programs and the memory they share on a device.
pub struct Schedule {
    /// Everything that is allocated.
    pub rows: Vec<MemoryRow>,
    /// The programs, in the order given, referring to the rows.
    pub programs: Vec<gpu::Program>,
    /// The same for devices that are CPUs.
    pub on_cpus: Vec<gpu::Program>,
}

/// Selects which of a stage's kernels run.
type KernelsOf = fn(&'static Stage) -> &'static [(&'static str, GroupCount)];

/// A buffer on the device, or the mapped one through which it is transferred.
#[derive(Clone, Copy, Debug)]
pub struct MemoryRow {
    /// What it holds.
    pub buffer: Buffer,
    /// Who accesses it.
    pub heap: Heap,
}

impl MemoryRow {
    /// Its name.
    pub fn name(&self) -> &'static str {
        let row = self.buffer.row();
        match self.heap {
            Heap::Upload => row.upload,
            Heap::Device => row.name,
            Heap::Readback => row.readback,
        }
    }
}

impl Schedule {
    /// A schedule with the sizes of a profile.
    pub fn new(programs: &[stages::StageProgram], profile: &Profile) -> Schedule {
        let mut rows = Vec::new();
        for heap in [Heap::Upload, Heap::Device, Heap::Readback] {
            let wanted = Buffer::ALL.iter().filter(|b| match heap {
                Heap::Device => needed(programs, Runner::Device, **b),
                _ => crosses(programs, **b, heap),
            });
            rows.extend(wanted.map(|&buffer| MemoryRow { buffer, heap }));
        }
        let mut schedule = Schedule { rows, programs: Vec::new(), on_cpus: Vec::new() };
        let on = |kernels| programs.iter().map(|p| schedule.program(p, kernels, profile)).collect();
        let all = [on(|stage| stage.kernels), on(Stage::kernels_on_cpus)];
        [schedule.programs, schedule.on_cpus] = all;
        schedule
    }

    /// The programs for a device.
    pub fn programs_on(&self, device: &gpu::DeviceInfo) -> &[gpu::Program] {
        if device.kind == gpu::DeviceKind::Cpu { &self.on_cpus } else { &self.programs }
    }

    /// The table in the executor's form.
    pub fn buffers(&self, profile: &Profile) -> Vec<gpu::Buffer> {
        let of = |row: &MemoryRow| gpu::Buffer {
            name: row.name(),
            heap: row.heap,
            bytes: row.buffer.row().bytes(profile) as u64,
        };
        self.rows.iter().map(of).collect()
    }

    /// Index of a row. The programs only touch rows that exist.
    pub fn index(&self, heap: Heap, buffer: Buffer) -> usize {
        let found = self.rows.iter().position(|r| r.heap == heap && r.buffer == buffer);
        found.unwrap_or_else(|| panic!("`{}` is in no {heap:?} row", buffer.row().name))
    }

    fn program(
        &self,
        program: &stages::StageProgram,
        kernels: KernelsOf,
        profile: &Profile,
    ) -> gpu::Program {
        let mut ops = Vec::new();
        let row = |heap, buffer| self.index(heap, buffer);
        walk(program.ops, Runner::Device, profile.em_rounds, &mut |op| match op {
            stages::StageOp::Upload(b) => {
                ops.push(gpu::Op::Copy { from: row(Heap::Upload, b), to: row(Heap::Device, b) })
            }
            stages::StageOp::ReadBack(b) => {
                ops.push(gpu::Op::Copy { from: row(Heap::Device, b), to: row(Heap::Readback, b) })
            }
            stages::StageOp::Fill(b, value) => {
                ops.push(gpu::Op::Fill { buffer: row(Heap::Device, b), value });
            }
            stages::StageOp::Run(stage) => {
                ops.extend(self.dispatches(stage, kernels(stage), profile))
            }
            other => unreachable!("{other:?} is a list of others"),
        });
        gpu::Program { name: program.name, ops }
    }

    fn dispatches(
        &self,
        stage: &'static Stage,
        kernels: &[(&'static str, GroupCount)],
        profile: &Profile,
    ) -> Vec<gpu::Op> {
        let buffers: Vec<usize> =
            stage.bindings().map(|a| self.index(Heap::Device, a.buffer)).collect();
        let dispatch = |(entry, groups): &(&'static str, GroupCount)| {
            let kernel = kernel(entry);
            gpu::Op::Dispatch {
                name: stage.name,
                kernel,
                buffers: buffers.clone(),
                groups: self.groups(*groups, kernel, profile),
            }
        };
        kernels.iter().map(dispatch).collect()
    }

    fn groups(&self, groups: GroupCount, kernel: &Kernel, profile: &Profile) -> gpu::Groups {
        let fixed = |count: usize| gpu::Groups::Fixed([count as u32, 1, 1]);
        let indirect = |word: usize| gpu::Groups::Indirect {
            buffer: self.index(Heap::Device, Buffer::counters),
            offset_bytes: 4 * word as u64,
        };
        match groups {
            GroupCount::One => fixed(1),
            GroupCount::Threads(count) => {
                fixed(count(profile).div_ceil(kernel.workgroup[0] as usize))
            }
            GroupCount::Tiles(count) => fixed(count(profile).div_ceil(TILE)),
            GroupCount::ThreadPer(List::Distinct) => indirect(GROUPS_DISTINCT),
            GroupCount::ThreadPer(List::Foreground) => indirect(GROUPS_FOREGROUND),
            GroupCount::GroupPerColumn => indirect(GROUPS_ROWS),
        }
    }
}

/// The kernel of an entry point; the build has checked that there is one for each.
pub fn kernel(entry: &str) -> &'static Kernel {
    let found = KERNELS.iter().find(|k| k.name == entry);
    found.unwrap_or_else(|| panic!("no kernel `{entry}`"))
}

fn crosses(programs: &[stages::StageProgram], buffer: Buffer, heap: Heap) -> bool {
    let mut found = false;
    for program in programs {
        walk(program.ops, Runner::Device, 1, &mut |op| {
            found |= match op {
                stages::StageOp::Upload(b) => heap == Heap::Upload && b == buffer,
                stages::StageOp::ReadBack(b) => heap == Heap::Readback && b == buffer,
                _ => false,
            }
        });
    }
    found
}
