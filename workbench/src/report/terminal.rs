//! The terminal that text is for: how wide it is and whether it wants colour.

use std::io::IsTerminal;

/// Width and colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terminal {
    /// Columns.
    pub width: usize,
    /// Whether escape sequences are welcome.
    pub colour: bool,
}

impl Terminal {
    /// For files and pipes.
    pub const PLAIN: Self = Self { width: 96, colour: false };

    /// Standard output's: colour only on a terminal and where `NO_COLOR` is unset or empty (<https://no-color.org>).
    #[must_use]
    pub fn detect() -> Self {
        let stdout = std::io::stdout();
        if !stdout.is_terminal() {
            return Self::PLAIN;
        }
        let width = columns(&stdout);
        let refused = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty())
            || std::env::var_os("TERM").is_some_and(|v| v == "dumb");
        Self { width: if width == 0 { 80 } else { width.clamp(40, 110) }, colour: !refused }
    }

    /// The text in a colour, where colours are welcome.
    #[must_use]
    pub fn paint(self, ink: Ink, text: &str) -> String {
        if self.colour && !text.is_empty() && !matches!(ink, Ink::Plain) {
            format!("\x1b[{}m{text}\x1b[0m", ink.code())
        } else {
            text.to_string()
        }
    }
}

/// Its columns; 0 where nobody knows.
#[cfg(not(target_family = "wasm"))]
fn columns(stdout: &std::io::Stdout) -> usize {
    rustix::termios::tcgetwinsize(stdout).map_or(0, |size| usize::from(size.ws_col))
}

/// In WebAssembly there is no terminal.
#[cfg(target_family = "wasm")]
fn columns(_: &std::io::Stdout) -> usize {
    0
}

/// What a colour means.
#[derive(Clone, Copy, Debug)]
pub enum Ink {
    /// Something is right.
    Good,
    /// A warning.
    Warn,
    /// Something is wrong.
    Bad,
    /// Less important text.
    Quiet,
    /// Important text.
    Strong,
    /// An instruction to follow now.
    Order,
    /// A command to copy.
    Command,
    /// Plain text.
    Plain,
}

impl Ink {
    const fn code(self) -> &'static str {
        match self {
            Self::Good => "1;32",
            Self::Warn => "1;33",
            Self::Bad => "1;31",
            Self::Quiet => "2",
            Self::Strong => "1",
            Self::Order => "1;7",
            Self::Command => "1;36",
            Self::Plain => "0",
        }
    }
}
