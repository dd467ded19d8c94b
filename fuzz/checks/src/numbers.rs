//! Numbers that a fuzzer finds quickly: usual ones, those at the borders of their range, and any
//! bits.

use arbitrary::{Arbitrary, Unstructured};

/// Values at borders, of which each has broken some numerical program.
const SPECIAL: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    1e-12,
    1e12,
    1e150,
    1e-150,
    1e300,
];

/// A number of any bits, more often one of a usual magnitude.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number(pub(crate) f64);

impl<'a> Arbitrary<'a> for Number {
    fn arbitrary(bytes: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let kind: u8 = bytes.arbitrary()?;
        Ok(Self(match kind {
            0..16 => SPECIAL[usize::from(kind)],
            16..32 => bytes.arbitrary()?,
            32..64 => f64::from(bytes.arbitrary::<f32>()?),
            _ => f64::from(bytes.arbitrary::<i16>()?) / 1000.0,
        }))
    }

    fn size_hint(_: usize) -> (usize, Option<usize>) {
        (1, Some(9))
    }
}

/// Returns the values of numbers.
#[must_use]
pub(crate) fn numbers(all: &[Number]) -> Vec<f64> {
    all.iter().map(|number| number.0).collect()
}
