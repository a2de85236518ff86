//! `truerate control`, dashboard → compensator, acquisition, by request–response: change the running model or source.

use crate::Text;
use iceoryx2::prelude::ZeroCopySend;

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// Adds `effect` to `axis`.
    Add = 1,
    /// Removes `effect` from `axis`.
    Remove = 2,
    /// Back to the model of the epoch before.
    Undo = 3,
    /// Stops learning.
    Pause = 4,
    /// Learns again.
    Resume = 5,
    /// Forgets what was seen so far.
    Forget = 6,
    /// Writes the model to the file `argument`.
    Save = 7,
    /// Acquisition: switches `effect` on in the source, with the values of `argument`.
    Hide = 8,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 8] =
        [Self::Add, Self::Remove, Self::Undo, Self::Pause, Self::Resume, Self::Forget, Self::Save, Self::Hide];

    /// The kind of this number.
    #[must_use]
    pub fn from_u32(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|k| *k as u32 == number)
    }
}

/// Bytes of an argument at most.
pub const ARGUMENT: usize = 1022;

/// One command.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Command.v1")]
pub struct Command {
    /// The same for a command that is sent again, so that it is done once.
    pub id: u64,
    /// [`Kind`].
    pub kind: u32,
    /// 0, 1, 2 for x, y, z; 3 for every axis that the effect can be on.
    pub axis: u32,
    /// 1 to take the new model at once, without its trial beside the present one.
    pub at_once: u64,
    /// Effect id.
    pub effect: Text<62>,
    /// Values, a file's absolute path, or a user's own effect in TOML.
    pub argument: Text<ARGUMENT>,
}

/// Its answer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Reply.v1")]
pub struct Reply {
    /// The command's.
    pub id: u64,
    /// Epoch from then on.
    pub epoch: u64,
    /// 1 done, 0 refused.
    pub done: u64,
    /// What was done, or why not.
    pub says: Text<510>,
}

const _: () = assert!(size_of::<Command>() == 1112);
const _: () = assert!(size_of::<Reply>() == 536);
