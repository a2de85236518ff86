//! A page of this machine shown in a browser.

use std::{
    env,
    ffi::{OsStr, OsString},
    path::Path,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// A program that fails to show a page ends with an error within this time; one that shows it may stay.
const FAILS_WITHIN: Duration = Duration::from_secs(2);
/// How often it is looked whether it ended.
const PAUSE: Duration = Duration::from_millis(20);

/// Shows a file in a browser; `false` where there is none here, or none shows it.
#[must_use]
pub fn show(file: &Path) -> bool {
    let named = env::var_os("BROWSER").filter(|named| !named.is_empty());
    let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| env::var_os(name).is_some_and(|v| !v.is_empty()));
    programs(named.as_deref(), has_screen).iter().any(|program| shows(program, file))
}

/// The programs to try, in this order: those that `BROWSER` names, then the system's own.
fn programs(named: Option<&OsStr>, has_screen: bool) -> Vec<OsString> {
    let mut programs: Vec<OsString> =
        named.map(|named| env::split_paths(named).map(Into::into).collect()).unwrap_or_default();
    if cfg!(target_os = "macos") {
        programs.push("open".into());
    } else if has_screen {
        // Without a screen it would start a browser that draws text over the report.
        programs.push("xdg-open".into());
    }
    programs
}

fn shows(program: &OsStr, file: &Path) -> bool {
    let mut words = program.to_str().unwrap_or_default().split_whitespace();
    let Some(name) = words.next() else { return false };
    let mut command = Command::new(name);
    let mut named = false;
    for word in words {
        named |= word.contains("%s");
        command.arg(word.replace("%s", &file.to_string_lossy()));
    }
    if !named {
        command.arg(file);
    }
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let Ok(mut child) = command.spawn() else { return false };
    let began = Instant::now();
    while began.elapsed() < FAILS_WITHIN {
        match child.try_wait() {
            Ok(Some(status)) => return status.success(),
            Ok(None) => thread::sleep(PAUSE),
            Err(_) => return false,
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_browser_that_is_named_comes_first_and_without_a_screen_alone() {
        let names = |named: &str, has_screen| programs(Some(OsStr::new(named)), has_screen);
        assert_eq!(names("firefox:links -g", false)[..2], ["firefox", "links -g"]);
        assert!(programs(None, false).is_empty() || cfg!(target_os = "macos"));
        assert_eq!(programs(None, true).len(), 1);
    }

    #[test]
    fn what_fails_or_is_not_there_shows_nothing() {
        let file = Path::new("page.html");
        assert!(shows(OsStr::new("true"), file) && shows(OsStr::new("test %s = page.html"), file));
        assert!(!shows(OsStr::new("false"), file) && !shows(OsStr::new("no-such-browser"), file));
        assert!(!shows(OsStr::new(""), file));
    }
}
