//! No bytes make a reader panic, hang, or take memory that the file has not got.
//!
//! Files of every format are damaged at random: bits, extreme lengths, cuts, pieces moved. A few thousand by default; a million
//! each with `cargo test -p log-readers --release --test hostile -- --ignored`. `HOSTILE_SEED=N` draws other damages, and
//! `HOSTILE_COUNT=N` another number of them.

#![allow(unsafe_code, reason = "an allocator that counts is the only way to see what was taken")]

mod seeds;

use log_readers::{formats::recognise, survey::Survey};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed},
    },
    thread,
    time::{Duration, Instant},
};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: everything is the system allocator's; only sizes are counted beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        MOST.fetch_max(now, Relaxed);
        // SAFETY: the caller's own promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's own promise.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// More than a reader may take for one small file.
const MOST_BYTES: usize = 256 << 20;
/// A file of some kilobytes that is still being read after this is never read to its end, however loaded the machine is.
const LONGEST: Duration = Duration::from_secs(60);

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// Damages a file in one to eight places.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    const EXTREME: [u64; 8] = [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, 0xffff_ffff, u64::MAX];
    for _ in 0..=random.below(8) {
        // The beginning, where definitions are, as often as all the rest.
        let end = if random.below(2) == 0 { bytes.len().min(400) } else { bytes.len() };
        let at = random.below(end);
        match random.below(7) {
            0 => bytes.truncate(at),
            1 | 2 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            3 if at < bytes.len() => bytes[at] = random.next() as u8,
            4 => {
                let extreme = EXTREME[random.below(8)].to_le_bytes();
                let size = [1, 2, 4, 8][random.below(4)].min(bytes.len() - at);
                bytes[at..at + size].copy_from_slice(&extreme[..size]);
            }
            5 => {
                let from = random.below(bytes.len());
                let piece = bytes[from..(from + random.below(64)).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => drop(bytes.drain(at..(at + random.below(16)).min(bytes.len()))),
        }
    }
}

/// What is being read, and since when.
static READING: Mutex<Option<(&str, usize, Instant)>> = Mutex::new(None);
/// Whether all has been read.
static DONE: AtomicBool = AtomicBool::new(false);

/// Ends the test where a reader hangs: it could not end by itself.
fn watch() {
    while !DONE.load(Relaxed) {
        thread::park_timeout(Duration::from_millis(500));
        let reading = *READING.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((name, k, began)) = reading
            && began.elapsed() > LONGEST
        {
            eprintln!("{name}, damage {k}: not read after {:?}", began.elapsed());
            std::process::abort();
        }
    }
}

/// Lets the watch go, after a panic too.
struct Watched(thread::Thread);

impl Drop for Watched {
    fn drop(&mut self) {
        DONE.store(true, Relaxed);
        self.0.unpark();
    }
}

/// A whole number from the environment.
fn told(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text}: a whole number is wanted")))
}

fn hammer(count: usize) {
    let _alone = ONE.lock();
    let count = told("HOSTILE_COUNT").map_or(count, |told| told as usize);
    let seed = told("HOSTILE_SEED").unwrap_or(0);
    DONE.store(false, Relaxed);
    thread::scope(|scope| {
        let _watched = Watched(scope.spawn(watch).thread().clone());
        for (name, whole) in seeds::all().into_iter().chain([("JSON", seeds::json())]) {
            let mut random = Random(whole.len() as u64 ^ seed.rotate_left(32));
            let (mut most, began) = (0, Instant::now());
            for k in 0..count {
                let mut bytes = whole.clone();
                damage(&mut bytes, &mut random);
                // Of frames what they mean, too.
                let mut dbc = seeds::DBC.as_bytes().to_vec();
                if name.starts_with("CAN") && k % 2 == 0 {
                    damage(&mut dbc, &mut random);
                }
                *READING.lock().unwrap_or_else(PoisonError::into_inner) = Some((name, k, Instant::now()));
                let before = NOW.load(Relaxed);
                MOST.store(before, Relaxed);
                let mut survey = Survey::default();
                // An error is an answer; so is nothing.
                let _ = seeds::read(&bytes, &dbc, &mut survey);
                let taken = MOST.load(Relaxed).saturating_sub(before);
                assert!(taken < MOST_BYTES, "{name}, damage {k}: {taken} bytes for a file of {}", bytes.len());
                most = most.max(taken);
            }
            println!("{name}: {count} damages, at most {} MB each, {:.0?} in all", most >> 20, began.elapsed());
        }
        *READING.lock().unwrap_or_else(PoisonError::into_inner) = None;
    });
}

