//! 64-bit digest of a serialised value.

use postcard::ser_flavors::Flavor;
use serde::Serialize;

/// Returns the digest of a value. Two values that differ in any serialised bit have different digests, except in one of
/// 2^64 cases. It detects errors, not forgery.
pub(crate) fn digest(value: &impl Serialize) -> u64 {
    // Every digested type can be serialised.
    postcard::serialize_with_flavor(value, Digest(0x9E37_79B9_7F4A_7C15)).unwrap_or(0)
}

/// Mixes 8-byte words in sequence; each word changes the effect of all later ones.
struct Digest(u64);

impl Digest {
    fn mix(&mut self, word: u64) {
        let mixed = (self.0 ^ word).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        self.0 = (mixed ^ (mixed >> 32)).rotate_left(17);
    }
}

impl Flavor for Digest {
    type Output = u64;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.mix(u64::from(byte));
        Ok(())
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        // Almost all fields are numbers of eight bytes.
        if let Ok(word) = bytes.try_into() {
            self.mix(u64::from_le_bytes(word));
        } else {
            bytes.iter().for_each(|byte| self.mix(u64::from(*byte)));
        }
        Ok(())
    }

    fn finalize(mut self) -> postcard::Result<u64> {
        self.mix(0);
        Ok(self.0)
    }
}
