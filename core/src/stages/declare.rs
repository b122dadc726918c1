//! Buffers and stages, and the macros that declare them in [`super`].
//!
//! The declaration there is the only one: the slices the scalar backend works on, the bytes of
//! `memory-layout.md`, the bindings and struct wrappers of the kernels, the device's schedule and
//! the names in every table of times come from it.

use super::{Buffer, Storage};
use crate::params::Profile;
use crate::team::Workers;

/// An argument of a stage as the kernel binds it.
macro_rules! argument {
    (mut $($rest:ident)+) => { Argument { writes: true, ..argument!($($rest)+) } };
    (atomic $($rest:ident)+) => { Argument { view: View::Atomic, ..argument!($($rest)+) } };
    (quads $($rest:ident)+) => { Argument { view: View::Quads, ..argument!($($rest)+) } };
    (list $($rest:ident)+) => { Argument { is_list: true, ..argument!($($rest)+) } };
    ($name:ident is $buffer:ident) => {
        Argument { name: stringify!($name), ..argument!($buffer) }
    };
    ($buffer:ident) => {
        Argument {
            name: stringify!($buffer),
            buffer: Buffer::$buffer,
            view: View::Elements,
            writes: false,
            is_list: false,
        }
    };
}

/// An element of a buffer: as the twins see it, and as the kernels do.
pub trait BufferElement: Copy {
    /// Type of an array element in a kernel. Two 16-bit elements share a `u32`.
    const WGSL: &'static str;
    /// The element whose words are all `word`.
    fn splat(word: u32) -> Self;
}

macro_rules! elements {
    ($($rust:ty, $wgsl:literal, |$word:ident| $splat:expr;)*) => { $(
        impl BufferElement for $rust {
            const WGSL: &'static str = $wgsl;
            fn splat($word: u32) -> $rust {
                $splat
            }
        }
    )* };
}

elements! {
    u16, "u32", |word| word as u16;
    u32, "u32", |word| word;
    i32, "i32", |word| word as i32;
    [u32; 2], "vec2<u32>", |word| [word; 2];
    [i32; 4], "vec4<i32>", |word| [word as i32; 4];
}

/// One row of the table of buffers.
#[derive(Clone, Copy, Debug)]
pub struct BufferRow {
    /// Name, the same in the kernels and in the twins' arguments.
    pub name: &'static str,
    /// Type of an element in the twins.
    pub element: &'static str,
    /// Type of an element in the kernels.
    pub wgsl: &'static str,
    /// Bytes of an element in the twins.
    pub element_bytes: usize,
    /// Number of elements for a profile.
    pub count: fn(&Profile) -> usize,
    /// Name of the mapped buffer it is uploaded through, if it is.
    pub upload: &'static str,
    /// Name of the mapped buffer it is read back through, if it is.
    pub readback: &'static str,
    /// What it holds.
    pub doc: &'static str,
}

impl BufferRow {
    /// Bytes for a profile.
    pub fn bytes(&self, profile: &Profile) -> usize {
        self.element_bytes * (self.count)(profile)
    }
}

/// How a kernel sees a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// An array of the buffer's elements.
    Elements,
    /// Atomic words.
    Atomic,
    /// Words in groups of four.
    Quads,
}

/// A buffer as an argument of a stage.
#[derive(Clone, Copy, Debug)]
pub struct Argument {
    /// Name in the kernel and in the twin.
    pub name: &'static str,
    /// The buffer.
    pub buffer: Buffer,
    /// How the kernel sees it.
    pub view: View,
    /// Whether the stage writes it.
    pub writes: bool,
    /// Whether it is a list, whose length `counters` holds.
    pub is_list: bool,
}

/// A list whose length only the device knows: `counters` holds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum List {
    /// Distinct rays.
    Distinct,
    /// Foreground columns.
    Foreground,
}

/// Number of workgroups of a kernel.
#[derive(Clone, Copy, Debug)]
pub enum GroupCount {
    /// One.
    One,
    /// One thread per item.
    Threads(fn(&Profile) -> usize),
    /// [`crate::params::TILE`] items per workgroup.
    Tiles(fn(&Profile) -> usize),
    /// One thread per entry of a list.
    ThreadPer(List),
    /// One workgroup per foreground column.
    GroupPerColumn,
}

