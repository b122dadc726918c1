//! Runs individual kernels over buffers that the host fills and reads.

use raywake_core::record::SweepUniform;
use raywake_gpu::{Buffer, Executor, Groups, Heap, Kernel, Op, Options, Program};

use crate::{difference, vulkan};

/// Buffers by the names that kernels use, and dispatches over them.
#[derive(Default)]
pub struct Bench {
    names: Vec<&'static str>,
    contents: Vec<Vec<u32>>,
    dispatches: Vec<(&'static Kernel, u32, &'static [Bound])>,
}

/// A variable of a kernel and the buffer bound to it.
pub type Bound = (&'static str, &'static str);

/// The buffers after a run.
pub struct Outcome {
    before: Bench,
    after: Vec<Vec<u32>>,
}

impl Bench {
    /// Empty, or with the record `sweep`.
    pub fn new(step: Option<&SweepUniform>) -> Bench {
        let mut words = vec![0; SweepUniform::WORDS];
        match step {
            None => Bench::default(),
            Some(step) => {
                step.write(&mut words);
                Bench::default().buffer("sweep", words)
            }
        }
    }

    /// Adds a buffer with its content. A buffer has at least one word.
    pub fn buffer(mut self, name: &'static str, mut words: Vec<u32>) -> Bench {
        if words.is_empty() {
            words.push(0);
        }
        self.names.push(name);
        self.contents.push(words);
        self
    }

    /// Adds a dispatch with one invocation per item.
    pub fn threads(self, kernel: &'static Kernel, items: usize) -> Bench {
        let groups = items.div_ceil(kernel.workgroup[0] as usize);
        self.groups(kernel, groups)
    }

    /// Adds a dispatch of this many workgroups.
    pub fn groups(self, kernel: &'static Kernel, groups: usize) -> Bench {
        self.bound(kernel, groups, &[])
    }

    /// Adds a dispatch of this many workgroups in which variables are bound to buffers of other
    /// names.
    pub fn bound(
        mut self,
        kernel: &'static Kernel,
        groups: usize,
        names: &'static [Bound],
    ) -> Bench {
        self.dispatches.push((kernel, groups as u32, names));
        self
    }

    /// Runs everything. Returns `None` if there is no device.
    pub fn run(self) -> Option<Outcome> {
        self.run_on(&Options::default())
    }

    /// Runs everything on a device; under the validation layer, there must be no message.
    pub fn run_on(self, options: &Options) -> Option<Outcome> {
        let mut executor =
            vulkan::expect(Executor::new(options, &self.table(), &[self.program()]))?;
        let count = self.names.len();
        for (n, words) in self.contents.iter().enumerate() {
            executor.upload(n).expect("nothing has run").copy_from_slice(words);
        }
        executor.run(0).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(executor.message_texts(), [""; 0]);
        let after = (0..count).map(|n| executor.readback(2 * count + n).to_vec()).collect();
        Some(Outcome { before: self, after })
    }

    /// The upload, then the device, then the readback part of every buffer.
    fn table(&self) -> Vec<Buffer> {
        let heaps = [Heap::Upload, Heap::Device, Heap::Readback];
        let rows = heaps.into_iter().flat_map(|heap| {
            self.names.iter().zip(&self.contents).map(move |(name, words)| Buffer {
                name,
                heap,
                bytes: 4 * words.len() as u64,
            })
        });
        rows.collect()
    }

    fn program(&self) -> Program {
        let count = self.names.len();
        let mut ops: Vec<Op> = (0..count).map(|n| Op::Copy { from: n, to: count + n }).collect();
        ops.extend(self.dispatches.iter().map(|(kernel, groups, names)| {
            let buffer =
                |variable| names.iter().find(|n| n.0 == variable).map_or(variable, |n| n.1);
            Op::Dispatch {
                name: kernel.name,
                kernel,
                buffers: kernel
                    .bindings
                    .iter()
                    .map(|b| count + self.index(buffer(b.name)))
                    .collect(),
                groups: Groups::Fixed([*groups, 1, 1]),
            }
        }));
        ops.extend((0..count).map(|n| Op::Copy { from: count + n, to: 2 * count + n }));
        Program { name: "bench", ops }
    }

    fn index(&self, name: &str) -> usize {
        let found = self.names.iter().position(|n| *n == name);
        found.unwrap_or_else(|| panic!("no buffer `{name}`"))
    }
}

impl Outcome {
    /// Words of a buffer.
    pub fn words(&self, name: &str) -> &[u32] {
        &self.after[self.before.index(name)]
    }

    /// Checks that the named buffers hold what is expected, and all others what they held before.
    #[track_caller]
    pub fn check(&self, case: &str, expected: &[(&str, &[u32])]) {
        for (n, name) in self.before.names.iter().enumerate() {
            let given = expected.iter().find(|e| e.0 == *name);
            let wanted = given.map_or(&self.before.contents[n][..], |e| e.1);
            if let Some(what) = difference(&self.after[n], wanted) {
                panic!("{case}, `{name}`: {what}");
            }
        }
    }
}
