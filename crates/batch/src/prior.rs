//! What is known of the payload besides the measurements.

use tactid_identify::{BoundingBox, IdentifyError, KnownMass};

/// What is known of the payload besides the measurements. By default nothing is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PriorKnowledge {
    /// Mass of the payload from a scale. It counts once, however many recordings there are.
    pub known_mass: Option<KnownMass>,
    /// A box in the frame of the estimate that contains the whole payload.
    pub bounding_box: Option<BoundingBox>,
}

impl PriorKnowledge {
    /// Checks that the values are in range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] if the mass is not positive, its standard deviation is
    /// negative, or the box has no volume.
    pub fn check(&self) -> Result<(), IdentifyError> {
        self.known_mass.map_or(Ok(()), |mass| mass.check())?;
        self.bounding_box
            .map_or(Ok(()), |given| given.check("bounding_box"))
    }
}
