//! A fast hash of integer keys.

use std::hash::Hasher;

use crate::sample::mix;

/// Mixes the bits of a key. Far faster than the standard hash, which withstands maliciously chosen
/// keys.
#[derive(Default)]
pub(crate) struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(u64::from(byte)));
    }

    fn write_u64(&mut self, key: u64) {
        self.0 = mix(self.0 ^ key);
    }
}