/// What takes no bytes ends no file, however often it is there.
#[test]
fn arrays_of_nothing_end() {
    let mut ulog = b"ULog\x01\x12\x35\x01".to_vec();
    ulog.extend(0_u64.to_le_bytes());
    seeds::record(&mut ulog, b'F', b"b:");
    seeds::record(&mut ulog, b'F', b"a:uint64_t timestamp;b[18446744073709551615] x;float y;");
    seeds::record(&mut ulog, b'A', b"\x00\x07\x00a");
    let tf = "geometry_msgs/TransformStamped[] transforms\n====\nMSG: geometry_msgs/TransformStamped\n# nothing\n";
    let tf = seeds::mcap_of("", "tf2_msgs/msg/TFMessage", tf, |_| [[0, 1, 0, 0], [255; 4]].concat());
    for bytes in [ulog, tf] {
        seeds::read(&bytes, &[], &mut Survey::default()).expect("a file");
    }
}

/// One at a time, for what is counted is the whole process'.
static ONE: Mutex<()> = Mutex::new(());

#[test]
fn no_damage_makes_a_reader_panic_hang_or_swell() {
    hammer(2000);
}

#[test]
#[ignore = "a million files of each format: an hour"]
fn a_million_damaged_files_of_each_format() {
    hammer(1_000_000);
}

/// The same chunk of an MCAP again and again.
struct Repeating {
    head: Vec<u8>,
    chunk: Vec<u8>,
    at: usize,
    left: u64,
}

impl Repeating {
    fn new(compression: &str, bytes: u64) -> Self {
        let whole = seeds::mcap(compression);
        let length = |at: usize| u64::from_le_bytes(whole[at + 1..at + 9].try_into().unwrap()) as usize + 9;
        let (header, chunk) = (8 + length(8), length(8 + length(8)));
        Self { head: whole[..header].to_vec(), chunk: whole[header..header + chunk].to_vec(), at: 0, left: bytes }
    }
}

impl std::io::Read for Repeating {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let source = if self.head.is_empty() { &self.chunk } else { &self.head };
        let n = buffer.len().min(source.len() - self.at).min(self.left as usize);
        buffer[..n].copy_from_slice(&source[self.at..self.at + n]);
        self.at += n;
        self.left -= n as u64;
        if self.at == source.len() {
            self.at = 0;
            self.head.clear();
        }
        Ok(n)
    }
}

fn flat(bytes: u64) {
    let _alone = ONE.lock();
    for compression in ["", "lz4", "zstd"] {
        let mut source = Repeating::new(compression, bytes);
        let format = recognise(&source.head);
        let before = NOW.load(Relaxed);
        MOST.store(before, Relaxed);
        let mut survey = Survey::default();
        format.read(&mut source, &mut survey).unwrap();
        let taken = MOST.load(Relaxed).saturating_sub(before);
        assert!(survey.topics[0].messages > 0 && taken < 32 << 20, "{compression}: {taken} bytes");
    }
}

#[test]
fn memory_does_not_grow_with_a_recording() {
    flat(20_000_000);
}

#[test]
#[ignore = "a gigabyte of each compression: a minute"]
fn a_gigabyte_takes_no_more() {
    flat(1_000_000_000);
}
