//! What time it is: the system's; in WebAssembly, which has no clock, the time that its page said last.

use jiff::Timestamp;

/// Now; `None` where nobody knows.
#[cfg(not(target_family = "wasm"))]
#[must_use]
pub fn now() -> Option<Timestamp> {
    Some(Timestamp::now())
}

#[cfg(target_family = "wasm")]
mod said {
    use super::Timestamp;
    use std::sync::atomic::{AtomicI64, Ordering};

    /// Milliseconds since 1970; 0 where nobody said.
    static SAID: AtomicI64 = AtomicI64::new(0);

    /// Now; `None` where nobody knows.
    #[must_use]
    pub fn now() -> Option<Timestamp> {
        let said = SAID.load(Ordering::Relaxed);
        Timestamp::from_millisecond(said).ok().filter(|_| said > 0)
    }

    /// Says what time it is, milliseconds since 1970.
    pub fn set(milliseconds: i64) {
        SAID.store(milliseconds, Ordering::Relaxed);
    }
}

#[cfg(target_family = "wasm")]
pub use said::{now, set};