/// A stage: a twin, and the kernels that together do the same on a device.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Name, also in every table of times.
    pub name: &'static str,
    /// Entry points in order, all with the stage's arguments.
    pub kernels: &'static [(&'static str, GroupCount)],
    /// The kernels for devices that are CPUs, if those need different ones: barriers are expensive
    /// there, and both sides of a branch are executed. Empty otherwise.
    pub on_cpus: &'static [(&'static str, GroupCount)],
    /// Arguments of the twin.
    pub arguments: &'static [Argument],
    /// What the scalar backend runs. Twins that benefit from wider instructions are inlined, to use
    /// them.
    pub scalar: fn(&mut Storage, &dyn Workers),
}

impl Stage {
    /// The kernels for devices of either kind.
    pub fn all_kernels(&self) -> impl Iterator<Item = &'static (&'static str, GroupCount)> {
        self.kernels.iter().chain(self.on_cpus)
    }

    /// The kernels for devices that are CPUs.
    pub fn kernels_on_cpus(&'static self) -> &'static [(&'static str, GroupCount)] {
        if self.on_cpus.is_empty() { self.kernels } else { self.on_cpus }
    }

    /// What the kernels bind, in order: the arguments, and `counters` after a list if threads have
    /// to know its length.
    pub fn bindings(&self) -> impl Iterator<Item = Argument> {
        let by_group = |(_, groups): &(_, GroupCount)| matches!(groups, GroupCount::GroupPerColumn);
        let counted = !self.all_kernels().all(by_group);
        let of =
            move |a: &Argument| [Some(*a), (a.is_list && counted).then_some(argument!(counters))];
        self.arguments.iter().flat_map(of).flatten()
    }
}

/// Declares the table of buffers: [`Buffer`], [`BUFFERS`](super::BUFFERS) and [`Storage`].
macro_rules! buffers {
    (
        uniform $uniform:ident: $record:ty, $uniform_doc:literal;
        $( $name:ident: $element:ty [$count:expr] $doc:literal; )*
    ) => {
        /// Buffers by their names in the kernels.
        #[allow(non_camel_case_types)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Buffer {
            #[doc = $uniform_doc]
            $uniform,
            $( #[doc = $doc] $name ),*
        }

        impl Buffer {
            /// All of them, in order.
            pub const ALL: &[Buffer] = &[Buffer::$uniform, $( Buffer::$name ),*];

            /// The row of this buffer.
            pub fn row(self) -> &'static BufferRow {
                &BUFFERS[self as usize]
            }
        }

        /// The table of buffers, in the order of [`Buffer`].
        pub const BUFFERS: &[BufferRow] = &[
            BufferRow {
                name: stringify!($uniform),
                element: stringify!($record),
                wgsl: stringify!($record),
                element_bytes: 4 * <$record>::WORDS,
                count: |_| 1,
                upload: concat!(stringify!($uniform), "_in"),
                readback: concat!(stringify!($uniform), "_out"),
                doc: $uniform_doc,
            },
            $( BufferRow {
                name: stringify!($name),
                element: stringify!($element),
                wgsl: <$element as BufferElement>::WGSL,
                element_bytes: size_of::<$element>(),
                count: $count,
                upload: concat!(stringify!($name), "_in"),
                readback: concat!(stringify!($name), "_out"),
                doc: $doc,
            } ),*
        ];

        /// The buffers as the twins see them: slices of memory that the caller owns.
        pub struct Storage<'a> {
            #[doc = $uniform_doc]
            pub $uniform: $record,
            $( #[doc = $doc] pub $name: &'a mut [$element] ),*
        }

        impl<'a> Storage<'a> {
            /// Divides up `words`, of which there must be [`Storage::words`]. Buffers that the
            /// programs do not need are empty.
            pub fn over(
                words: &'a mut [u32],
                programs: &[StageProgram],
                profile: &Profile,
            ) -> Storage<'a> {
                assert!(words.len() == Storage::words(programs, profile));
                let mut rest = words;
                let mut cut = |buffer: Buffer| {
                    let words = words_of(buffer, programs, profile);
                    let (first, others) = core::mem::take(&mut rest).split_at_mut(words);
                    rest = others;
                    first
                };
                Storage {
                    $uniform: <$record>::default(),
                    $( $name: bytemuck::cast_slice_mut(cut(Buffer::$name)) ),*
                }
            }

            /// Sets every word of a buffer.
            pub fn fill(&mut self, buffer: Buffer, word: u32) {
                match buffer {
                    Buffer::$uniform => {}
                    $( Buffer::$name => self.$name.fill(BufferElement::splat(word)) ),*
                }
            }
        }
    };
}

