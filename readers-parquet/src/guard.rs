//! What decoding panics of is an error: the decoder trusts lengths that stand in a file here and there.

use parquet::errors::{ParquetError, Result};
use std::{
    cell::Cell,
    panic::{self, AssertUnwindSafe},
    sync::Once,
};

thread_local! {
    /// Whether this thread is decoding: then a panic is no fault of the program's and is not printed.
    static DECODING: Cell<bool> = const { Cell::new(false) };
}

/// Does it; an error where it panics, after which what it worked on must not be used any more.
pub fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            // Where a panic ends everything, what it says is all there is.
            if !DECODING.get() || cfg!(panic = "abort") {
                before(info);
            }
        }));
    });
    let outside = DECODING.replace(true);
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    DECODING.set(outside);
    done.unwrap_or_else(|_| Err(ParquetError::General("the file is damaged".to_owned())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_panics_is_an_error_and_what_does_not_is_given() {
        let none: [u8; 0] = [];
        let at = std::hint::black_box(3);
        assert!(guarded(|| Ok(none[at])).is_err());
        assert_eq!(guarded(|| Ok(7)).ok(), Some(7));
        assert!(!DECODING.get());
    }
}
