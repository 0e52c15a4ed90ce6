//! Randomness by name: one independent stream for each (seed, name), so that adding a fault never shifts another's draws.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// The randomness of a run. There is no default seed.
#[derive(Debug, Clone, Copy)]
pub struct Streams {
    seed: u64,
}

impl Streams {
    /// Streams of this seed.
    pub fn new(seed: u64) -> Self {
        Streams { seed }
    }

    /// The stream with this name, from its beginning.
    pub fn named(&self, name: &str) -> Stream {
        let mut key = [0_u8; 32];
        let mut word = fnv1a(self.seed.to_le_bytes().iter().chain(name.as_bytes()));
        for chunk in key.chunks_exact_mut(8) {
            word = splitmix(word);
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        Stream { generator: ChaCha8Rng::from_seed(key), spare: None }
    }
}

/// FNV-1a over bytes: only spreads names over keys, never a checksum.
fn fnv1a<'a>(bytes: impl Iterator<Item = &'a u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn splitmix(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

/// One named stream of random numbers.
#[derive(Debug, Clone)]
pub struct Stream {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl Stream {
    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Standard normal, by the polar method; libm's logarithm keeps it the same on every machine.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let u = 2.0 * self.uniform() - 1.0;
            let v = 2.0 * self.uniform() - 1.0;
            let radius2 = u * u + v * v;
            if radius2 > 0.0 && radius2 < 1.0 {
                let factor = libm::sqrt(-2.0 * libm::log(radius2) / radius2);
                self.spare = Some(v * factor);
                return u * factor;
            }
        }
    }
}
