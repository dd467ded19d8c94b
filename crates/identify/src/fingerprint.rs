//! Number that identifies data which are stored and compared later.

/// Offset basis and prime of FNV-1a with 64 bits (Fowler, Noll, Vo).
const FNV: [u64; 2] = [0xcbf2_9ce4_8422_2325, 0x0100_0000_01b3];

/// Returns a number that is the same for the same `words` on every machine and in every version, and almost surely another one
/// for others. It protects against chance, not against intent.
#[must_use]
pub fn fingerprint(words: impl IntoIterator<Item = u64>) -> u64 {
    let [basis, prime] = FNV;
    let words = words.into_iter();
    words.fold(basis, |hash, word| {
        let bytes = word.to_le_bytes().into_iter();
        bytes.fold(hash, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(prime)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::fingerprint;

    /// The published value for the bytes of "foobar", padded with zeros to a word, is computed by the definition.
    #[test]
    fn a_fingerprint_is_fnv_1a() {
        assert_eq!(fingerprint([]), 0xcbf2_9ce4_8422_2325);
        let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
        for byte in *b"foobar\0\0" {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        assert_eq!(fingerprint([u64::from_le_bytes(*b"foobar\0\0")]), hash);
        assert_ne!(fingerprint([0]), fingerprint([0, 0]));
    }
}
