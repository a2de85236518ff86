//! A fleet as one page: sentences, tables, a forest plot of each parameter by log and a caterpillar plot by part. It needs no script.

use super::{
    ChangedRow, CourseRow, Fleet, MisalignedRow, PartRow, PointRow, ShareRow, TypeRow,
    text::{columns, many, sentences, value, with},
};
use crate::{
    report::units::{self, shown},
    web,
};
use gyro_model::pooled::course::ALARM;
use std::fmt::Write as _;

pub(super) fn render(fleet: &Fleet, name: &str) -> String {
    let file =
        std::path::Path::new(name).file_name().map_or_else(|| name.to_owned(), |n| n.to_string_lossy().into_owned());
    let mut body = String::new();
    for line in sentences(fleet) {
        let _ = writeln!(body, "<p>{}</p>", escaped(&line));
    }
    for of_kind in fleet.types.chunk_by(|a, b| a.kind == b.kind) {
        let _ = writeln!(body, "<h2>Type {}</h2>", escaped(&of_kind[0].kind));
        let rows = of_kind.iter().map(|row| columns(row).iter().map(|cell| escaped(cell)).collect()).collect();
        body.push_str(&table(&["parameter", "mean", "between parts", "next part (95 %)", "p", "matters"], rows));
    }
    if !fleet.types.is_empty() {
        body.push_str(LEGEND);
    }
    for row in &fleet.types {
        let _ = writeln!(body, "<h2>{}: {}</h2>", escaped(&row.kind), escaped(&row.label()));
        body.push_str(&forest(row));
        body.push_str(&caterpillar(fleet, row));
    }
    let changed: Vec<_> = fleet.parts.iter().filter(|part| !part.changed.is_empty()).collect();
    if !changed.is_empty() {
        body.push_str("<h2>Changes in time</h2>\n");
        let row = |part: &PartRow, change: &ChangedRow| -> Vec<String> {
            let of = |size: f64, error: f64| escaped(&value(size, Some(error), &part.unit));
            vec![
                escaped(&part.part),
                format!("{} {}", part.axis, escaped(&part.effect)),
                format!("{} ± {} days", change.day, change.days.ceil()),
                of(change.by, change.std_error),
                of(change.before, change.before_error),
                of(change.after, change.after_error),
                escaped(with(change).trim_start_matches(" With it changed: ").trim_end_matches('.')),
            ]
        };
        let rows = changed.iter().flat_map(|part| part.changed.iter().map(move |change| row(part, change))).collect();
        body.push_str(&table(&["part", "parameter", "day", "by", "from", "to", "what changed with it"], rows));
    }
    body.push_str(&misaligned(fleet));
    body.push_str(&in_time(fleet));
    if !fleet.left_out.is_empty() {
        body.push_str("<h2>Left out</h2>\n<ul>\n");
        for own in &fleet.left_out {
            let _ = writeln!(body, "<li>{}: {}</li>", escaped(&own.log), escaped(&own.why));
        }
        body.push_str("</ul>\n");
    }
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         style-src 'unsafe-inline'; img-src data:\">\n<link rel=\"icon\" href=\"data:,\">\n<title>Fleet: {file}</title>\n<style>{}\n{STYLE}\
         </style>\n</head>\n<body>\n<header><div class=\"bar\"><div class=\"grow\"><h1>Fleet</h1><div class=\"soft log\">{file}</div>\
         <div class=\"soft small about\">{} · {}</div></div></div></header>\n<main>\n{body}</main>\n</body>\n</html>\n",
        web::STYLE,
        many(fleet.logs, "log"),
        many(fleet.part_count, "part"),
        file = escaped(&file),
    )
}

/// What is drawn in the plots.
const LEGEND: &str = "<p class=\"soft small legend\"><svg viewBox=\"0 0 40 12\" width=\"40\" height=\"12\"><line class=\"own\" x1=\"2\" x2=\"38\" \
y1=\"6\" y2=\"6\"/><circle class=\"own\" cx=\"20\" cy=\"6\" r=\"3\"/></svg> an estimate with its 95 % interval \
<svg viewBox=\"0 0 40 12\" width=\"40\" height=\"12\"><line class=\"out\" x1=\"2\" x2=\"38\" y1=\"6\" y2=\"6\"/><circle class=\"out\" cx=\"20\" cy=\"6\" \
r=\"3\"/></svg> not of its type <svg viewBox=\"0 0 40 12\" width=\"40\" height=\"12\"><rect class=\"band\" x=\"2\" y=\"0\" width=\"36\" height=\"12\"/>\
<line class=\"mean\" x1=\"20\" x2=\"20\" y1=\"0\" y2=\"12\"/></svg> mean of the type, and where the next part lies (95 %) \
<svg viewBox=\"0 0 40 12\" width=\"40\" height=\"12\"><line class=\"nothing\" x1=\"20\" x2=\"20\" y1=\"0\" y2=\"12\"/></svg> zero</p>\n";

