//! How options are declared: each once, as a field with its documentation, its values and its
//! range.
//!
//! The macro [`options`] writes a struct whose fields are options. From the same declaration follow
//! the table of options, which other interfaces read ([`Declaration`]), the reading of values that
//! are given by name, and the check of their ranges.

mod value;

use serde::{Deserialize, Deserializer, Serialize};
use tactid_identify::{IdentifyError, Range};

pub use value::Value;

/// Where an option can apply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Use {
    /// Identification from a log.
    Log,
    /// Identification from the topics of a robot that runs.
    Live,
    /// Identification from arrays.
    Arrays,
    /// Compensation of a recording.
    Compensation,
    /// Identification from poses at rest.
    Poses,
    /// Online least squares.
    Online,
    /// The paper's filter, online.
    #[serde(rename = "paper filter")]
    PaperFilter,
    /// Calibration of an arm.
    Calibration,
    /// Design of a motion.
    Design,
}

/// Type of the values of an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A truth value.
    Flag,
    /// A truth value that is true unless another one is given.
    Switch,
    /// A number.
    Number,
    /// An angle, rad, that people write in degrees.
    Degrees,
    /// A fraction that people write as a percentage.
    Percentage,
    /// The standard deviation of gains, a fraction that people write as a percentage.
    GainPercentage,
    /// A whole number that is not negative.
    Count,
    /// A text.
    Text,
    /// A text, or several.
    Texts,
    /// Path of a file or of a folder.
    Path,
    /// Recordings: paths of files or of folders, or arrays.
    Recordings,
    /// One of some names.
    Choice(&'static [&'static str]),
    /// Names with other names: a map.
    Names,
    /// Three numbers.
    Vector,
    /// Gravity: three numbers, or a word.
    Gravity,
    /// One number for all, or one for each.
    Numbers,
    /// A position for each joint, or positions by the names of joints.
    Posture,
    /// A number for each of some recordings.
    EachNumber,
    /// A point for all of some recordings, or for each.
    EachPoint,
    /// An inertia for all of some recordings, or for each.
    EachInertia,
    /// As [`Numbers`](Self::Numbers), fractions that people write as percentages.
    Fractions,
    /// Three forces and three moments.
    Wrench,
    /// Three forces and three moments for all sensors, or for each.
    Wrenches,
    /// Two points: the corners of a box.
    Box,
    /// Boxes by their names.
    Boxes,
    /// A grip of two pads.
    Grip,
    /// A body: its mass, centre of mass, and inertia about it.
    Body,
    /// A body of which the inertia may be missing: its mass and centre of mass, and inertia about
    /// it.
    Payload,
    /// A known tool: a body, or the result of an identification.
    Tool,
    /// A link, then three coordinates and a quaternion.
    Frame,
    /// Three coordinates and a quaternion.
    Pose,
    /// Calibration of an arm, or the path of its file.
    Calibration,
}

/// Measurements that an option is about: it has no effect where they are not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// Wrenches of sensors.
    Wrenches,
    /// Efforts of joints.
    Efforts,
}

/// Declaration of an option. A text is empty where there is nothing to say.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Declaration {
    /// Name of the option: of the field, of the keyword and, with hyphens, of the flag.
    pub name: &'static str,
    /// What the option is, in complete sentences.
    pub text: &'static str,
    /// Type of its values.
    pub kind: Kind,
    /// Heading under which it is listed.
    pub group: &'static str,
    /// Where it applies.
    pub uses: &'static [Use],
    /// Unit of its numbers.
    pub unit: &'static str,
    /// What holds where the option is not given.
    pub default: &'static str,
    /// Placeholder of the value on a command line, where that of its kind says less.
    pub placeholder: &'static str,
    /// What only Python has, in complete sentences.
    pub python: &'static str,
    /// Range of each of its numbers.
    #[serde(skip)]
    pub range: Range,
    /// Measurements without which it has no effect.
    #[serde(skip)]
    pub about: Option<About>,
}

