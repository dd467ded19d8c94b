//! Where the options of a request apply, by what they are about.

use tactid_options::Use;

pub(crate) const LOG: &[Use] = &[Use::Log, Use::Live, Use::Compensation];
pub(crate) const MODEL: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Poses,
    Use::Calibration,
];
pub(crate) const WRENCHES: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Poses,
    Use::Online,
];
pub(crate) const TOOL: &[Use] = &[Use::Log, Use::Live, Use::Arrays, Use::Poses, Use::Online];
pub(crate) const OFFSET: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Poses,
    Use::Online,
    Use::Design,
];
pub(crate) const FRAME: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Poses,
    Use::Online,
    Use::PaperFilter,
    Use::Calibration,
    Use::Design,
];
pub(crate) const LOGS: &[Use] = &[Use::Log, Use::Live, Use::Compensation, Use::Calibration];
pub(crate) const RECORDING: &[Use] = &[Use::Log, Use::Arrays];
pub(crate) const SHAPE: &[Use] = &[Use::Log, Use::Arrays, Use::Poses];
pub(crate) const DELAY: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Online,
];
pub(crate) const EFFORTS: &[Use] = &[Use::Log, Use::Live, Use::Arrays, Use::Calibration];
pub(crate) const LEAST_SQUARES: &[Use] =
    &[Use::Log, Use::Live, Use::Arrays, Use::Online, Use::Design];
pub(crate) const METHODS: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Online,
    Use::PaperFilter,
    Use::Design,
];
pub(crate) const SAMPLES: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Online,
    Use::PaperFilter,
];
pub(crate) const WEIGHT: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Poses,
    Use::Online,
    Use::PaperFilter,
];
pub(crate) const EFFORT_CONTENT: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Online,
    Use::PaperFilter,
];
pub(crate) const PAPER: &[Use] = &[Use::Log, Use::Arrays, Use::PaperFilter];
pub(crate) const STREAM: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Online,
    Use::PaperFilter,
    Use::Calibration,
];
pub(crate) const ALL: &[Use] = &[
    Use::Log,
    Use::Live,
    Use::Arrays,
    Use::Compensation,
    Use::Online,
    Use::PaperFilter,
    Use::Calibration,
    Use::Design,
];