const STYLE: &str = "main table{border-collapse:collapse;margin:.5rem 0}main td,main th{padding:.15rem .9rem .15rem 0;text-align:left}\
main svg{max-width:100%;height:auto;display:block;margin:.4rem 0}main svg text{fill:currentColor;font:12px system-ui,sans-serif}\
main svg .own{stroke:currentColor;fill:currentColor}main svg .mean{stroke:#2f83d6;fill:#2f83d6}main svg .band{fill:#56b4e9;opacity:.25}\
main svg polyline{fill:none}main svg .course{stroke:#2f83d6;stroke-width:2}main svg .limit{stroke:#d55e00;stroke-dasharray:4 3}\
main svg .out{stroke:#d55e00;fill:#d55e00}main svg .nothing{stroke:currentColor;opacity:.35;stroke-dasharray:4 3}main .legend svg{display:inline-block;vertical-align:-2px;margin:0 .2rem 0 .6rem}\
main .legend svg:first-child{margin-left:0}main svg.narrow{display:none}\
@media(max-width:600px){main svg.wide{display:none}main svg.narrow{display:block}main thead{display:none}\
main tbody tr{display:block;border-bottom:1px solid var(--faint);padding:.4rem 0}main td{display:grid;grid-template-columns:8.5rem minmax(0,1fr);padding:.1rem 0}\
main td::before{content:attr(data-head);color:var(--soft)}main p{overflow-wrap:anywhere}}";

/// Rows of a plot; of more, those farthest from the mean.
const ROWS: usize = 60;
const LINE: f64 = 18.0;

/// How wide a plot is.
struct Frame {
    /// Its class: which screens show it.
    class: &'static str,
    width: f64,
    /// What stands left of the values: names; none where they stand above their lines.
    left: f64,
    /// The same of a chart in time, whose numbers stand there.
    left_of_chart: f64,
    /// From line to line.
    step: f64,
    /// Characters of a name.
    longest: usize,
}

const FRAMES: [Frame; 2] = [
    Frame { class: "wide", width: 860.0, left: 210.0, left_of_chart: 210.0, step: LINE, longest: 30 },
    Frame { class: "narrow", width: 350.0, left: 4.0, left_of_chart: 112.0, step: 2.0 * LINE, longest: 48 },
];

/// A plot on a screen, and on a phone.
fn framed(draw: impl Fn(&Frame) -> String) -> String {
    FRAMES.iter().map(draw).collect()
}

/// One line of a plot.
struct Line {
    name: String,
    value: f64,
    error: f64,
    outlier: bool,
}

/// Every log's estimate with its 95 % interval; the band is where the next part lies.
fn forest(row: &TypeRow) -> String {
    let mut lines: Vec<Line> = row
        .readings
        .iter()
        .map(|own| Line {
            name: format!("{} ({})", own.log, own.part),
            value: own.value,
            error: own.std_error,
            outlier: own.outlier,
        })
        .collect();
    lines.sort_by(|a, b| a.name.cmp(&b.name));
    plot(row, "log by log", lines)
}

/// Every part's best prediction, in order of size.
fn caterpillar(fleet: &Fleet, row: &TypeRow) -> String {
    let own = fleet.parts.iter().filter(|part| {
        part.kind == row.kind && part.axis == row.axis && part.effect == row.effect && part.name == row.name
    });
    let mut lines: Vec<Line> = own
        .map(|part| Line {
            name: part.part.clone(),
            value: part.value,
            error: part.std_error.unwrap_or(0.0),
            outlier: part.outlier,
        })
        .collect();
    lines.sort_by(|a, b| a.value.total_cmp(&b.value));
    plot(row, "part by part, best prediction", lines)
}

fn plot(row: &TypeRow, title: &str, mut lines: Vec<Line>) -> String {
    let more = lines.len().saturating_sub(ROWS);
    if more > 0 {
        // Those farthest off stay, in their order.
        let far = |line: &Line| ((line.value - row.mean) / line.error.max(f64::MIN_POSITIVE)).abs();
        let mut sizes: Vec<f64> = lines.iter().map(far).collect();
        sizes.sort_by(|a, b| b.total_cmp(a));
        let least = sizes[ROWS - 1];
        lines.retain(|line| far(line) >= least);
        lines.truncate(ROWS);
    }
    let ends = lines.iter().flat_map(|line| [line.value - 1.96 * line.error, line.value + 1.96 * line.error]);
    let band = row.next.map_or([row.mean, row.mean], |(low, high)| [low, high]);
    let (low, high) = ends
        .chain(band)
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    if high <= low || !(high - low).is_finite() {
        return String::new();
    }
    framed(|frame| drawn(row, title, &lines, more, ([low, high], band), frame))
}

