//! Numbers that identify recordings, calibrations and tools by their content.

/// Offset basis and prime of the hash of Fowler, Noll and Vo with 64 bits,
/// <http://www.isthe.com/chongo/tech/comp/fnv/>.
const FNV: [u64; 2] = [0xcbf2_9ce4_8422_2325, 0x0100_0000_01b3];

/// Returns a hash of some numbers, the same on every machine and in every version. It takes words
/// instead of the bytes of Fowler, Noll and Vo, and so folds the upper half into the lower one:
/// products alone never carry the sign of a number to other bits.
#[must_use]
pub fn fingerprint(numbers: impl IntoIterator<Item = u64>) -> u64 {
    let [basis, prime] = FNV;
    numbers.into_iter().fold(basis, |hash, number| {
        let product = (hash ^ number).wrapping_mul(prime);
        product ^ (product >> 32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Negated numbers differ in their first bits only, and make another hash.
    #[test]
    fn signs_matter() {
        let of = |numbers: [f64; 2]| fingerprint(numbers.into_iter().map(f64::to_bits));
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
