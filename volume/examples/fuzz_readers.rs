//! Changes small valid files at random and reads them, for as long as wanted: no panic, and no
//! memory that the file does not justify.
//!
//! ```text
//! cargo run --release -p raywright-volume --example fuzz_readers -- --seconds 600 nrrd nifti raw view
//! ```
//!
//! Idea: mutation without feedback, since the formats are small enough that random changes of whole
//! files, of numbers and of pieces reach every branch; the time goes evenly over the readers. Each
//! case is a function of its number: `--from N` goes on at a case, which a panic or abort names.
//! The allocator counts: a case that takes more than [`MAX_BYTES`] fails. Twice that ends the
//! process, so that nothing worse can happen to the machine.

use std::{
    alloc::System,
    io::Read,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    process::ExitCode,
    time::{Duration, Instant},
};

use cap::Cap;
use raywright_volume::{
    View,
    load::{DataError, Endian, LoadError, LoadOptions, RawLayout, VoxelType, read_volume},
};

#[path = "../tests/files/mod.rs"]
mod files;

use files::{Files, seeds};

/// Memory that a case may take beyond what was there: 2^20 voxels of 4 bytes, twice while a vector
/// grows, and some for what is decoded and quoted.
const MAX_BYTES: usize = 16 << 20;
/// Voxels that a file may have.
const MAX_VOXELS: u64 = 1 << 20;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, 64 << 20);

const READERS: [&str; 4] = ["nrrd", "nifti", "raw", "view"];

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `limit`, or 0 if that is 0.
    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}

/// Texts that mean something to a reader of text.
const WORDS: [&str; 32] = [
    "-1",
    "0",
    "1",
    "2",
    "65536",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e-320",
    "none",
    "(1,0,0)",
    "(",
    ")",
    ",",
    "\n",
    "\n\n",
    "\r\n",
    ": ",
    ":=",
    "#",
    "raw",
    "gzip",
    "LIST",
    "%03d",
    "..",
    "double",
    "[",
    "null",
];

/// Numbers that mean something to a reader of bytes.
const NUMBERS: [u64; 14] = [
    0,
    1,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0x7fc0_0000,
    0x7f80_0000,
    u64::MAX,
    1 << 62,
];

/// One change.
fn change(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    let to = at + random.below(32).min(bytes.len() - at);
    match random.below(10) {
        0 | 1 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        2 => bytes
            .iter_mut()
            .skip(at)
            .take(1)
            .for_each(|b| *b = random.next() as u8),
        3 => drop(bytes.drain(at..to)),
        4 => {
            let piece = bytes[at..to].to_vec();
            let place = random.below(bytes.len() + 1);
            bytes.splice(place..place, piece);
        }
        5 => bytes.truncate(at),
        6 | 7 => {
            let word = random.pick(&WORDS).bytes();
            let end = if random.below(2) == 0 { at } else { to };
            bytes.splice(at..end, word);
        }
        8 => {
            let width = random.pick(&[1, 2, 4, 8]);
            let number = random.pick(&NUMBERS);
            let mut number = number.to_le_bytes()[..width].to_vec();
            if random.below(2) == 0 {
                number.reverse();
            }
            for (byte, new) in bytes.iter_mut().skip(at).zip(number) {
                *byte = new;
            }
        }
        _ => {
            let count = random.pick(&[1, 16, 300, 70_000]);
            let byte = random.pick(b"\0\xff a1");
            bytes.splice(at..at, std::iter::repeat_n(byte, count));
        }
    }
}