impl Declaration {
    /// A declaration without anything that is optional.
    pub const NONE: Self = Self {
        name: "",
        text: "",
        kind: Kind::Flag,
        group: "",
        uses: &[],
        unit: "",
        default: "",
        placeholder: "",
        python: "",
        range: Range::ANY,
        about: None,
    };
}

/// An option that is given, with what its checks need of the value.
pub struct Given {
    /// The declaration of the option.
    pub option: &'static Declaration,
    numbers: Vec<f64>,
    /// Whether the value asks for something else than what holds without it.
    pub is_effective: bool,
}

impl Given {
    /// Returns an option with its value.
    pub fn new<T: Value>(option: &'static Declaration, value: &T) -> Self {
        Self {
            option,
            numbers: value.numbers(),
            is_effective: value.is_effective(),
        }
    }

    /// Checks that each number is in the range of the option.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] with the first that is not.
    pub fn check(&self) -> Result<(), IdentifyError> {
        self.option.range.check(self.option.name, &self.numbers)
    }
}

/// Reads the value of a field of [`options`].
///
/// # Errors
/// Returns the error of a value that is none of the type.
pub fn read_value<'de, D: Deserializer<'de>, T: Value>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    struct Read<T>(T);
    impl<'de, T: Value> Deserialize<'de> for Read<T> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            T::read(deserializer).map(Self)
        }
    }
    let read = Option::<Read<T>>::deserialize(deserializer)?;
    Ok(read.map(|read| read.0))
}

/// Writes a struct whose fields are options, each `Option<T>` of a [`Value`].
///
/// The documentation of a field is that of the option, for all readers. Its attribute has the group
/// and the uses, and then, as far as there is something to say, in this order: `unit`, `default`,
/// `placeholder`, `kind` (that of the type, unless given), `range`, `about`, and `python`, what
/// only Python has.
#[macro_export]
macro_rules! options {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                #[option(
                    $group:expr, $uses:expr
                    $(, unit = $unit:literal)?
                    $(, default = $default:literal)?
                    $(, placeholder = $placeholder:literal)?
                    $(, kind = $kind:expr)?
                    $(, range = $range:expr)?
                    $(, about = $about:expr)?
                    $(, python = $python:literal)?
                )]
                pub $field:ident: Option<$type:ty>,
            )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])+
                $(#[doc = concat!(" Unit: ", $unit, ".")])?
                $(#[doc = concat!(" Default: ", $default, ".")])?
                #[serde(deserialize_with = "tactid_options::read_value")]
                pub $field: Option<$type>,
            )+
        }

        impl $name {
            /// Declarations of all options, in the order in which they are documented.
            pub const OPTIONS: &'static [$crate::Declaration] = &[
                $($crate::Declaration {
                    name: stringify!($field),
                    text: concat!($($doc),+).trim_ascii(),
                    kind: $crate::options!(@kind $type $(, $kind)?),
                    group: $group,
                    uses: $uses,
                    $(unit: $unit,)?
                    $(default: $default,)?
                    $(placeholder: $placeholder,)?
                    $(range: $range,)?
                    $(about: Some($about),)?
                    $(python: $python,)?
                    ..$crate::Declaration::NONE
                },)+
            ];

            /// Returns the options that are given, in the order of their declarations.
            pub(crate) fn given(&self) -> impl Iterator<Item = $crate::Given> {
                let mut options = Self::OPTIONS.iter();
                let given = [$(
                    options
                        .next()
                        .zip(self.$field.as_ref())
                        .map(|(option, value)| $crate::Given::new(option, value)),
                )+];
                given.into_iter().flatten()
            }

            /// Returns the options that apply to a use; the others are not given.
            #[must_use]
            pub fn limited_to(&self, to: $crate::Use) -> Self {
                let applies = |name: &str| {
                    let mut options = Self::OPTIONS.iter();
                    options.any(|option| option.name == name && option.uses.contains(&to))
                };
                Self {
                    $($field: self.$field.clone().filter(|_| applies(stringify!($field))),)+
                }
            }
        }
    };
    (@kind $type:ty) => { <$type as $crate::Value>::KIND };
    (@kind $type:ty, $kind:expr) => { $kind };
}
