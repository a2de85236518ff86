//! A fleet as one page: sentences, tables, a forest plot of each parameter by log and a caterpillar plot by part. It needs no script.

use super::{
    CourseRow, Fleet, PartRow, PointRow, ShareRow, TypeRow,
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
    let mut kind = "";
    for row in &fleet.types {
        if row.kind != kind {
            if !kind.is_empty() {
                body.push_str("</table>\n");
            }
            kind = &row.kind;
            let _ = writeln!(
                body,
                "<h2>Type {}</h2>\n<table><tr><th>parameter</th><th>mean</th><th>between parts</th><th>next part (95 %)</th>\
                 <th>p</th><th>matters</th></tr>",
                escaped(kind)
            );
        }
        let cells = columns(row).map(|cell| format!("<td>{}</td>", escaped(&cell))).concat();
        let _ = writeln!(body, "<tr>{cells}</tr>");
    }
    if !kind.is_empty() {
        body.push_str("</table>\n");
    }
    for row in &fleet.types {
        let _ = writeln!(body, "<h2>{}: {}</h2>", escaped(&row.kind), escaped(&row.label()));
        body.push_str(&forest(row));
        body.push_str(&caterpillar(fleet, row));
    }
    let changed: Vec<_> = fleet.parts.iter().filter(|part| !part.changed.is_empty()).collect();
    if !changed.is_empty() {
        body.push_str(
            "<h2>Changes in time</h2>\n<table><tr><th>part</th><th>parameter</th><th>day</th><th>by</th><th>from</th><th>to</th><th>what changed with it</th></tr>\n",
        );
        for part in changed {
            for change in &part.changed {
                let _ = writeln!(
                    body,
                    "<tr><td>{}</td><td>{} {}</td><td>{} ± {} days</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                    escaped(&part.part),
                    part.axis,
                    escaped(&part.effect),
                    change.day,
                    change.days.ceil(),
                    escaped(&value(change.by, Some(change.std_error), &part.unit)),
                    escaped(&value(change.before, Some(change.before_error), &part.unit)),
                    escaped(&value(change.after, Some(change.after_error), &part.unit)),
                    escaped(with(change).trim_start_matches(" With it changed: ").trim_end_matches('.'))
                );
            }
        }
        body.push_str("</table>\n");
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
    // A table that is wider than a phone is moved inside its place.
    let body = body.replace("<table>", "<div class=\"scroll\"><table>").replace("</table>", "</table></div>");
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

const STYLE: &str = "main table{border-collapse:collapse;margin:.5rem 0}main .scroll{overflow-x:auto}main td,main th{padding:.15rem .9rem .15rem 0;text-align:left}\
main svg{max-width:100%;height:auto;display:block;margin:.4rem 0}main svg text{fill:currentColor;font:12px system-ui,sans-serif}\
main svg .own{stroke:currentColor;fill:currentColor}main svg .mean{stroke:#2f83d6;fill:#2f83d6}main svg .band{fill:#56b4e9;opacity:.25}\
main svg polyline{fill:none}main svg .course{stroke:#2f83d6;stroke-width:2}main svg .limit{stroke:#d55e00;stroke-dasharray:4 3}\
main svg .out{stroke:#d55e00;fill:#d55e00}main svg .nothing{stroke:currentColor;opacity:.35;stroke-dasharray:4 3}";

/// Rows of a plot; of more, those farthest from the mean.
const ROWS: usize = 60;
const LEFT: f64 = 210.0;
const WIDTH: f64 = 860.0;
const LINE: f64 = 18.0;

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
    let x = |value: f64| LEFT + (WIDTH - LEFT - 20.0) * ((value - low) / (high - low)).clamp(0.0, 1.0);
    let height = LINE * (lines.len() + 3) as f64;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" role=\"img\" aria-label=\"{}: {title}\"><text x=\"0\" y=\"12\">{title}{}</text>",
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
        let y = LINE * (k as f64 + 1.5) + 4.0;
        let class = if line.outlier { "out" } else { "own" };
        let _ = write!(
            svg,
            "<text x=\"0\" y=\"{:.1}\">{}</text><line class=\"{class}\" x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
             <circle class=\"{class}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"3\"/>",
            y + 4.0,
            escaped(&short(&line.name)),
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
    let mut body = String::from(
        "<h2>Mount and chip</h2>\n<table><tr><th>type</th><th>axes</th><th>turned about</th><th>by (the mount's)</th><th>equal (the \
         chip's)</th><th>of</th></tr>\n",
    );
    let share = |row: &ShareRow, unit: &str| escaped(&value(row.mean, row.std_error, unit));
    for own in &fleet.misaligned {
        let _ = writeln!(
            body,
            "<tr><td>{}</td><td>{}, {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&own.kind),
            own.axes[0],
            own.axes[1],
            own.about,
            share(&own.turned, "rad"),
            share(&own.alike, "1"),
            own.of.name(),
        );
    }
    body + "</table>\n"
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
    let Some(course) = &part.course else { return String::new() };
    let days = |point: &PointRow| f64::from((point.day - course.points[0].day).get_days());
    let (first, last) = (&course.points[0], &course.points[course.points.len() - 1]);
    let span = days(last).max(1.0);
    let x = |point: &PointRow| LEFT + (WIDTH - LEFT - 20.0) * days(point) / span;
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
        "<svg viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" role=\"img\" aria-label=\"{0}\"><text x=\"0\" y=\"12\">{0}</text>",
        escaped(&title)
    );
    for sign in [-1.0, 1.0] {
        let _ =
            write!(svg, "<polyline class=\"limit\" points=\"{}\"/>", line(&|own| y(course.level + sign * own.limit)));
    }
    let level = |class: &str, at: f64| {
        format!("<line class=\"{class}\" x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>", WIDTH - 20.0)
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
        let at = LEFT + (WIDTH - LEFT - 20.0) * f64::from((change.day - first.day).get_days()) / span;
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
        text((LEFT - 8.0, y(value) + 4.0), "end", &told);
    }
    text((LEFT - 8.0, sum(ALARM) + 4.0), "end", &format!("CUSUM, alarm at {ALARM} σ"));
    text((LEFT, height - 4.0), "start", &first.day.to_string());
    text((WIDTH - 20.0, height - 4.0), "end", &last.day.to_string());
    svg.push_str("</svg>\n");
    svg
}

/// A name that fits beside a plot.
fn short(name: &str) -> String {
    const LONGEST: usize = 30;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    let end: String = name.chars().skip(name.chars().count() + 1 - LONGEST).collect();
    format!("…{end}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
