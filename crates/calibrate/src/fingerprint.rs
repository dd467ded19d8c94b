//! Numbers that identify recordings and calibrations by their content.

use super::recording::EffortRecording;

/// Offset basis and prime of the hash of Fowler, Noll and Vo with 64 bits,
/// <http://www.isthe.com/chongo/tech/comp/fnv/>.
const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

/// Returns a hash of some numbers, the same on every machine and in every version. It takes words
/// instead of the bytes of Fowler, Noll and Vo, and so folds the upper half into the lower one:
/// products alone never carry the sign of a number to other bits.
pub(crate) fn hash(numbers: impl Iterator<Item = u64>) -> u64 {
    numbers.fold(BASIS, |hash, number| {
        let product = (hash ^ number).wrapping_mul(PRIME);
        product ^ (product >> 32)
    })
}

impl EffortRecording {
    /// Returns a number that identifies the recording by its times, efforts and velocities, bit by
    /// bit. Recordings with different numbers differ; those with equal ones are the same but for a
    /// chance of 1 in 2⁶⁴.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        hash(self.numbers().map(f64::to_bits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Negated numbers differ in their first bits only, and make another hash.
    #[test]
    fn signs_matter() {
        let of = |numbers: [f64; 2]| hash(numbers.into_iter().map(f64::to_bits));
        let all = [
            [1.0, 2.0],
            [-1.0, -2.0],
            [-1.0, 2.0],
            [1.0, -2.0],
            [2.0, 1.0],
        ];
        for (k, numbers) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|other| of(*other) != of(*numbers)));
        }
    }
}
