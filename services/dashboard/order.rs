//! What a client asks for, checked and turned into a command to the pipeline.

use ipc_types::{
    Command, Text,
    command::{ARGUMENT, Kind},
};
use serde::Deserialize;
use std::{
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
};

/// An order as JSON: `{"do": "add", "effect": "delay", "axis": "z"}`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// `add`, `remove`, `undo`, `pause`, `resume`, `forget`, `save`, `hide`.
    #[serde(rename = "do")]
    pub what: String,
    /// Effect id.
    #[serde(default)]
    pub effect: String,
    /// `x`, `y`, `z`; all that it can be on where it is left out.
    #[serde(default)]
    pub axis: String,
    /// Without the trial beside the present model.
    #[serde(default)]
    pub at_once: bool,
    /// `save`: a plain file name; `hide`: `NAME=VALUE,…`.
    #[serde(default)]
    pub argument: String,
}

/// Why an order is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// An unknown word.
    #[error("unknown command '{0}': use add, remove, undo, pause, resume, forget, save or hide")]
    What(String),
    /// Not an axis.
    #[error("'{0}' is not an axis: use x, y or z")]
    Axis(String),
    /// Not an id.
    #[error("an effect's id is lower-case letters, digits and hyphens, at most 62")]
    Effect,
    /// Not a file name.
    #[error("a file name is letters, digits, '.', '-' and '_', ends in .toml and has no folder in it")]
    Name,
    /// More than a command can hold.
    #[error("the argument is {0} bytes long, and a command holds {room}", room = ARGUMENT)]
    TooLong(usize),
}

impl Order {
    /// The command; files are saved in `folder` and nowhere else.
    ///
    /// # Errors
    /// What is wrong with the order.
    pub fn command(&self, folder: &Path) -> Result<Command, OrderError> {
        let kind = match self.what.as_str() {
            "add" => Kind::Add,
            "remove" => Kind::Remove,
            "undo" => Kind::Undo,
            "pause" => Kind::Pause,
            "resume" => Kind::Resume,
            "forget" => Kind::Forget,
            "save" => Kind::Save,
            "hide" => Kind::Hide,
            _ => return Err(OrderError::What(self.what.chars().take(40).collect())),
        };
        let axis = match self.axis.as_str() {
            "" => 3,
            letter => letter
                .parse::<gyro_model::Axis>()
                .map_err(|_| OrderError::Axis(letter.chars().take(8).collect()))?
                .index(),
        };
        let names_effect = matches!(kind, Kind::Add | Kind::Remove | Kind::Hide);
        if names_effect && !is_id(&self.effect) {
            return Err(OrderError::Effect);
        }
        let argument = if kind == Kind::Save {
            if !is_file_name(&self.argument) {
                return Err(OrderError::Name);
            }
            folder.join(&self.argument).to_str().ok_or(OrderError::Name)?.to_string()
        } else {
            self.argument.clone()
        };
        Ok(Command {
            id: fresh_id(),
            kind: kind as u32,
            axis: axis as u32,
            at_once: u64::from(self.at_once),
            effect: Text::whole(&self.effect).ok_or(OrderError::Effect)?,
            argument: Text::whole(&argument).ok_or(OrderError::TooLong(argument.len()))?,
        })
    }
}

fn is_id(id: &str) -> bool {
    !id.is_empty() && id.len() <= 62 && id.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-')
}

fn is_file_name(name: &str) -> bool {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"._-".contains(&b);
    name.strip_suffix(".toml").is_some_and(|stem| !stem.is_empty() && stem.len() <= 90)
        && !name.starts_with('.')
        && name.bytes().all(plain)
}

/// Never the same twice in this process, and hardly ever in another one.
fn fresh_id() -> u64 {
    static COUNT: AtomicU64 = AtomicU64::new(1);
    (u64::from(std::process::id()) << 32) | (1 << 31) | COUNT.fetch_add(1, Ordering::Relaxed) & 0x7fff_ffff
}

#[cfg(test)]
mod tests {
    use super::*;

    fn save(name: &str) -> Result<Command, OrderError> {
        Order { what: "save".into(), argument: name.into(), ..Order::default() }.command(Path::new("/tmp/models"))
    }

    #[test]
    fn a_model_is_saved_in_the_chosen_folder_and_nowhere_else() {
        assert_eq!(save("yaw-2.toml").unwrap().argument.as_str(), "/tmp/models/yaw-2.toml");
        for name in
            ["../x.toml", "/etc/x.toml", "a/b.toml", ".x.toml", "x.sh", "", "x\0.toml", "..toml/.toml", "ä.toml"]
        {
            assert_eq!(save(name), Err(OrderError::Name), "{name:?}");
        }
    }

    #[test]
    fn an_order_of_nonsense_is_refused_in_words() {
        let order = |what: &str, effect: &str, axis: &str| {
            Order { what: what.into(), effect: effect.into(), axis: axis.into(), ..Order::default() }
                .command(Path::new("/tmp"))
        };
        assert!(matches!(order("explode", "", ""), Err(OrderError::What(_))));
        assert!(matches!(order("add", "delay", "w"), Err(OrderError::Axis(_))));
        for effect in ["", "De lay", "<script>", &"a".repeat(63)] {
            assert_eq!(order("add", effect, "z"), Err(OrderError::Effect), "{effect}");
        }
        let add = order("add", "delay", "z").unwrap();
        assert_eq!((Kind::from_u32(add.kind), add.axis, add.effect.as_str()), (Some(Kind::Add), 2, "delay"));
    }

    #[test]
    fn every_command_has_its_own_id() {
        assert_ne!(fresh_id(), fresh_id());
    }

    #[test]
    fn unknown_keys_are_refused() {
        assert!(serde_json::from_str::<Order>(r#"{"do":"undo","path":"/etc"}"#).is_err());
    }
}
