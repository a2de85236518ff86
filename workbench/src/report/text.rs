//! One terminal screen: the verdict first, the next command last.

use super::{
    bars::{self, Scale},
    terminal::{Ink, Terminal},
    units,
    view::{AxisView, ExplainedView, Page, ParameterView, Row, Story},
};
use gyro_model::{Axis, words::labels};

/// Suspects shown: the rest removes less and only distracts; JSON and HTML have them all.
const SUSPECTS: usize = 4;

/// The whole page.
pub(super) fn render(page: &Page, terminal: Terminal) -> String {
    let mut screen = Screen { terminal, text: String::new() };
    screen.line(&format!("{}  {}", terminal.paint(Ink::Strong, &page.title), terminal.paint(Ink::Quiet, &page.log)));
    if !page.about.is_empty() {
        screen.wrapped("", &page.about.join(" · "), Ink::Quiet);
    }
    if !page.warning.is_empty() {
        screen.wrapped("", &page.warning, Ink::Warn);
    }
    if let Some(story) = &page.story {
        screen.story(story);
    }
    let alike = |a: &AxisView, b: &AxisView| {
        let ends = |axis: &AxisView| axis.ends && axis.steps.len() < 2;
        ends(a) && ends(b) && (&a.headline, &a.label, &a.says) == (&b.headline, &b.label, &b.says)
    };
    for alike in page.axes.chunk_by(alike) {
        screen.axes(alike, page.tests);
    }
    if let Some(story) = &page.story {
        screen.faults("data faults of all axes", &story.faults);
    }
    if page.axes.is_empty() {
        screen.line("No axis was examined: none has both a gyro column and a reference.");
    }
    for (i, next) in page.next.iter().enumerate() {
        let lead = if i == 0 { "\nnext  " } else { "or    " };
        screen.line(&format!("{lead}{}", terminal.paint(Ink::Command, &next.command)));
        screen.wrapped("      ", &next.says, Ink::Quiet);
    }
    if let Some(look) = &page.look {
        screen.line(&format!("look  {}", terminal.paint(Ink::Command, &look.command)));
        screen.wrapped("      ", &look.says, Ink::Quiet);
    }
    screen.text
}

/// Why each effect was named or was not, axis by axis.
pub(super) fn explanation(axes: &[(Axis, Vec<ExplainedView>)], tests: bool, terminal: Terminal) -> String {
    let mut screen = Screen { terminal, text: String::new() };
    for (axis, explained) in axes.iter().filter(|(_, explained)| !explained.is_empty()) {
        if axes.len() > 1 {
            screen.line(&format!("axis {axis}"));
        }
        screen.reasons(explained, tests);
    }
    screen.text
}

/// Averaging times at which it is told what an error is made of, s.
const SHOWN: [f64; 4] = [0.03, 0.1, 1.0, 10.0];

/// Columns of a terminal from which on the upper end of the floor's band has one.
const BANDED: usize = 90;
/// Columns from which on the angle has one.
const DRIFTED: usize = 72;

struct Screen {
    terminal: Terminal,
    text: String,
}

