//! What the page calls: the only place with `unsafe`, beside [`crate::told`].
//!
//! The page reserves memory, writes into it and gives it back with [`put`] or [`ask`]; an answer stays until the next question.

use crate::{
    request::{self, Held},
    told::{Told, tell},
};
use gyro_model::words::Voice;
use std::{cell::RefCell, path::Path};
use workbench::{clock, files, words};

thread_local! {
    static HELD: RefCell<Held> = RefCell::default();
    static ANSWER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Where the page finds bytes: their address in the low half, their number in the high one.
fn place(bytes: &[u8]) -> u64 {
    (bytes.len() as u64) << 32 | bytes.as_ptr().addr() as u64
}

/// Keeps bytes until the next answer, and says where they are.
fn answer(bytes: Vec<u8>) -> u64 {
    ANSWER.with_borrow_mut(|kept| {
        *kept = bytes;
        place(kept)
    })
}

/// Memory for this many bytes, to be given back.
#[unsafe(no_mangle)]
extern "C" fn reserve(length: usize) -> *mut u8 {
    Box::leak(vec![0; length].into_boxed_slice()).as_mut_ptr()
}

/// What the page has written into reserved memory.
///
/// # Safety
/// `at` came from [`reserve`] of this length, and is not used again.
unsafe fn given(at: *mut u8, length: usize) -> Vec<u8> {
    // SAFETY: as above; a boxed slice has no spare room.
    unsafe { Vec::from_raw_parts(at, length, length) }
}

/// Puts a file under a name.
#[unsafe(no_mangle)]
extern "C" fn put(name: *mut u8, name_length: usize, bytes: *mut u8, length: usize) {
    // SAFETY: both came from `reserve`.
    let (name, bytes) = unsafe { (given(name, name_length), given(bytes, length)) };
    files::put(Path::new(&*String::from_utf8_lossy(&name)), bytes);
}

/// The bytes of a file that was made; none where there is none.
#[unsafe(no_mangle)]
extern "C" fn take(name: *mut u8, length: usize) -> u64 {
    // SAFETY: it came from `reserve`.
    let name = unsafe { given(name, length) };
    answer(files::take(Path::new(&*String::from_utf8_lossy(&name))).map_or_else(Vec::new, |bytes| bytes.to_vec()))
}

/// Answers a request: JSON in, JSON out. `milliseconds` is the time now, since 1970.
#[unsafe(no_mangle)]
extern "C" fn ask(at: *mut u8, length: usize, milliseconds: f64) -> u64 {
    std::panic::set_hook(Box::new(|panic| tell(Told::Panic, &panic.to_string())));
    clock::set(milliseconds as i64);
    words::speak_as(Voice::Page);
    // SAFETY: it came from `reserve`.
    let text = unsafe { given(at, length) };
    answer(HELD.with_borrow_mut(|held| request::answer(held, &text)))
}
