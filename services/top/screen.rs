//! One picture of a running pipeline.

use super::Scene;
use crate::{dashboard::judgement, live::words};
use ipc_types::Status;
use ratatui::{
    Frame,
    buffer::Buffer,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style},
    symbols::Marker,
    text::{Line, Span},
    widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Row, Sparkline, Table, Widget, Wrap},
};
use workbench::report::{
    units,
    view::{AxisView, SuspectView},
};

/// Columns of a suspect's name and of what is alike, at least and at most.
const NAMES: (usize, usize) = (12, 36);

/// Draws everything; what has no room is left out, the verdict last.
pub(super) fn draw(frame: &mut Frame, scene: &Scene) {
    let area = frame.area();
    let page = scene.found.diagnosis.as_ref().map(judgement::page);
    let letter = ["x", "y", "z"][scene.axis];
    let view = page.as_ref().and_then(|p| p.axes.iter().find(|a| a.axis == letter));
    let words = verdict(scene, view);
    // The reason is never cut, as far as there is a screen.
    let lines = height(&words, area.width.saturating_sub(2).max(1));
    let usual = if area.height >= 30 { 7 } else { 5 };
    let high = (lines + 2).max(usual).min(area.height.saturating_sub(1));
    // Latencies go before the model and the names of what may be missing.
    let (has_motion, has_tables) = (area.height >= 36, area.height >= 30);
    let [head, middle, motion, bottom, states, foot] = Layout::vertical([
        Constraint::Length(high),
        Constraint::Min(0),
        Constraint::Length(if has_motion { 5 } else { 0 }),
        Constraint::Length(if has_tables { 10 } else { 0 }),
        Constraint::Length(u16::from(!has_tables)),
        Constraint::Length(1),
    ])
    .areas(area);
    let title = format!(" truerate: {} ", scene.instance);
    let block = Block::bordered().title(title);
    frame.render_widget(Paragraph::new(words).wrap(Wrap { trim: true }).block(block), head);
    let of_curve = if area.width >= 100 { 55 } else { 40 };
    let parts = [Constraint::Percentage(of_curve), Constraint::Percentage(100 - of_curve)];
    let [left, right] = Layout::horizontal(parts).areas(middle);
    curve(frame, left, view);
    let [above, below] = Layout::vertical([Constraint::Percentage(50), Constraint::Percentage(50)]).areas(right);
    suspects(frame, above, view);
    parameters(frame, below, scene);
    residual(frame, motion, scene);
    frame.render_widget(Line::from(in_a_line(scene)), states);
    let [left, right] = Layout::horizontal([Constraint::Percentage(45), Constraint::Percentage(55)]).areas(bottom);
    processes(frame, left, scene);
    latencies(frame, right, scene);
    let keys = "q quit   tab axis   a add the best suspect   u undo   p pause or resume   ";
    frame.render_widget(
        Line::from(vec![
            Span::styled(keys, Style::new().add_modifier(Modifier::DIM)),
            Span::raw(scene.notice.as_str()),
        ]),
        foot,
    );
}

