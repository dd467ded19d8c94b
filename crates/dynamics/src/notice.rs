//! What is noticed about a robot's description, about data or about a result: how grave it is, and
//! what it says.

/// How grave a notice is, the gravest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The result is wrong.
    Contradicts,
    /// No precision is promised: the values may be off by more than their intervals, or there is no
    /// payload to be known.
    Doubts,
    /// The result is as good as it says.
    Notes,
}

impl Severity {
    /// Returns the name: `contradicts`, `doubts` or `notes`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Contradicts => "contradicts",
            Self::Doubts => "doubts",
            Self::Notes => "notes",
        }
    }
}

/// What a notice is about. Notices of the same severity are read in this order, because the first
/// ones may cause the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// Measurements that are wrong themselves.
    Measurements,
    /// An assumption about the robot, its sensors or its calibration.
    Assumption,
    /// The result.
    Result,
    /// What wrong measurements cause as well: the notice guesses at another cause, and is not shown
    /// beside one about [`Subject::Measurements`].
    Consequence,
}

/// Who reads a notice: it decides how options are spelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// A caller of a crate, who knows the fields of `Request`.
    Rust,
    /// A caller of `tactid.identify`, who knows keywords.
    Python,
    /// A user of the command `tactid`, who knows flags.
    CommandLine,
    /// A caller of `push` of `tactid.Identifier`, which has fewer options: what has none is done to
    /// the samples before.
    Online,
}

impl Reader {
    /// Returns a field of `Request` as the reader would write it.
    ///
    /// ```
    /// use tactid_dynamics::Reader;
    ///
    /// assert_eq!(Reader::CommandLine.option("wrench_offset"), "--wrench-offset");
    /// assert_eq!(Reader::Python.option("wrench_offset"), "`wrench_offset`");
    /// ```
    #[must_use]
    pub fn option(self, field: &str) -> String {
        match self {
            Self::CommandLine => format!("--{}", field.replace('_', "-")),
            Self::Rust | Self::Python | Self::Online => format!("`{field}`"),
        }
    }

    /// Returns a field of `Request` with a value as the reader would write both.
    ///
    /// ```
    /// use tactid_dynamics::Reader;
    ///
    /// assert_eq!(Reader::CommandLine.choice("gravity", "unknown"), "`--gravity unknown`");
    /// assert_eq!(Reader::Python.choice("gravity", "unknown"), "`gravity=\"unknown\"`");
    /// ```
    #[must_use]
    pub fn choice(self, field: &str, value: &str) -> String {
        match self {
            Self::CommandLine => format!("`{} {value}`", self.option(field)),
            Self::Python => format!("`{field}=\"{value}\"`"),
            Self::Rust | Self::Online => format!("`{field}` ({value})"),
        }
    }
}

/// Something that a reader of a result should know.
pub trait Notice {
    /// Returns how grave it is.
    fn severity(&self) -> Severity;

    /// Returns what it is about.
    fn subject(&self) -> Subject {
        Subject::Result
    }

    /// Says it in sentences, with options as the reader would write them.
    fn words(&self, reader: Reader) -> String;
}
