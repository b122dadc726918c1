//! Every hand-chosen number: its name, its unit, its range, its default and the reason for that,
//! declared once.
//!
//! [`params!`](crate::params!) turns a declaration into a struct, its default and a table of the
//! declared parameters. The table serves the keys of a configuration file, `--set name=value` and
//! `PARAMETERS.md`. [`ceilings`] holds the numbers that size storage and therefore cannot be set.

mod assignment;
mod ceilings;
mod moves;
mod profile;
mod refinement;
mod tracklet;

pub use assignment::{AssignError, ParameterSetting};
pub use ceilings::*;
pub use moves::MovesParams;
pub use profile::{Frame, Profile};
pub use refinement::{GroundParams, RefinementParams};
pub use tracklet::{Birth, CHI2_99_2DOF, TrackletParams};

use core::fmt;

/// Why a set of parameters cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileError {
    /// The offending parameter.
    pub field: &'static str,
    /// What it must be.
    pub requirement: &'static str,
}

/// The declaration of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its name, which ends in its unit if it has one; unique among all parameters.
    pub name: &'static str,
    /// Its unit, or what it counts; empty for a ratio.
    pub unit: &'static str,
    /// Values it may have.
    pub bounds: Bounds,
    /// What it means.
    pub doc: &'static str,
    /// Where its default comes from.
    pub why: &'static str,
}

/// Values a parameter may have. Only numbers are bounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Minimum, or the limit that every value must exceed.
    pub from: f64,
    /// Whether `from` itself is excluded.
    pub above: bool,
    /// Maximum.
    pub to: f64,
    /// Whether 0 is also allowed.
    pub or_zero: bool,
    /// The same in words.
    pub text: &'static str,
}

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// Double precision; sets a number of any type.
    Number(f64),
    /// Single precision.
    Single(f32),
    /// A count.
    Whole(u64),
    /// Yes or no.
    Flag(bool),
    /// One of a set of names.
    Word(&'a str),
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Number(v) => v.fmt(f),
            Value::Single(v) => v.fmt(f),
            Value::Whole(v) => v.fmt(f),
            Value::Flag(v) => v.fmt(f),
            Value::Word(v) => v.fmt(f),
        }
    }
}

impl Bounds {
    /// Whether a value lies within the bounds; NaN never does.
    pub fn hold(&self, value: Value) -> bool {
        // Single precision is compared as such: 0.7 is not less than 0.7.
        let (v, from, to) = match value {
            Value::Number(v) => (v, self.from, self.to),
            Value::Single(v) => (v as f64, self.from as f32 as f64, self.to as f32 as f64),
            Value::Whole(v) => (v as f64, self.from, self.to),
            Value::Flag(_) | Value::Word(_) => return true,
        };
        let enough = if self.above { v > from } else { v >= from };
        enough && v <= to || self.or_zero && v == 0.0
    }
}

/// A type a parameter may have.
pub trait Kind: Copy {
    /// What a value of this type must be, in words.
    const REQUIREMENT: &'static str;

    /// Converts to a [`Value`].
    fn value(self) -> Value<'static>;

    /// Converts from a [`Value`], if it is of this type.
    fn of(value: Value) -> Option<Self>;
}

macro_rules! kinds {
    ($($kind:ty, $requirement:literal, $given:pat => $of:expr, $own:ident => $value:expr;)*) => {$(
        impl Kind for $kind {
            const REQUIREMENT: &'static str = $requirement;

            fn value(self) -> Value<'static> {
                let $own = self;
                $value
            }

            fn of(value: Value) -> Option<Self> {
                match value {
                    $given => $of,
                    _ => None,
                }
            }
        }
    )*};
}

kinds! {
    f64, "a number", Value::Number(v) => Some(v), v => Value::Number(v);
    f32, "a number", Value::Number(v) => Some(v as f32), v => Value::Single(v);
    u32, "a whole number, not negative", Value::Number(v) => whole(v), v => Value::Whole(v as u64);
    usize, "a whole number, not negative", Value::Number(v) => whole(v).map(|v| v as usize),
        v => Value::Whole(v as u64);
    bool, "true or false", Value::Flag(v) => Some(v), v => Value::Flag(v);
}