/// Lines that a text takes in a block of this width.
fn height(words: &[Line<'static>], width: u16) -> u16 {
    const MOST: u16 = 60;
    let area = Rect::new(0, 0, width, MOST);
    let mut buffer = Buffer::empty(area);
    Paragraph::new(words.to_vec()).wrap(Wrap { trim: true }).render(area, &mut buffer);
    let is_blank = |y: u16| (0..width).all(|x| buffer.cell((x, y)).is_none_or(|cell| cell.symbol() == " "));
    (0..MOST).rev().find(|y| !is_blank(*y)).map_or(0, |last| last + 1)
}

/// The processes where there is no room for their table: those that do not run, or that all do.
fn in_a_line(scene: &Scene) -> String {
    let Some(status) = &scene.status else { return String::new() };
    let resting: Vec<String> = (status.listed_services())
        .filter(|s| s.state.as_str() != "running")
        .map(|s| format!("{} {}", s.name, s.state))
        .collect();
    let processes = if resting.is_empty() { "all processes run".to_owned() } else { resting.join(", ") };
    let lost: u64 = status.listed_services().map(|s| s.lost).sum();
    let source = words::text(&status.source).map_or_else(String::new, |source| format!("; source {source}"));
    format!("{processes}; {lost} rows lost{source}")
}

/// What was found, and what learning waits for.
fn verdict(scene: &Scene, view: Option<&AxisView>) -> Vec<Line<'static>> {
    let looking = scene.found.looking[scene.axis].as_deref();
    let said = view.map(|v| scene.found.said(v));
    let is_won = said.as_ref().is_some_and(|said| said.is_won);
    let colour = match view.map(|v| v.tone) {
        _ if looking.is_some() => Color::Magenta,
        Some("good") => Color::Green,
        Some("bad") => Color::Red,
        Some("warn") => Color::Yellow,
        _ => Color::Magenta,
    };
    let trouble = scene.status.as_ref().and_then(|s| words::trouble(&s.source)).filter(|_| view.is_none());
    if let Some(trouble) = trouble {
        let lines = trouble.lines().enumerate().map(|(k, line)| {
            let style = if k == 0 { Style::new().fg(Color::Red).add_modifier(Modifier::BOLD) } else { Style::new() };
            Line::styled(line.to_owned(), style)
        });
        return lines.collect();
    }
    let headline = view.zip(said.as_ref()).map_or_else(
        || "looking: the first diagnosis comes after some seconds of motion".to_owned(),
        |(v, said)| format!("axis {}  {}", v.axis, said.first),
    );
    let then = said.and_then(|said| said.then).map(|then| Line::styled(then, Style::new().fg(colour)));
    // What was won is good, whatever else there is.
    let first = if is_won { Color::Green } else { colour };
    let label = view.map_or_else(String::new, |v| {
        let ratio = v.error_over_floor.map_or_else(String::new, |r| format!("   error ÷ noise {}", units::ratio(r)));
        format!("{}{ratio}", v.label)
    });
    let source = view
        .filter(|v| looking.is_none() && !v.at_source.is_empty())
        .map(|v| format!("at the source: {}", v.at_source));
    let mut text = vec![Line::styled(headline, Style::new().fg(first).add_modifier(Modifier::BOLD))];
    text.extend(then);
    text.extend(source.map(Line::raw));
    let learning = scene.status.as_ref().map(|s| s.learning.as_str()).filter(|says| !says.is_empty());
    text.extend(learning.map(|says| Line::raw(format!("learning {says}"))));
    text.push(Line::styled(label, Style::new().add_modifier(Modifier::DIM)));
    text
}

/// log₁₀ of the points of a curve that have a value.
fn logarithms(tau: &[f64], values: &[Option<f64>]) -> Vec<(f64, f64)> {
    let pairs = tau.iter().zip(values).filter_map(|(t, v)| v.filter(|v| *v > 0.0).map(|v| (t.log10(), v.log10())));
    pairs.collect()
}

fn curve(frame: &mut Frame, area: Rect, view: Option<&AxisView>) {
    let block = Block::bordered().title(" drift rate and its floor, °/s over τ ");
    let Some(judged) = view.and_then(|v| v.curves.get(v.judged)).filter(|c| !c.tau.is_empty()) else {
        frame.render_widget(block, area);
        return;
    };
    let (error, floor) = (logarithms(&judged.tau, &judged.error), logarithms(&judged.tau, &judged.floor));
    let all = || error.iter().chain(&floor);
    let bounds = |pick: fn(&(f64, f64)) -> f64| {
        let low = all().map(pick).fold(f64::INFINITY, f64::min);
        let high = all().map(pick).fold(f64::NEG_INFINITY, f64::max);
        if low < high { [low, high] } else { [low - 0.5, low + 0.5] }
    };
    let (x, y) = (bounds(|p| p.0), bounds(|p| p.1));
    if !(x[0].is_finite() && y[0].is_finite()) {
        frame.render_widget(block, area);
        return;
    }
    let labels = |b: [f64; 2], unit: &str| {
        [b[0], 0.5 * (b[0] + b[1]), b[1]].map(|v| format!("{}{unit}", units::round(10f64.powf(v)))).to_vec()
    };
    let line = |name: &'static str, points, colour| {
        Dataset::default()
            .name(name)
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(colour))
            .data(points)
    };
    let chart = Chart::new(vec![line("floor", &floor, Color::Green), line("error", &error, Color::Cyan)])
        .block(block)
        .x_axis(Axis::default().bounds(x).labels(labels(x, " s")))
        .y_axis(Axis::default().bounds(y).labels(labels(y, "")));
    frame.render_widget(chart, area);
}

fn suspects(frame: &mut Frame, area: Rect, view: Option<&AxisView>) {
    let name = |s: &SuspectView| {
        let aliases: Vec<&str> = s.aliases.iter().map(|a| a.id.as_str()).collect();
        if aliases.is_empty() { s.effect.clone() } else { format!("{} or {}", s.effect, aliases.join(", ")) }
    };
    let suspects = || view.into_iter().flat_map(|v| &v.suspects);
    let rows = suspects().map(|s| {
        let values: Vec<String> = s.parameters.iter().map(|p| format!("{} {}", p.name, p.shown)).collect();
        Row::new([name(s), s.removes.clone(), values.join(", ")])
    });
    let longest = suspects().map(|s| name(s).chars().count()).max().unwrap_or(0);
    let widths =
        [Constraint::Length(longest.clamp(NAMES.0, NAMES.1) as u16), Constraint::Length(7), Constraint::Fill(1)];
    let header = Row::new(["suspect", "removes", ""]).style(Style::new().add_modifier(Modifier::DIM));
    frame.render_widget(
        Table::new(rows, widths).header(header).block(Block::bordered().title(" may be missing ")),
        area,
    );
}

