//! The same in a terminal: one large line says what to do now, a table what is lacking; drawn anew in its place.

use super::{Ending, Show, ending::Told, goal::shown};
use anyhow::Result;
use gyro_model::{
    diagnosis::Verdict,
    guide::{Followed, Goal, Stage, State, temperature::Course},
    units,
};
use std::{
    fmt::Write as _,
    io::{IsTerminal, Write},
};
use workbench::{
    output::print,
    report::{Ink, Terminal},
};

/// What stands on the screen.
#[derive(Default)]
pub(super) struct Screen {
    lines: usize,
}

/// Cells of a bar.
const BAR: usize = 24;

/// Whether standard output is a terminal.
pub(super) fn is_wanted() -> bool {
    std::io::stdout().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

impl Show for Screen {
    fn waits(&mut self, says: &str) -> Result<()> {
        self.draw(&[String::new(), format!("  waits {says}")])
    }

    fn state(&mut self, state: &State, source: Option<&str>) -> Result<()> {
        self.draw(&picture(state, source, Terminal::detect()))
    }

    fn end(&mut self, ending: &Ending) -> Result<()> {
        print(&format!("\n{}", end(ending, Terminal::detect().width).join("\n")))
    }
}

impl Screen {
    /// Draws over what was drawn before.
    fn draw(&mut self, lines: &[String]) -> Result<()> {
        let mut out = String::new();
        if self.lines > 0 {
            let _ = write!(out, "\x1b[{}A", self.lines);
        }
        for line in lines {
            let _ = writeln!(out, "\r\x1b[K{line}");
        }
        out.push_str("\x1b[J");
        self.lines = lines.len();
        let mut stdout = std::io::stdout().lock();
        stdout.write_all(out.as_bytes())?;
        Ok(stdout.flush()?)
    }
}

/// Words in lines no wider than this, so that a terminal breaks none of them.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > width {
            lines.push(String::new());
        }
        if let Some(last) = lines.last_mut() {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

/// One picture.
fn picture(state: &State, source: Option<&str>, terminal: Terminal) -> Vec<String> {
    let width = terminal.width.saturating_sub(2).max(20);
    let mut out = vec![String::new()];
    let now = wrapped(&format!("NOW: {}", state.says()), width - 2);
    // Two lines at least, so that the rest stays where it is.
    out.extend(now.iter().map(|line| terminal.paint(Ink::Order, &format!(" {line:<rest$}", rest = width - 1))));
    if now.len() == 1 {
        out.push(String::new());
    }
    out.push(match (state.correction(), state.hand, &state.order) {
        (Some(correction), ..) => terminal.paint(Ink::Warn, &cut(&format!("     {correction}"), width)),
        (None, Followed::Well, Some(order)) => {
            let told = format!("     good: {:.0} of {:.0} s", state.followed.min(order.seconds()), order.seconds());
            terminal.paint(Ink::Good, &told)
        }
        _ => String::new(),
    });
    out.push(state.temperature.and_then(|course| temperature(&course)).unwrap_or_default());
    let head = format!("{:<5}{:<24}{:>24}  {:>13}  {}", "axis", "parameter", "known by now", "wanted", "information");
    out.push(terminal.paint(Ink::Quiet, &cut(&head, width)));
    for goal in &state.goals {
        let (name, now, wanted) = shown(goal);
        let room = width.saturating_sub(5 + 24 + 24 + 2 + 13 + 2);
        let line = format!("{:<5}{name:<24}{now:>24}  {wanted:>13}  ", goal.axis.letter());
        let (bar, ink) = match (&goal.out_of_reach, goal.known) {
            (_, true) => ("enough".to_owned(), Ink::Good),
            (Some(_), _) => ("given up".to_owned(), Ink::Warn),
            _ => (bar(goal.gathered(), room.saturating_sub(5).min(BAR)), Ink::Plain),
        };
        out.push(cut(&line, width) + &if room > 8 { terminal.paint(ink, &bar) } else { String::new() });
    }
    let reasons = state.goals.iter().filter(|goal| !goal.known).filter_map(|goal| {
        goal.out_of_reach.as_ref().map(|why| format!("{} of axis {} is given up: {why}", goal.effect, goal.axis))
    });
    let troubles = state.troubles.iter().map(ToString::to_string).chain(source.map(str::to_owned));
    for (text, ink) in troubles.map(|text| (text, Ink::Bad)).chain(reasons.map(|text| (text, Ink::Quiet))) {
        out.extend(wrapped(&text, width - 2).iter().map(|line| terminal.paint(ink, &format!("  {line}"))));
    }
    out.push(String::new());
    let end =
        if state.stage == Stage::Searching { "" } else { "   Enter skips this; Ctrl-C ends it and keeps the log" };
    let foot = format!("{:.0} s, {} rows{end}", state.seconds, units::thousands(state.rows));
    out.push(terminal.paint(Ink::Quiet, &cut(&foot, width)));
    out
}

/// `     now 18.4 °C; so far 15.0 to 25.1 °C`.
pub(super) fn temperature(course: &Course) -> Option<String> {
    let range = course.low.zip(course.high);
    let range = range.map_or_else(String::new, |(low, high)| format!("; so far {low:.1} to {high:.1} °C"));
    course.now.filter(|_| !course.is_over()).map(|now| format!("     now {now:.1} °C{range}"))
}

/// A text that has room in so many cells.
fn cut(text: &str, width: usize) -> String {
    text.chars().take(width).collect()
}

/// Information gathered, of what is wanted.
fn bar(share: f64, cells: usize) -> String {
    let full = (share * cells as f64).floor() as usize;
    format!("{}{} {:>2.0} %", "█".repeat(full), "░".repeat(cells - full.min(cells)), (100.0 * share).floor().min(99.0))
}

/// A goal that is reached or given up, in a line.
pub(super) fn told(goal: &Goal) -> String {
    let (name, now, wanted) = shown(goal);
    match &goal.out_of_reach {
        Some(why) if !goal.known => format!("given up: axis {}: {name} ({now}; wanted {wanted}): {why}", goal.axis),
        _ => format!("known: axis {}: {name} {now} (wanted {wanted})", goal.axis),
    }
}

/// A goal that is lacking, in a few words.
pub(super) fn stands(goal: &Goal) -> String {
    let (name, now, wanted) = shown(goal);
    let percent = (100.0 * goal.gathered()).floor();
    format!("{} {name}: {now}, wanted {wanted}: {percent:.0} % of the information", goal.axis)
}

/// What it came to, in lines of this width.
pub(super) fn end(ending: &Ending, width: usize) -> Vec<String> {
    let mut out = Vec::new();
    let Some(log) = &ending.log else {
        return vec!["nothing was recorded: no row came that can be used".to_owned()];
    };
    out.push(format!(
        "{}: {:.0} s, {} rows in {log}",
        if ending.complete { "complete" } else { "not complete" },
        ending.seconds,
        units::thousands(ending.rows)
    ));
    if !ending.course {
        out.extend(ending.parameters.iter().filter(|goal| goal.known).map(told));
    }
    let is_answer = |told: &&Told| ending.course || !matches!(told.verdict, Verdict::Adequate | Verdict::CannotTell);
    for told in ending.verdicts.iter().filter(is_answer) {
        out.extend(wrapped(&format!("axis {}  {}", told.axis, told.headline), width));
        if !told.separate_by.is_empty() {
            out.extend(wrapped(&format!("To tell {} apart: {}.", told.effects.join(" and "), told.separate_by), width));
        }
    }
    if !ending.complete {
        out.extend(ending.troubles.iter().map(|trouble| format!("trouble: {trouble}")));
        out.extend(ending.lacking.iter().map(|lack| format!("lacking: {lack}")));
    }
    out.extend(ending.next.iter().map(|next| format!("next: {next}")));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::{
        Axis, Row,
        effects::find,
        guide::{Guide, Precision, Wanted},
    };

    fn guide() -> Guide {
        let effects = ["scale-factor", "temperature-scale"].map(|id| (find(id).unwrap(), Precision::OfTypical(0.01)));
        Guide::new(Wanted { axes: vec![Axis::X, Axis::Y], effects: effects.to_vec(), course: true, temperature: false })
    }

    #[test]
    fn what_to_do_now_and_what_is_lacking_are_on_the_screen_and_no_line_is_too_long() {
        let mut guide = guide();
        for k in 0..400 {
            let t_ns = 10_000_000 * k;
            // It is to be still, and moves.
            let rate = (0.05 * k as f64).sin();
            guide.take(&Row { t_ns, gyro: [rate; 3], ref_rate: [rate; 3], ..Row::EMPTY });
        }
        for width in [40, 80, 110] {
            let lines = picture(&guide.state(), Some("no rows come"), Terminal { width, colour: false });
            let text = lines.join("\n");
            assert!(lines.iter().all(|line| line.chars().count() <= width), "{width}:\n{text}");
            for part in ["NOW: hold it still", "keep still: it moves", "scale-factor", "no rows come"] {
                assert!(text.contains(part), "{part}:\n{text}");
            }
        }
    }

    #[test]
    fn a_bar_is_full_only_where_all_is_there() {
        assert_eq!(bar(0.999, 4), "███░ 99 %");
        assert_eq!(bar(0.0, 4), "░░░░  0 %");
    }
}