fn whole(v: f64) -> Option<u32> {
    (v >= 0.0 && v <= u32::MAX as f64 && v == libm::floor(v)).then_some(v as u32)
}

/// A group of parameters, by name.
pub trait Parameters {
    /// The declared parameters, in order of declaration.
    fn declared(&self) -> &'static [Parameter];

    /// The value of a parameter.
    fn get(&self, name: &str) -> Option<Value<'static>>;

    /// Sets a parameter, checking only its type. The error says what the value must be.
    fn set(&mut self, name: &str, value: Value) -> Result<(), &'static str>;

    /// Whether every parameter lies within its bounds.
    fn within_bounds(&self) -> Result<(), ProfileError> {
        let outside = |p: &&Parameter| !self.get(p.name).is_none_or(|v| p.bounds.hold(v));
        match self.declared().iter().find(outside) {
            Some(p) => Err(ProfileError { field: p.name, requirement: p.bounds.text }),
            None => Ok(()),
        }
    }
}

/// Declares a group of parameters.
///
/// ```
/// raywake_core::params! {
///     /// Numbers of a search.
///     #[derive(Clone, Copy, Debug, PartialEq)]
///     pub struct SearchParams {
///         /// How far to search.
///         pub reach_m: f64 = 3.0, "m", (above 0 to 100), "Farther finds nothing more.";
///         /// Returns that are tried; 0: all.
///         pub returns: u32 = 12, "returns", (0 or 5 to 96);
///         /// Whether to search at all.
///         pub enabled: bool = true, "", (any);
///     }
/// }
/// use raywake_core::params::{Parameters, Value};
///
/// let mut search = SearchParams { returns: 6, ..SearchParams::DEFAULT };
/// assert_eq!(search.within_bounds(), Ok(()));
/// search.set("reach_m", Value::Number(-1.0)).unwrap();
/// assert_eq!(search.within_bounds().unwrap_err().requirement, "above 0, at most 100");
/// ```
///
/// Each line is a documented field: type, default, unit ("" for a ratio), range, and the reason for
/// the default; if there is none, it was not measured in isolation. Types are those that implement
/// [`Kind`]: numbers, `bool`, and some enums. A range is `(a to b)`, `(above a)`, `(above a to b)`,
/// `(0 or a to b)`, `(at least a)` or `(any)`. Fields that are not parameters, such as nested
/// groups, follow in a second block: `} and { pub name: Type = default; }`. `DEFAULT` is constant,
/// so presets can use `Group { field: value, ..Group::DEFAULT }`.
#[macro_export]
macro_rules! params {
    // The reason for a default.
    (@why) => { "Not measured in isolation." };
    (@why $why:expr) => { $why };
    // A range.
    (@bounds any) => {
        $crate::params!(@ f64::NEG_INFINITY, false, f64::INFINITY, false, "")
    };
    (@bounds above $from:literal to $to:literal) => {
        $crate::params!(@ $from as f64, true, $to as f64, false,
            concat!("above ", $from, ", at most ", $to))
    };
    // The limit when none is given is a million: squares of squares are finite.
    (@bounds above $from:literal) => {
        $crate::params!(@bounds above $from to 1e6)
    };
    (@bounds at least $from:literal) => {
        $crate::params!(@ $from as f64, false, f64::INFINITY, false, concat!("at least ", $from))
    };
    (@bounds 0 or $from:literal to $to:literal) => {
        $crate::params!(@ $from as f64, false, $to as f64, true,
            concat!("0, or ", $from, " to ", $to))
    };
    (@bounds $from:literal to $to:literal) => {
        $crate::params!(@ $from as f64, false, $to as f64, false, concat!($from, " to ", $to))
    };
    (@ $from:expr, $above:literal, $to:expr, $or_zero:literal, $text:expr) => {
        $crate::params::Bounds {
            from: $from, above: $above, to: $to, or_zero: $or_zero, text: $text,
        }
    };
    // A group.
    (
        $(#[doc = $title:literal])* $(#[derive($($derive:ident),*)])?
        $vis:vis struct $group:ident {$(
            $(#[doc = $doc:literal])*
            pub $name:ident: $kind:ty = $default:expr, $unit:literal, ($($bounds:tt)*)
                $(, $why:expr)?;
        )*} $(and {$(
            $(#[doc = $and_doc:literal])* pub $and:ident: $and_type:ty = $and_default:expr;
        )*})?
    ) => {
        $(#[doc = $title])* $(#[derive($($derive),*)])?
        $vis struct $group {
            $($(#[doc = $doc])* pub $name: $kind,)*
            $($($(#[doc = $and_doc])* pub $and: $and_type,)*)?
        }

        impl $group {
            /// The defaults.
            pub const DEFAULT: $group =
                $group { $($name: $default,)* $($($and: $and_default,)*)? };
        }

        impl $crate::params::Parameters for $group {
            fn declared(&self) -> &'static [$crate::params::Parameter] {
                &[$($crate::params::Parameter {
                    name: stringify!($name),
                    unit: $unit,
                    bounds: $crate::params!(@bounds $($bounds)*),
                    doc: concat!($($doc),*),
                    why: $crate::params!(@why $($why)?),
                }),*]
            }

            fn get(&self, name: &str) -> Option<$crate::params::Value<'static>> {
                match name {
                    $(stringify!($name) => Some($crate::params::Kind::value(self.$name)),)*
                    _ => None,
                }
            }

            fn set(
                &mut self,
                name: &str,
                value: $crate::params::Value,
            ) -> Result<(), &'static str> {
                match name {
                    $(stringify!($name) => {
                        let requirement = <$kind as $crate::params::Kind>::REQUIREMENT;
                        self.$name = $crate::params::Kind::of(value).ok_or(requirement)?;
                    })*
                    _ => return Err("the name of a parameter"),
                }
                Ok(())
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::params! {
        /// A group.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Some3 {
            /// One.
            pub single: f32 = 0.7, "m", (0.7 to 0.9);
            /// Two,
            /// in two lines.
            pub count: u32 = 0, "", (0 or 2 to 4), "Because.";
            /// Three.
            pub frame: Frame = Frame::Sensor, "", (any);
        } and {
            /// Not a parameter.
            pub other: u8 = 3;
        }
    }

    #[test]
    fn declarations_are_complete() {
        let mut p = Some3::DEFAULT;
        assert_eq!((p.within_bounds(), p.other), (Ok(()), 3));
        let [_, count, _] = p.declared() else { panic!("three") };
        assert_eq!((count.doc, count.why), (" Two, in two lines.", "Because."));
        assert_eq!(p.get("single"), Some(Value::Single(0.7)));
        assert_eq!(p.get("frame"), Some(Value::Word("sensor")));
        assert_eq!(p.set("single", Value::Number(0.9)), Ok(()));
        assert_eq!(p.within_bounds(), Ok(()));
        for (v, holds) in [(0.0, true), (1.0, false), (2.0, true), (5.0, false)] {
            assert_eq!(p.set("count", Value::Number(v)), Ok(()));
            assert_eq!(p.within_bounds().is_ok(), holds, "{v}");
        }
        for v in [-1.0, 0.5, 1e10, f64::NAN] {
            assert!(p.set("count", Value::Number(v)).unwrap_err().contains("whole"), "{v}");
        }
        assert!(p.set("frame", Value::Word("x")).unwrap_err().contains("lattice"));
        assert!(p.set("nosuch", Value::Flag(true)).is_err());
        p = Some3 { single: f32::NAN, ..Some3::DEFAULT };
        assert_eq!(
            p.within_bounds(),
            Err(ProfileError { field: "single", requirement: "0.7 to 0.9" })
        );
    }
}