fn parameters(frame: &mut Frame, area: Rect, scene: &Scene) {
    let letter = ["x", "y", "z"][scene.axis];
    let axis = scene.found.model.iter().flat_map(|m| &m.axes).find(|a| a.axis == letter);
    let rows: Vec<[String; 2]> = (axis.into_iter().flat_map(|a| &a.parameters))
        .map(|p| [format!("{} {}", p.effect, p.name), p.shown.clone()])
        .collect();
    let longest = rows.iter().map(|[_, shown]| shown.chars().count()).max().unwrap_or(0);
    let title =
        scene.found.model.as_ref().map_or_else(|| " model ".to_owned(), |m| format!(" model, epoch {} ", m.epoch));
    let widths = [Constraint::Fill(1), Constraint::Length(u16::try_from(longest).unwrap_or(u16::MAX))];
    let rows = rows.into_iter().map(Row::new);
    frame.render_widget(Table::new(rows, widths).block(Block::bordered().title(title)), area);
}

fn residual(frame: &mut Frame, area: Rect, scene: &Scene) {
    let line = &scene.residuals[scene.axis];
    let width = usize::from(area.width.saturating_sub(2));
    let shown: Vec<u64> = line.iter().skip(line.len().saturating_sub(width)).map(|r| (r.abs() * 1e4) as u64).collect();
    let largest = shown.iter().max().map_or(0.0, |&m| m as f64 * 1e-4);
    let title = format!(" |model − measured|, at most {} °/s ", units::number(largest));
    frame.render_widget(Sparkline::default().data(shown).block(Block::bordered().title(title)), area);
}

fn processes(frame: &mut Frame, area: Rect, scene: &Scene) {
    let rows = scene.status.iter().flat_map(Status::listed_services).map(|s| {
        let colour = match s.state.as_str() {
            "running" => Color::Green,
            "failed" => Color::Red,
            "stopped" => Color::Reset,
            _ => Color::Yellow,
        };
        Row::new([
            Span::raw(s.name.as_str().to_owned()),
            Span::styled(s.state.as_str().to_owned(), Style::new().fg(colour)),
            Span::raw(s.restarts.to_string()),
            Span::raw(s.received.to_string()),
            Span::raw(s.lost.to_string()),
        ])
    });
    let widths = [
        Constraint::Fill(3),
        Constraint::Length(10),
        Constraint::Length(8),
        Constraint::Length(10),
        Constraint::Length(5),
    ];
    let source = scene.status.as_ref().and_then(|s| words::text(&s.source));
    let block = Block::bordered().title(source.map_or_else(String::new, |source| format!(" source {source} ")));
    let header =
        Row::new(["process", "state", "restarts", "taken", "lost"]).style(Style::new().add_modifier(Modifier::DIM));
    frame.render_widget(Table::new(rows, widths).header(header).block(block), area);
}

