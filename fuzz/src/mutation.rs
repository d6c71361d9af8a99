//! Inputs that differ little from inputs of a corpus.

/// Random numbers (SplitMix64) that depend only on a seed, a target and the number of an input.
pub struct Random(u64);

impl Random {
    /// Creates the generator for an input.
    pub fn new(seed: u64, target: &str, input: u64) -> Self {
        let name = target
            .bytes()
            .fold(0u64, |h, b| h.wrapping_mul(257) ^ u64::from(b));
        let mut random =
            Random(seed ^ name.rotate_left(32) ^ input.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Draws a number from 0 to `n` − 1; `n` must be above zero.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// Maximum length of an input, in bytes.
const MAX_INPUT_SIZE: usize = 1 << 20;
/// Integers that are likely to break sizes and offsets.
const NUMBERS: [u64; 14] = [
    0,
    1,
    2,
    3,
    7,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 40,
    u64::MAX,
];
/// Words that replace numbers in text.
const WORDS: [&str; 22] = [
    "0",
    "-1",
    "1",
    "2",
    "0.5",
    "-0.0",
    "1e-30",
    "1e30",
    "1e308",
    "nan",
    "inf",
    "65536",
    "4294967296",
    "999999999999999999999",
    "",
    ",",
    "<",
    "\"",
    "{",
    "[",
    "\n",
    "\u{1b}",
];

/// Returns an input of the corpus, changed in a few places.
pub fn mutated(corpus: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = random.of(corpus).clone();
    for _ in 0..1 + random.below(4) {
        change(&mut bytes, corpus, random);
    }
    bytes.truncate(MAX_INPUT_SIZE);
    bytes
}

fn change(bytes: &mut Vec<u8>, corpus: &[Vec<u8>], random: &mut Random) {
    if bytes.is_empty() {
        bytes.push(random.next() as u8);
    }
    let at = random.below(bytes.len());
    match random.below(9) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => number(bytes, at, random),
        3 => drop(bytes.drain(at..end(bytes, at, random))),
        4 => {
            let piece = bytes[at..end(bytes, at, random)].to_vec();
            let times = 1 + random.below(8);
            insert(bytes, at, &piece.repeat(times));
        }
        5 => {
            let other = random.of(corpus);
            let from = random.below(other.len().max(1)).min(other.len());
            let piece = other[from..end(other, from, random)].to_vec();
            insert(bytes, at, &piece);
        }
        6 => bytes.truncate(at),
        _ => word(bytes, at, random),
    }
}

/// Draws the end of a piece that begins at `at`; most pieces are short.
fn end(bytes: &[u8], at: usize, random: &mut Random) -> usize {
    let longest = *random.of(&[4, 16, 64, 1024]);
    bytes.len().min(at + 1 + random.below(longest))
}

fn insert(bytes: &mut Vec<u8>, at: usize, piece: &[u8]) {
    if bytes.len() + piece.len() <= MAX_INPUT_SIZE {
        bytes.splice(at..at, piece.iter().copied());
    }
}

/// Overwrites 2, 4 or 8 bytes by a number.
fn number(bytes: &mut [u8], at: usize, random: &mut Random) {
    let near = bytes.len() as u64;
    let value = match random.below(4) {
        0 => near.wrapping_add(random.below(5) as u64).wrapping_sub(2),
        1 => at as u64,
        _ => *random.of(&NUMBERS),
    };
    let size = *random.of(&[2, 4, 8]);
    let mut word = value.to_le_bytes();
    let word = &mut word[..size];
    if random.below(2) == 0 {
        word.reverse();
    }
    for (target, byte) in bytes[at..].iter_mut().zip(word) {
        *target = *byte;
    }
}

/// Replaces the number or name at a position of a text by a word.
fn word(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let is_part = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b'+' | b'_');
    let start = bytes[..at]
        .iter()
        .rposition(|b| !is_part(b))
        .map_or(0, |i| i + 1);
    let end = bytes[at..]
        .iter()
        .position(|b| !is_part(b))
        .map_or(bytes.len(), |i| at + i);
    if start < end {
        let word = random.of(&WORDS).bytes();
        bytes.splice(start..end, word);
    }
}
