//! What a log is read with, as each voice names it: a flag, an argument of a function, or what is pressed or dropped in a page.

use super::Voice;

/// An argument with which a log is read.
#[derive(Clone, Copy, Debug)]
pub enum Argument<'a> {
    /// Channels under the names of the log format, `NAME=CHANNEL` each.
    Map(&'a [String]),
    /// A column map.
    Columns,
    /// A second file, with the reference.
    Reference(&'a str),
    /// What the frames of a CAN log mean.
    Dbc(&'a str),
    /// Axes without a reference did not turn.
    AtRest,
    /// A reference that was computed from this gyro counts.
    Dependent,
}

impl Argument<'_> {
    /// Its flag.
    const fn flag(self) -> &'static str {
        match self {
            Self::Map(_) => "map",
            Self::Columns => "columns",
            Self::Reference(_) => "reference",
            Self::Dbc(_) => "dbc",
            Self::AtRest => "at-rest",
            Self::Dependent => "reference-is-dependent",
        }
    }

    /// Its value, where it has one.
    const fn value(&self) -> Option<&str> {
        match self {
            Self::Map(_) | Self::AtRest | Self::Dependent => None,
            Self::Columns => Some("F"),
            Self::Reference(file) | Self::Dbc(file) => Some(file),
        }
    }

    /// As it stands in a command.
    fn flags(self) -> String {
        let flag = self.flag();
        match (self, self.value()) {
            (Self::Map(maps), _) => {
                maps.iter().map(|map| format!("--map {}", shell_word(map))).collect::<Vec<_>>().join(" ")
            }
            (_, Some(value)) => format!("--{flag} {value}"),
            (_, None) => format!("--{flag}"),
        }
    }

    /// As it stands in a call of the library.
    fn keyword(self) -> String {
        let flag = self.flag().replace('-', "_");
        match (self, self.value()) {
            (Self::Map(maps), _) => {
                let pair = |map: &String| {
                    let (name, channel) = map.split_once('=').unwrap_or((map, ""));
                    format!("{name:?}: {channel:?}")
                };
                format!("map={{{}}}", maps.iter().map(pair).collect::<Vec<_>>().join(", "))
            }
            (_, Some(value)) => format!("{flag}={value:?}"),
            (_, None) => format!("{flag}=True"),
        }
    }

    /// What it is in a page.
    const fn place(self) -> &'static str {
        match self {
            Self::Map(_) | Self::Columns => "the table of channels below",
            Self::Reference(_) => "a second file, dropped here",
            Self::Dbc(_) => "the DBC file, dropped here",
            Self::AtRest | Self::Dependent => "a tick under Channels",
        }
    }

    /// Its name in a sentence.
    #[must_use]
    pub fn name(self, voice: Voice) -> String {
        match voice {
            Voice::Log | Voice::Stream | Voice::Library => format!("`{}`", self.typed(voice)),
            Voice::Page => self.place().to_owned(),
        }
    }

    /// How it is given: "with" its name.
    #[must_use]
    pub fn with(self, voice: Voice) -> String {
        match (voice, self) {
            (Voice::Page, Self::Map(_) | Self::Columns) => format!("in {}", self.place()),
            (Voice::Page, Self::Reference(_) | Self::Dbc(_)) => "by dropping it here, too".to_owned(),
            _ => format!("with {}", self.name(voice)),
        }
    }

    /// As it is typed.
    #[must_use]
    pub fn typed(self, voice: Voice) -> String {
        match (voice, self) {
            (Voice::Log | Voice::Stream, _) => self.flags(),
            (Voice::Library, _) => self.keyword(),
            (Voice::Page, Self::Map(maps)) => maps.join(", "),
            (Voice::Page, _) => self.place().to_owned(),
        }
    }
}

/// A word as a shell takes it, quoted where that is needed.
#[must_use]
pub fn shell_word(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./=:,+@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::{Argument, Voice};

    #[test]
    fn a_command_has_flags_a_library_arguments_and_a_page_what_is_pressed_or_dropped() {
        let (one, two) = (["gyro_z=gz".to_owned()], ["t=time [s]".to_owned(), "gyro_z=gz".to_owned()]);
        assert_eq!(Argument::Map(&one).with(Voice::Log), "with `--map gyro_z=gz`");
        assert_eq!(Argument::Map(&two).typed(Voice::Log), "--map 't=time [s]' --map gyro_z=gz");
        assert_eq!(Argument::Map(&two).name(Voice::Library), r#"`map={"t": "time [s]", "gyro_z": "gz"}`"#);
        assert_eq!(Argument::Map(&one).with(Voice::Page), "in the table of channels below");
        assert_eq!(Argument::Dbc("FILE").with(Voice::Library), r#"with `dbc="FILE"`"#);
        assert_eq!(Argument::Reference("FILE").with(Voice::Page), "by dropping it here, too");
        assert_eq!(Argument::Dependent.name(Voice::Library), "`reference_is_dependent=True`");
        assert_eq!(Argument::AtRest.name(Voice::Page), "a tick under Channels");
    }
}