fn latencies(frame: &mut Frame, area: Rect, scene: &Scene) {
    let us = |ns: u64| format!("{:.1}", ns as f64 * 1e-3);
    let rows = scene
        .status
        .iter()
        .flat_map(Status::listed_stages)
        .map(|s| Row::new([s.stage.as_str().to_owned(), us(s.p50_ns), us(s.p99_ns), us(s.p999_ns), us(s.max_ns)]));
    let widths = [
        Constraint::Fill(1),
        Constraint::Length(8),
        Constraint::Length(9),
        Constraint::Length(9),
        Constraint::Length(10),
    ];
    let header =
        Row::new(["stage (µs)", "median", "99 %", "99.9 %", "worst"]).style(Style::new().add_modifier(Modifier::DIM));
    frame.render_widget(Table::new(rows, widths).header(header).block(Block::bordered()), area);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dashboard::model, found::Found};
    use ipc_types::{Text, diagnosis::ErrorPoint};
    use ratatui::{Terminal, backend::TestBackend};

    fn picture(scene: &Scene, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, scene)).unwrap();
        terminal.backend().to_string()
    }

    fn scene() -> Scene {
        let mut message = ipc_types::Diagnosis::default();
        let axis = &mut message.axes[2];
        (axis.present, axis.verdict, axis.error_over_floor) = (1, Text::new("missing-effect"), 9.0);
        axis.suspects[0].effect = Text::new("delay");
        axis.suspects[0].error_fall = 0.97;
        for (point, tau) in axis.curve.iter_mut().zip([0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4]) {
            *point = ErrorPoint { tau, error: 0.02, floor: 0.01 / tau.sqrt(), floor_99: f64::NAN };
        }
        let found = Found { diagnosis: Some(judgement::of_message(&message)), ..Found::default() };
        Scene { instance: "yaw".into(), axis: 2, found, ..Scene::default() }
    }

    #[test]
    fn the_verdict_the_suspect_and_the_curve_are_on_the_screen() {
        let screen = picture(&scene(), 110, 40);
        for text in ["missing effect: delay", "error ÷ noise 9.0", "97 %", "drift rate", "q quit"] {
            assert!(screen.contains(text), "{text}:\n{screen}");
        }
        assert!(screen.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "no curve:\n{screen}");
    }

    #[test]
    fn a_diagnosis_that_may_still_change_is_no_answer_yet() {
        let looking = "More than noise is left. Looking for the cause: 12 of 30 s of motion seen.";
        let mut scene = scene();
        scene.found.looking = [None, None, Some(looking.to_owned())];
        let screen = picture(&scene, 130, 40);
        for text in ["axis z  More than noise is left.", "12 of 30 s of motion seen. So far: 'delay' is missing"] {
            assert!(screen.contains(text), "{text}:\n{screen}");
        }
    }

    #[test]
    fn a_live_source_and_what_learning_waits_for_are_on_the_screen() {
        let mut status = Status::default();
        (status.source.link, status.source.garbled) = (ipc_types::health::Link::Lost as u32, 3);
        status.learning = Text::new("waits: 40 of 100 rows are there");
        let screen = picture(&Scene { status: Some(status), ..scene() }, 130, 40);
        for text in ["source lost, 0 rows, 3 garbled", "learning waits: 40 of 100 rows are there"] {
            assert!(screen.contains(text), "{text}:\n{screen}");
        }
    }

    #[test]
    fn on_a_small_screen_the_reason_the_model_and_the_names_stay_and_latencies_go() {
        let waits =
            "waits: scale-factor.alpha of axis z is known to ± 2.24 %, and 2 % is typical; turn it faster, both ways";
        let status = Status { learning: Text::new(waits), ..Status::default() };
        let mut scene = Scene { status: Some(status), ..scene() };
        let parameter = |effect: &str, name: &str, shown: &str| model::Shown {
            key: String::new(),
            effect: effect.into(),
            name: name.into(),
            says: String::new(),
            shown: shown.into(),
            typical: String::new(),
            unit: String::new(),
        };
        let parameters = vec![
            parameter("scale-factor", "alpha", "0.988126 ± 0.000014"),
            parameter("bias", "delta", "−0.5926 ± 0.0014 °/s"),
        ];
        let axes = vec![model::AxisView { axis: "z", effects: Vec::new(), parameters }];
        scene.found.model = Some(model::ModelView { epoch: 7, paused: false, samples: 0, axes });
        let screen = picture(&scene, 80, 24);
        // A line of the picture is within quotation marks; a word may end where its block does.
        let plain: String = screen.replace(['"', '│', '\n'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
        for text in ["known to ± 2.24 %, and 2 % is typical; turn it faster, both ways", "missing effect: delay"] {
            assert!(plain.contains(text), "{text}:\n{screen}");
        }
        for text in ["scale-factor alpha", "0.988126 ± 0.000014", "−0.5926 ± 0.0014 °/s", "delay", "all processes run"]
        {
            assert!(screen.contains(text), "{text}:\n{screen}");
        }
        assert!(!screen.contains("99.9 %"), "{screen}");
    }

    #[test]
    fn a_source_that_is_not_understood_is_the_first_that_is_said() {
        let mut status = Status::default();
        status.source.link = ipc_types::health::Link::Connected as u32;
        status.source.trouble = Text::new("not understood: 2910 lines such as `830⇥60.45`\nno time");
        let scene = Scene { status: Some(status), instance: "yaw".into(), axis: 2, ..Scene::default() };
        let screen = picture(&scene, 80, 24);
        assert!(screen.contains("not understood: 2910 lines such as `830⇥60.45`"), "{screen}");
        assert!(!screen.contains("looking") && !screen.contains("source connected"), "{screen}");
    }

    #[test]
    fn any_size_of_terminal_and_nothing_known_yet_are_drawn() {
        for (width, height) in [(20, 5), (40, 12), (80, 24), (300, 90)] {
            picture(&scene(), width, height);
            assert!(!picture(&Scene::default(), width, height).is_empty());
        }
    }
}