/// The files of a case, and which of them to load.
fn case(seeds: &[(Files, String)], number: u64) -> (Files, String) {
    let mut random = Random(number);
    let (mut files, name) = seeds[random.below(seeds.len())].clone();
    let names: Vec<String> = files.keys().cloned().collect();
    for _ in 0..=random.below(4) {
        let file = &names[random.below(names.len())];
        let Some(bytes) = files.get_mut(file) else {
            continue;
        };
        // A third of the changes goes below the compression.
        let mut inside = Vec::new();
        let zipped = bytes.starts_with(&[0x1f, 0x8b])
            && random.below(3) == 0
            && flate2::read::GzDecoder::new(&bytes[..])
                .take(1 << 20)
                .read_to_end(&mut inside)
                .is_ok();
        if zipped {
            change(&mut inside, &mut random);
            *bytes = files::gzip(&inside);
        } else {
            change(bytes, &mut random);
        }
    }
    (files, name)
}

/// Reads a case; whether it was accepted.
fn read(reader: &str, files: &Files, name: &str, number: u64) -> bool {
    if reader == "view" {
        return View::parse(&files[name], Path::new(name)).is_ok();
    }
    let mut random = Random(!number);
    let mut options = LoadOptions::default().with_max_voxels(MAX_VOXELS);
    if reader == "raw" && random.below(4) == 0 {
        let dims = [(); 3].map(|()| random.next() >> random.below(64));
        let raw = RawLayout::new(dims, random.pick(&VoxelType::ALL))
            .with_endian(random.pick(&[Endian::Little, Endian::Big]))
            .with_byte_skip(random.next() >> random.below(64))
            .with_scale(f64::from_bits(random.next()), f64::from_bits(random.next()));
        options = options.with_raw(raw);
    }
    match read_volume(files, name, &options) {
        Ok(loaded) => {
            let range = loaded.volume.range();
            assert!(range.iter().all(|value| value.is_finite()), "{range:?}");
            assert!(loaded.volume.extent().is_finite());
            for axis in loaded.volume.orientation().axes {
                assert!((axis.length() - 1.0).abs() < 1e-4, "{axis}");
            }
            true
        }
        Err(LoadError::Data {
            source: DataError::OutOfMemory { bytes },
            ..
        }) => panic!("{bytes} bytes were asked for"),
        Err(error) => {
            let length = error.to_string().len();
            assert!(length < 1000, "a message of {length} bytes");
            false
        }
    }
}

fn fuzz(reader: &str, time: Duration, from: u64) -> Result<(), String> {
    let seeds = seeds(reader);
    let (start, mut number, mut accepted, mut most) = (Instant::now(), from, 0_u64, 0);
    while start.elapsed() < time {
        if number % 100_000 == 0 {
            eprintln!("{reader}: at case {number}");
        }
        let (files, name) = case(&seeds, number);
        let before = ALLOCATOR.allocated();
        // The record of the allocator only grows: a case that passes it is the largest so far.
        let result = catch_unwind(AssertUnwindSafe(|| read(reader, &files, &name, number)));
        let taken = ALLOCATOR.max_allocated().saturating_sub(before);
        most = most.max(taken);
        match result {
            Ok(ok) => accepted += u64::from(ok),
            Err(_) => return Err(format!("{reader}: case {number} panics ({name})")),
        }
        if taken > MAX_BYTES {
            return Err(format!(
                "{reader}: case {number} takes {taken} bytes ({name})"
            ));
        }
        number += 1;
    }
    println!(
        "{reader}: {} cases in {:.0} s, {accepted} accepted, at most {most} bytes",
        number - from,
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn main() -> ExitCode {
    let (mut seconds, mut from, mut readers) = (10, 0, Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let number = |next: Option<String>| next.and_then(|text| text.parse().ok());
        match word.as_str() {
            "--seconds" => seconds = number(words.next()).unwrap_or(seconds),
            "--from" => from = number(words.next()).unwrap_or(from),
            name if READERS.contains(&name) => readers.push(name.to_owned()),
            _ => {
                eprintln!("usage: fuzz_readers [--seconds N] [--from CASE] {READERS:?}");
                return ExitCode::from(2);
            }
        }
    }
    if readers.is_empty() {
        readers = READERS.map(str::to_owned).to_vec();
    }
    for reader in readers {
        if let Err(failure) = fuzz(&reader, Duration::from_secs(seconds), from) {
            eprintln!("{failure}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