/// A stage: `stage!(NAME in MODULE, (ARGUMENTS), GROUPS)`. Its twin is the function of that name in
/// the module, its kernel the entry point of that name. An argument is
/// `[mut] [atomic|quads] BUFFER`, `[mut] NAME is BUFFER` if the stage serves several buffers, or
/// `list BUFFER` if `counters` holds its number of elements. `scalar: FUNCTION` names what the
/// scalar backend runs instead of the twin on the whole [`Storage`], `on_cpus: (ENTRY, GROUPS)`
/// after it the kernel for devices that are CPUs, `[ENTRY: GROUPS, ..]` the entry points if there
/// are several.
macro_rules! stage {
    (
        $name:ident in $($seg:ident)::+, $args:tt, scalar: $fast:path, $groups:expr
        $(, on_cpus: ($kernel:ident, $cpu_groups:expr))?
    ) => {
        stage!(@@ $name, $args, [($name, $groups)], [$(($kernel, $cpu_groups))?], $fast)
    };
    ($name:ident in $($seg:ident)::+, $args:tt, [$($kernel:ident: $groups:expr),*]) => {
        stage!(@ $name, $args, [$(($kernel, $groups)),*], $($seg)::+::$name)
    };
    ($name:ident in $($seg:ident)::+, $args:tt, $groups:expr) => {
        stage!(@ $name, $args, [($name, $groups)], $($seg)::+::$name)
    };
    (device $name:ident, $args:tt, $groups:expr) => {
        stage!(@@ $name, $args, [($name, $groups)], [], |_, _| ())
    };
    (@ $name:ident, ($($($a:ident)+),*), $kernels:tt, $twin:path) => {
        stage!(@@ $name, ($($($a)+),*), $kernels, [], |storage, workers| {
            workers.simd().run(
                #[inline(always)]
                |_| $twin($(passed!(storage, $($a)+)),*),
            )
        })
    };
    (
        @@ $name:ident, ($($($a:ident)+),*), [$(($kernel:ident, $groups:expr)),*],
        [$(($on_cpu:ident, $on_cpu_groups:expr)),*], $scalar:expr
    ) => {
        &Stage {
            name: stringify!($name),
            kernels: &[$((stringify!($kernel), $groups)),*],
            on_cpus: &[$((stringify!($on_cpu), $on_cpu_groups)),*],
            arguments: &[$(argument!($($a)+)),*],
            scalar: $scalar,
        }
    };
}

/// An argument of a stage as the twin takes it.
macro_rules! passed {
    ($s:ident, mut atomic $($rest:ident)+) => { passed!($s, mut $($rest)+) };
    ($s:ident, mut quads $($rest:ident)+) => { passed!($s, mut $($rest)+) };
    ($s:ident, atomic $($rest:ident)+) => { passed!($s, $($rest)+) };
    ($s:ident, quads $($rest:ident)+) => { passed!($s, $($rest)+) };
    ($s:ident, list distinct) => { &$s.distinct[..$s.counters[DISTINCT_COUNT] as usize] };
    ($s:ident, list foreground) => { &$s.foreground[..$s.counters[FOREGROUND_COUNT] as usize] };
    ($s:ident, mut $name:ident is $buffer:ident) => { &mut $s.$buffer };
    ($s:ident, $name:ident is $buffer:ident) => { &$s.$buffer };
    ($s:ident, mut $buffer:ident) => { &mut $s.$buffer };
    ($s:ident, $buffer:ident) => { &$s.$buffer };
}

/// Constants that the kernels see under the same names.
macro_rules! constants {
    ($($name:ident),* ; $($signed:ident),*) => {
        /// Name, value and whether it is an `i32` in the kernels.
        pub const CONSTANTS: &[(&str, i64, bool)] = &[
            $( (stringify!($name), $name as i64, false), )*
            $( (stringify!($signed), $signed as i64, true), )*
        ];
    };
}

pub(super) use {argument, buffers, constants, passed, stage};
