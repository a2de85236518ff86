//! What time it is: the system's; in WebAssembly, which has no clock, the time that its page said last.

/// Now; `None` where nobody knows.
#[cfg(not(target_family = "wasm"))]
#[must_use]
pub fn now() -> Option<jiff::Timestamp> {
    Some(jiff::Timestamp::now())
}

#[cfg(any(target_family = "wasm", clippy))]
mod said {
    use std::sync::atomic::{AtomicI64, Ordering};

    /// Milliseconds since 1970; 0 where nobody said.
    static SAID: AtomicI64 = AtomicI64::new(0);

    /// Now; `None` where nobody knows.
    #[cfg(target_family = "wasm")]
    #[must_use]
    pub fn now() -> Option<jiff::Timestamp> {
        let said = SAID.load(Ordering::Relaxed);
        jiff::Timestamp::from_millisecond(said).ok().filter(|_| said > 0)
    }

    /// Says what time it is, milliseconds since 1970.
    pub fn set(milliseconds: i64) {
        SAID.store(milliseconds, Ordering::Relaxed);
    }
}

#[cfg(target_family = "wasm")]
pub use said::now;
#[cfg(any(target_family = "wasm", clippy))]
pub use said::set;
