//! A short text of fixed room.

use iceoryx2::prelude::ZeroCopySend;
use std::fmt;

/// Up to `N` bytes of UTF-8; what is longer is cut at a character.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Text.v1")]
pub struct Text<const N: usize> {
    length: u16,
    bytes: [u8; N],
}

impl<const N: usize> Text<N> {
    /// The empty text.
    pub const EMPTY: Self = Self { length: 0, bytes: [0; N] };

    /// As much of `text` as there is room for.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut length = text.len().min(N).min(usize::from(u16::MAX));
        while !text.is_char_boundary(length) {
            length -= 1;
        }
        let mut bytes = [0; N];
        bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
        Self { length: length as u16, bytes }
    }

    /// The whole of `text`, or `None` where there is no room.
    #[must_use]
    pub fn whole(text: &str) -> Option<Self> {
        (text.len() <= N).then(|| Self::new(text))
    }

    /// The text; empty where the bytes are not UTF-8.
    #[must_use]
    pub fn as_str(&self) -> &str {
        self.bytes.get(..usize::from(self.length)).and_then(|b| std::str::from_utf8(b).ok()).unwrap_or_default()
    }
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<const N: usize> fmt::Debug for Text<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

impl<const N: usize> fmt::Display for Text<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::Text;

    #[test]
    fn a_long_text_is_cut_at_a_character() {
        assert_eq!(Text::<3>::new("aé").as_str(), "aé");
        assert_eq!(Text::<2>::new("aé").as_str(), "a");
        assert!(Text::<2>::whole("aé").is_none());
    }
}