/// The plot of lines between two values, with the band of the next part.
fn drawn(
    row: &TypeRow,
    title: &str,
    lines: &[Line],
    more: usize,
    ([low, high], band): ([f64; 2], [f64; 2]),
    frame: &Frame,
) -> String {
    let &Frame { class: of_screen, width, left, step, longest, .. } = frame;
    let above = step - LINE;
    let x = |value: f64| left + (width - left - 20.0) * ((value - low) / (high - low)).clamp(0.0, 1.0);
    let height = step * lines.len() as f64 + 3.0 * LINE;
    let mut svg = format!(
        "<svg class=\"{of_screen}\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" role=\"img\" aria-label=\"{}: {title}\"><text x=\"0\" y=\"12\">{title}{}</text>",
        escaped(&row.label()),
        if more > 0 { format!("; {more} nearer to the mean are not drawn") } else { String::new() }
    );
    let (top, bottom) = (LINE + 2.0, height - 1.5 * LINE);
    let _ = write!(
        svg,
        "<rect class=\"band\" x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\"/><line class=\"mean\" x1=\"{m:.1}\" x2=\"{m:.1}\" \
         y1=\"{top:.1}\" y2=\"{bottom:.1}\"/>",
        x(band[0]),
        (x(band[1]) - x(band[0])).max(0.0),
        bottom - top,
        m = x(row.mean),
    );
    if low < 0.0 && high > 0.0 {
        let _ = write!(
            svg,
            "<line class=\"nothing\" x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{top:.1}\" y2=\"{bottom:.1}\"/>",
            x(0.0)
        );
    }
    for (k, line) in lines.iter().enumerate() {
        let y = step * k as f64 + above + 1.5 * LINE + 4.0;
        let class = if line.outlier { "out" } else { "own" };
        let _ = write!(
            svg,
            "<text x=\"0\" y=\"{:.1}\">{}</text><line class=\"{class}\" x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
             <circle class=\"{class}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"3\"/>",
            y + 4.0 - above,
            escaped(&short(&line.name, longest)),
            x(line.value - 1.96 * line.error),
            x(line.value + 1.96 * line.error),
            x(line.value)
        );
    }
    let unit = shown(&row.unit, &[Some(low), Some(high)]);
    for (at, anchor) in [(low, "start"), (0.5 * (low + high), "middle"), (high, "end")] {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{} {}</text>",
            x(at),
            height - 4.0,
            units::within(at * unit.factor, (high - low) * unit.factor),
            escaped(&unit.unit)
        );
    }
    svg.push_str("</svg>\n");
    svg
}

/// What of a misalignment is the mount's, and what the chip's.
fn misaligned(fleet: &Fleet) -> String {
    if fleet.misaligned.is_empty() {
        return String::new();
    }
    let share = |row: &ShareRow, unit: &str| escaped(&value(row.mean, row.std_error, unit));
    let row = |own: &MisalignedRow| {
        vec![
            escaped(&own.kind),
            format!("{}, {}", own.axes[0], own.axes[1]),
            own.about.to_string(),
            share(&own.turned, "rad"),
            share(&own.alike, "1"),
            own.of.name().to_owned(),
        ]
    };
    let head = ["type", "axes", "turned about", "by (the mount's)", "equal (the chip's)", "of"];
    format!("<h2>Mount and chip</h2>\n{}", table(&head, fleet.misaligned.iter().map(row).collect()))
}

/// A table whose cells carry their heads: on a phone each row is a list of them. The cells are HTML.
fn table(head: &[&str], rows: Vec<Vec<String>>) -> String {
    let mut text = String::from("<table><thead><tr>");
    for name in head {
        let _ = write!(text, "<th>{name}</th>");
    }
    text.push_str("</tr></thead><tbody>\n");
    for row in rows {
        text.push_str("<tr>");
        for (cell, head) in row.iter().zip(head) {
            let _ = write!(text, "<td data-head=\"{head}\">{cell}</td>");
        }
        text.push_str("</tr>\n");
    }
    text + "</tbody></table>\n"
}

/// The control charts of parts that have something to show.
fn in_time(fleet: &Fleet) -> String {
    let charts: String = fleet.parts.iter().filter(|part| is_charted(part)).take(CHARTS).map(chart).collect();
    if charts.is_empty() {
        return charts;
    }
    format!(
        "<h2>Parts in time</h2>\n<p>Each log's estimate with its 95 % interval, the moving average (EWMA) with its limits, and below them \
         the cumulated sum (CUSUM) with its alarm.</p>\n{charts}"
    )
}

/// Charts that are drawn: parts that changed first, then those that are no part of their type or leave the limits.
const CHARTS: usize = 12;
/// Heights of a chart's two panels.
const UPPER: f64 = 150.0;
/// Where they begin.
const TOP: f64 = 30.0;
const LOWER: f64 = 50.0;

