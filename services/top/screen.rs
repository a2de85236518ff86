//! One picture of a running pipeline.

use super::Scene;
use crate::{dashboard::judgement, live::words};
use ipc_types::Status;
use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style},
    symbols::Marker,
    text::{Line, Span},
    widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Row, Sparkline, Table, Wrap},
};
use workbench::report::{units, view::AxisView};

/// Draws everything; what has no room is left out, the verdict last.
pub(super) fn draw(frame: &mut Frame, scene: &Scene) {
    let area = frame.area();
    let [head, middle, motion, bottom, foot] = Layout::vertical([
        Constraint::Length(if area.height >= 30 { 7 } else { 5 }),
        Constraint::Min(8),
        Constraint::Length(if area.height >= 30 { 5 } else { 0 }),
        Constraint::Length(if area.height >= 24 { 10 } else { 0 }),
        Constraint::Length(1),
    ])
    .areas(area);
    let page = scene.diagnosis.as_ref().map(judgement::page);
    let letter = ["x", "y", "z"][scene.axis];
    let view = page.as_ref().and_then(|p| p.axes.iter().find(|a| a.axis == letter));
    verdict(frame, head, scene, view);
    let [left, right] = Layout::horizontal([Constraint::Percentage(55), Constraint::Percentage(45)]).areas(middle);
    curve(frame, left, view);
    let [above, below] = Layout::vertical([Constraint::Percentage(50), Constraint::Percentage(50)]).areas(right);
    suspects(frame, above, view);
    parameters(frame, below, scene);
    residual(frame, motion, scene);
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

fn verdict(frame: &mut Frame, area: Rect, scene: &Scene, view: Option<&AxisView>) {
    let looking = scene.looking[scene.axis].as_deref();
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
            Line::styled(line, style)
        });
        let title = format!(" truerate: {} ", scene.instance);
        let text: Vec<Line> = lines.collect();
        frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }).block(Block::bordered().title(title)), area);
        return;
    }
    let headline = view.map_or_else(
        || "looking: the first diagnosis comes after some seconds of motion".to_owned(),
        |v| match looking {
            Some(looking) => format!("axis {}  {looking} So far: {}", v.axis, v.headline),
            None => format!("axis {}  {}", v.axis, v.headline),
        },
    );
    let label = view.map_or_else(String::new, |v| {
        let ratio = v.error_over_floor.map_or_else(String::new, |r| format!("   error ÷ noise {}", units::ratio(r)));
        format!("{}{ratio}", v.label)
    });
    let source = view
        .filter(|v| looking.is_none() && !v.at_source.is_empty())
        .map(|v| format!("at the source: {}", v.at_source));
    let mut text = vec![Line::styled(headline, Style::new().fg(colour).add_modifier(Modifier::BOLD))];
    text.extend(source.map(Line::raw));
    text.push(Line::styled(label, Style::new().add_modifier(Modifier::DIM)));
    let title = format!(" truerate: {} ", scene.instance);
    frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }).block(Block::bordered().title(title)), area);
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
    let rows = view.into_iter().flat_map(|v| &v.suspects).map(|s| {
        let values: Vec<String> = s.parameters.iter().map(|p| format!("{} {}", p.name, p.shown)).collect();
        let aliases: Vec<&str> = s.aliases.iter().map(|a| a.id.as_str()).collect();
        let alias = if aliases.is_empty() { String::new() } else { format!(" or {}", aliases.join(", ")) };
        Row::new([format!("{}{alias}", s.effect), s.removes.clone(), values.join(", ")])
    });
    let widths = [Constraint::Fill(3), Constraint::Length(7), Constraint::Fill(3)];
    let header = Row::new(["suspect", "removes", ""]).style(Style::new().add_modifier(Modifier::DIM));
    frame.render_widget(
        Table::new(rows, widths).header(header).block(Block::bordered().title(" may be missing ")),
        area,
    );
}

fn parameters(frame: &mut Frame, area: Rect, scene: &Scene) {
    let letter = ["x", "y", "z"][scene.axis];
    let axis = scene.model.iter().flat_map(|m| &m.axes).find(|a| a.axis == letter);
    let rows = axis
        .into_iter()
        .flat_map(|a| &a.parameters)
        .map(|p| Row::new([format!("{} {}", p.effect, p.name), p.shown.clone()]));
    let title = scene.model.as_ref().map_or_else(|| " model ".to_owned(), |m| format!(" model, epoch {} ", m.epoch));
    let learning = scene.status.as_ref().map(|s| s.learning.as_str()).filter(|says| !says.is_empty());
    let foot = learning.map_or_else(String::new, |says| format!(" learning {says} "));
    let widths = [Constraint::Fill(1), Constraint::Fill(1)];
    frame.render_widget(Table::new(rows, widths).block(Block::bordered().title(title).title_bottom(foot)), area);
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
        Scene { instance: "yaw".into(), axis: 2, diagnosis: Some(judgement::of_message(&message)), ..Scene::default() }
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
        let screen = picture(&Scene { looking: [None, None, Some(looking.to_owned())], ..scene() }, 130, 40);
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