impl Screen {
    fn line(&mut self, line: &str) {
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    fn heading(&mut self, heading: &str) {
        let heading = self.terminal.paint(Ink::Strong, heading);
        self.line(&format!("\n{heading}"));
    }

    /// Words up to the terminal's width, every line behind the indent.
    fn wrapped(&mut self, indent: &str, text: &str, ink: Ink) {
        let width = self.terminal.width.saturating_sub(indent.chars().count()).max(20);
        let mut line = String::new();
        for word in text.split([' ', '\n']) {
            if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > width {
                let painted = self.terminal.paint(ink, &line);
                self.line(&format!("{indent}{painted}"));
                line.clear();
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        if !line.is_empty() {
            let painted = self.terminal.paint(ink, &line);
            self.line(&format!("{indent}{painted}"));
        }
    }

    /// Wrapped with a bullet before the first line.
    fn item(&mut self, bullet: &str, text: &str) {
        let start = self.text.len();
        let indent = " ".repeat(bullet.chars().count());
        self.wrapped(&indent, text, Ink::Plain);
        self.text.replace_range(start..start + indent.len(), bullet);
    }

    /// What the axes share, and the table of all.
    fn story(&mut self, story: &Story) {
        if !story.shared.is_empty() {
            self.text.push('\n');
        }
        for shared in &story.shared {
            self.wrapped("", &shared.says, Ink::Warn);
            if !shared.at_source.is_empty() {
                self.wrapped("  ", &format!("At the source: {}.", shared.at_source.trim_end_matches('.')), Ink::Plain);
            }
        }
        let [axis, first, second, third] = story.head;
        let wide = |of: &dyn Fn(&Row) -> &str, head: &str| {
            let longest = story.rows.iter().map(|row| of(row).chars().count()).max().unwrap_or(0);
            longest.max(head.len())
        };
        let (a, w, s) = (wide(&|r| &r.axis, axis), wide(&|r| &r.cells[0], first), wide(&|r| &r.cells[1], second));
        let head = self.terminal.paint(Ink::Quiet, &format!("{axis:a$}  {first:w$}  {second:s$}  {third}"));
        self.line(&format!("\n{head}"));
        for row in &story.rows {
            let [what, size, left] = &row.cells;
            let what = self.terminal.paint(Ink::Strong, &format!("{what:w$}"));
            let wide = left.chars().count();
            let left = self.terminal.paint(if row.won { Ink::Good } else { Ink::Plain }, left);
            if a + w + s + wide + 6 > self.terminal.width && wide > 0 {
                // Too narrow: the last one has a line of its own.
                self.line(&format!("{:a$}  {what}  {size:s$}", row.axis));
                self.line(&format!("{:a$}  {left}", ""));
            } else {
                self.line(&format!("{:a$}  {what}  {size:s$}  {left}", row.axis));
            }
        }
    }

    /// One axis, or several of which the same is said.
    fn axes(&mut self, alike: &[AxisView], tests: bool) {
        let [axis, others @ ..] = alike else { return };
        let ink = match axis.tone {
            "good" => Ink::Good,
            "bad" => Ink::Bad,
            _ => Ink::Warn,
        };
        self.text.push('\n');
        if let [.., last] = others {
            let before: Vec<&str> = alike[..others.len()].iter().map(|axis| axis.axis).collect();
            self.line(&format!("axes {} and {}", before.join(", "), last.axis));
        }
        let start = self.text.len();
        self.wrapped("        ", &axis.headline, ink);
        if others.is_empty() {
            self.text.replace_range(start..start + 8, &format!("axis {}  ", axis.axis));
        }
        if !axis.at_source.is_empty() {
            self.wrapped("        ", &format!("At the source: {}.", axis.at_source), Ink::Plain);
        }
        self.wrapped("        ", &format!("Verdict: {}.", axis.label), Ink::Quiet);
        self.wrapped("        ", &axis.says, Ink::Quiet);
        if !axis.ends {
            self.measured(axis);
        } else if axis.steps.len() > 1 {
            self.steps(axis);
        }
        for axis in alike {
            self.explained(axis, tests);
            self.faults("data faults", &axis.data_faults);
        }
    }

    /// What the log says of the model.
    fn measured(&mut self, axis: &AxisView) {
        self.limit(axis);
        self.steps(axis);
        self.curve(axis);
        self.parameters(axis);
        if !axis.fails_where.is_empty() {
            self.heading("where it fails");
            for says in &axis.fails_where {
                self.item("  · ", says);
            }
        }
        self.suspects(axis);
    }

    fn faults(&mut self, heading: &str, faults: &[String]) {
        if !faults.is_empty() {
            self.heading(heading);
            for says in faults {
                self.item("  ! ", says);
            }
        }
    }

    /// What limits the log, and what its error² is made of at a few averaging times.
    fn limit(&mut self, axis: &AxisView) {
        let Some(limit) = &axis.limit else { return };
        self.heading(&format!("{}: {}", limit.head, limit.by));
        self.wrapped("  ", &limit.says, Ink::Plain);
        let shown: Vec<usize> = SHOWN
            .iter()
            .filter(|tau| limit.tau.first().is_some_and(|t| *tau > t) && limit.tau.last().is_some_and(|t| *tau < t))
            .filter_map(|tau| {
                let apart = |k: &usize| (limit.tau[*k] / tau).ln().abs();
                (0..limit.tau.len()).min_by(|a, b| apart(a).total_cmp(&apart(b)))
            })
            .collect();
        if shown.is_empty() {
            return;
        }
        let taus: Vec<String> = shown.iter().map(|&k| format!("{:>9}", units::time(limit.tau[k]))).collect();
        let lead = self.terminal.paint(Ink::Quiet, "share of the error²");
        self.line(&format!("  {lead} {}", taus.concat()));
        for part in &limit.parts {
            let shares: Vec<String> = shown.iter().map(|&k| format!("{:>7.0} %", part.share[k])).collect();
            self.line(&format!("  {:<19} {}", part.name, shares.concat()));
        }
    }

    fn steps(&mut self, axis: &AxisView) {
        if axis.steps.is_empty() {
            return;
        }
        self.heading("error ÷ floor at its worst, step by step (bar: log scale)");
        let wide = axis.steps.iter().map(|s| s.label.chars().count()).max().unwrap_or(0);
        let room = self.terminal.width.saturating_sub(wide + 39).clamp(10, 50);
        for (step, cells) in axis.steps.iter().zip(bars::step_cells(&axis.steps, room)) {
            let ratio = step.ratio.map_or_else(|| "–".into(), units::ratio);
            let at_1s = step.error_1s.map_or_else(String::new, |e| format!("  {} °/s at 1 s", units::number(e)));
            let (won, at_1s) = if step.won.is_empty() {
                (String::new(), at_1s)
            } else {
                (self.terminal.paint(Ink::Good, &format!("  {}", step.won)), String::new())
            };
            let alias =
                if step.aliases.is_empty() { String::new() } else { format!("  or {}", step.aliases.join(" or ")) };
            let bar = "█".repeat(cells);
            let rest = self.terminal.paint(Ink::Quiet, &format!("{at_1s}{alias}"));
            self.line(&format!("  {:wide$}  {bar} {ratio}{won}{rest}", step.label));
        }
    }

    fn curve(&mut self, axis: &AxisView) {
        let mut rows = bars::rows(axis);
        rows.dedup_by_key(|row| units::time(row.tau));
        if rows.is_empty() {
            return;
        }
        let pair = rows.iter().any(|r| r.before.is_some());
        self.heading("drift over a time τ, on data not used for the fit");
        let band = self.terminal.width >= BANDED;
        let drift = self.terminal.width >= DRIFTED;
        let columns = 39 + if pair { 10 } else { 0 } + if band { 14 } else { 0 } + if drift { 11 } else { 0 };
        let width = self.terminal.width.saturating_sub(columns).clamp(8, 48);
        let scale = Scale::around(rows.iter().flat_map(|r| [r.before, r.error, r.floor, r.floor_99]).flatten(), width);
        let other = axis.curves.first().map_or("", |curve| curve.label.as_str());
        let other = if other.chars().count() < 10 { other } else { "other" };
        let before = if pair { format!("{other:>10}") } else { String::new() };
        let legend = match width {
            28.. => "█ within the floor  ▒ above",
            _ => "▒ above floor",
        };
        let scale_says = match (width, pair) {
            (40.., true) => "· before the change; log scale",
            (28.., true) => "· before; log scale",
            (12.., true) => "· before",
            (12.., false) => "log scale",
            _ => "",
        };
        let legend = self.terminal.paint(Ink::Quiet, if width >= 12 { legend } else { "" });
        let scale_says = self.terminal.paint(Ink::Quiet, scale_says);
        let head = |upper: &str, angle: &str| {
            let upper = if band { format!("{upper:>14}") } else { String::new() };
            let angle = if drift { format!("{angle:>11}") } else { String::new() };
            (angle, upper)
        };
        let (angle, upper) = head("floor stays", "angle");
        self.line(&format!("  {:>8}{before}{:>9}{angle}{:>9}{upper}{:>9}  {legend}", "τ", "error", "floor", "error ÷"));
        let (angle, upper) = head("below (99 %)", "in τ");
        let before = if pair { format!("{:>10}", "°/s") } else { String::new() };
        self.line(&format!("  {:>8}{before}{:>9}{angle}{:>9}{upper}{:>9}  {scale_says}", "", "°/s", "°/s", "floor"));
        for row in &rows {
            let (within, above, before_cells) = bars::parts(row, &scale);
            let above_ink = if above > 0 { Ink::Warn } else { Ink::Plain };
            let bar = format!(
                "{}{}{}",
                "█".repeat(within),
                self.terminal.paint(above_ink, &"▒".repeat(above)),
                self.terminal.paint(Ink::Quiet, &"·".repeat(before_cells))
            );
            let show = |v: Option<f64>| v.map_or_else(|| "–".into(), units::number);
            let before = if pair { format!("{:>10}", show(row.before)) } else { String::new() };
            let ratio =
                row.error.zip(row.floor).filter(|r| r.1 > 0.0).map_or_else(|| "–".into(), |(e, f)| units::ratio(e / f));
            let angle = row.error.map_or_else(|| "–".into(), |error| format!("{}°", units::number(error * row.tau)));
            let (angle, upper) = head(&show(row.floor_99), &angle);
            self.line(&format!(
                "  {:>8}{before}{:>9}{angle}{:>9}{upper}{ratio:>9}  {bar}",
                units::time(row.tau),
                show(row.error),
                show(row.floor)
            ));
        }
        self.wrapped("  ", &axis.drift, Ink::Plain);
        if !axis.floor_source.is_empty() {
            self.wrapped(
                "  ",
                &format!("floor: what noise and the limits of the set-up alone would leave ({})", axis.floor_source),
                Ink::Quiet,
            );
        }
    }

    fn parameters(&mut self, axis: &AxisView) {
        if axis.parameters.is_empty() {
            return;
        }
        self.heading("model");
        self.table(&axis.parameters, "  ");
        if !axis.noise.is_empty() {
            self.wrapped("  ", &axis.noise, Ink::Quiet);
        }
    }

    fn table(&mut self, parameters: &[ParameterView], indent: &str) {
        let name = |p: &ParameterView| format!("{} {}", p.effect, p.name);
        let wide = parameters.iter().map(|p| name(p).chars().count()).max().unwrap_or(0);
        let shown = parameters.iter().map(|p| p.shown.chars().count()).max().unwrap_or(0);
        for p in parameters {
            let room = self.terminal.width.saturating_sub(indent.len() + wide + shown + 4);
            let says: String = if p.says.chars().count() > room { String::new() } else { p.says.clone() };
            let says = self.terminal.paint(Ink::Quiet, &says);
            self.line(&format!("{indent}{:wide$}  {:shown$}  {says}", name(p), p.shown));
        }
    }

    fn suspects(&mut self, axis: &AxisView) {
        if axis.suspects.is_empty() {
            return;
        }
        self.heading(axis.suspects_head);
        for suspect in axis.suspects.iter().take(SUSPECTS) {
            let values: Vec<String> = suspect.parameters.iter().map(ParameterView::equation).collect();
            let name = self.terminal.paint(Ink::Strong, &suspect.effect);
            let pad = " ".repeat(24usize.saturating_sub(suspect.effect.chars().count()));
            let room = self.terminal.width >= 36 + suspect.card.title.chars().count();
            let title = if room { suspect.card.title.as_str() } else { "" };
            self.line(&format!("{:>6}  {name}{pad} {title}", suspect.removes));
            if !room {
                self.wrapped("          ", &suspect.card.title, Ink::Plain);
            }
            self.wrapped("          ", &values.join(", "), Ink::Plain);
            if !suspect.significance.is_empty() {
                let says = format!("chance that noise alone looks like this: {}", suspect.significance);
                self.wrapped("          ", &says, Ink::Quiet);
            }
            if !suspect.odds.is_empty() {
                let says = format!("odds against the next suspect: {}", suspect.odds);
                self.wrapped("          ", &says, Ink::Quiet);
            }
            if !suspect.card.typical.is_empty() {
                self.wrapped("          ", &format!("usual: {}", suspect.card.typical), Ink::Quiet);
            }
            if !suspect.aliases.is_empty() {
                let ids: Vec<&str> = suspect.aliases.iter().map(|a| a.id.as_str()).collect();
                self.wrapped("          ", &labels::cannot_be_told(&ids), Ink::Warn);
                if !suspect.separate_by.is_empty() {
                    self.wrapped("          ", &format!("to tell them apart: {}", suspect.separate_by), Ink::Warn);
                }
            }
        }
        if axis.suspects.len() > SUSPECTS {
            let more = format!("  and {} more (--format html)", axis.suspects.len() - SUSPECTS);
            let more = self.terminal.paint(Ink::Quiet, &more);
            self.line(&more);
        }
    }
}

impl Screen {
    /// Each suspect in a sentence; with the tests that it passed and failed.
    fn explained(&mut self, axis: &AxisView, tests: bool) {
        if axis.explained.is_empty() {
            return;
        }
        self.heading("why each effect is named, or is not");
        self.reasons(&axis.explained, tests);
    }

    fn reasons(&mut self, all: &[ExplainedView], tests: bool) {
        let wide = all.iter().map(|e| e.effect.chars().count()).max().unwrap_or(0);
        // What is said of several is said once.
        let same = |e: &ExplainedView| all.iter().filter(|other| other.says == e.says).count() > 2;
        let mut shared: Vec<(&str, Vec<&str>)> = Vec::new();
        for explained in all {
            if !tests && same(explained) {
                match shared.iter_mut().find(|(says, _)| *says == explained.says) {
                    Some((_, effects)) => effects.push(&explained.effect),
                    None => shared.push((&explained.says, vec![&explained.effect])),
                }
                continue;
            }
            let name = self.terminal.paint(Ink::Strong, &format!("{:wide$}", explained.effect));
            let start = self.text.len();
            let indent = " ".repeat(wide + 4);
            self.wrapped(&indent, if tests { &explained.outcome } else { &explained.says }, Ink::Plain);
            self.text.replace_range(start..start + indent.len(), &format!("  {name}  "));
            for test in explained.tests.iter().filter(|_| tests) {
                self.item(&format!("      {:4}  ", test.mark), &format!("{}: {}", test.name, test.numbers));
            }
        }
        for (says, effects) in shared {
            let start = self.text.len();
            let indent = " ".repeat(wide + 4);
            self.wrapped(&indent, &format!("{says}: {}", effects.join(", ")), Ink::Plain);
            self.text.replace_range(start..start + indent.len(), &format!("  {:wide$}  ", "others"));
        }
    }
}