fn is_charted(part: &PartRow) -> bool {
    let leaves = |course: &CourseRow| {
        course.points.iter().any(|point| (point.average - course.level).abs() > point.limit || point.sum > ALARM)
    };
    part.course.as_ref().is_some_and(|course| part.outlier || !part.changed.is_empty() || leaves(course))
}

/// A part's control charts.
fn chart(part: &PartRow) -> String {
    framed(|frame| chart_in(part, frame))
}

fn chart_in(part: &PartRow, frame: &Frame) -> String {
    let &Frame { class: of_screen, width, left_of_chart: left, .. } = frame;
    let Some(course) = &part.course else { return String::new() };
    let days = |point: &PointRow| f64::from((point.day - course.points[0].day).get_days());
    let (first, last) = (&course.points[0], &course.points[course.points.len() - 1]);
    let span = days(last).max(1.0);
    let x = |point: &PointRow| left + (width - left - 20.0) * days(point) / span;
    let ends = course.points.iter().flat_map(|own| {
        let error = 1.96 * own.std_error;
        [own.value - error, own.value + error, course.level - own.limit, course.level + own.limit]
    });
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    if high <= low || !(high - low).is_finite() {
        return String::new();
    }
    let y = |value: f64| TOP + UPPER * (high - value) / (high - low);
    // Far beyond the alarm it is not drawn to its end: the alarm has to be seen.
    let top = course.points.iter().map(|own| own.sum).fold(1.2 * ALARM, f64::max).min(3.0 * ALARM);
    let sum = |value: f64| TOP + UPPER + 12.0 + LOWER * (1.0 - value.min(top) / top);
    let line = |of: &dyn Fn(&PointRow) -> f64| {
        let places = course.points.iter().map(|own| format!("{:.1},{:.1}", x(own), of(own)));
        places.collect::<Vec<_>>().join(" ")
    };
    let height = TOP + UPPER + LOWER + 2.5 * LINE;
    let title = format!("part {}: {} {}", part.part, part.axis, part.effect);
    let mut svg = format!(
        "<svg class=\"{of_screen}\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" role=\"img\" aria-label=\"{0}\"><text x=\"0\" y=\"12\">{0}</text>",
        escaped(&title)
    );
    for sign in [-1.0, 1.0] {
        let _ =
            write!(svg, "<polyline class=\"limit\" points=\"{}\"/>", line(&|own| y(course.level + sign * own.limit)));
    }
    let level = |class: &str, at: f64| {
        format!("<line class=\"{class}\" x1=\"{left}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>", width - 20.0)
    };
    svg.push_str(&level("nothing", y(course.level)));
    svg.push_str(&level("limit", sum(ALARM)));
    for own in &course.points {
        let error = 1.96 * own.std_error;
        let _ = write!(
            svg,
            "<line class=\"own\" x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{1:.1}\" y2=\"{2:.1}\"/><circle class=\"own\" cx=\"{0:.1}\" cy=\"{3:.1}\" \
             r=\"2.5\"/>",
            x(own),
            y(own.value - error),
            y(own.value + error),
            y(own.value)
        );
    }
    let _ = write!(
        svg,
        "<polyline class=\"course\" points=\"{}\"/><polyline class=\"course\" points=\"{}\"/>",
        line(&|own| y(own.average)),
        line(&|own| sum(own.sum))
    );
    for change in &part.changed {
        let at = left + (width - left - 20.0) * f64::from((change.day - first.day).get_days()) / span;
        let _ = write!(
            svg,
            "<line class=\"out\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{:.1}\"/>",
            TOP + UPPER + 12.0 + LOWER
        );
    }
    let unit = shown(&part.unit, &[Some(low), Some(high)]);
    let mut text = |at: (f64, f64), anchor: &str, text: &str| {
        let _ =
            write!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>", at.0, at.1, escaped(text));
    };
    for value in [high, low] {
        let told = format!("{} {}", units::within(value * unit.factor, (high - low) * unit.factor), unit.unit);
        text((left - 8.0, y(value) + 4.0), "end", &told);
    }
    text(
        (left - 8.0, sum(ALARM) + 4.0),
        "end",
        &format!("{}alarm at {ALARM} σ", if left > 150.0 { "CUSUM, " } else { "" }),
    );
    text((left, height - 4.0), "start", &first.day.to_string());
    text((width - 20.0, height - 4.0), "end", &last.day.to_string());
    svg.push_str("</svg>\n");
    svg
}

/// A name that fits beside a plot.
fn short(name: &str, longest: usize) -> String {
    if name.chars().count() <= longest {
        return name.to_owned();
    }
    let end: String = name.chars().skip(name.chars().count() + 1 - longest).collect();
    format!("…{end}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
