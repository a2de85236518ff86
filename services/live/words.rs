//! How a live source is, in words: for `status`, `top`, the dashboard and a run's summary.

use ipc_types::health::{Link, SourceHealth};
use serde_json::{Value, json};
use std::fmt::Write;

/// One line; `None` where the source is not live.
#[must_use]
pub fn text(source: &SourceHealth) -> Option<String> {
    if source.link == Link::None as u32 {
        return None;
    }
    // Bytes come, and mean nothing: to call that connected would be half the truth.
    let is_open = [Link::Connected as u32, Link::Silent as u32].contains(&source.link);
    let is_understood = source.rows > 0 || trouble(source).is_none() || !is_open;
    let link = if is_understood { Link::name(source.link) } else { "not understood" };
    let mut out = format!("{link}, {} rows", source.rows);
    let counted = [
        (source.garbled, "garbled", "garbled"),
        (source.cut, "of another length", "of another length"),
        (source.times, "with no new time", "with no new time"),
        (source.missed, "missed", "missed"),
        (source.values, "value refused", "values refused"),
        (source.left_out, "reading left out", "readings left out"),
        (source.remarks, "line of text", "lines of text"),
        (source.segments, "clock restart", "clock restarts"),
        (source.reconnects.into(), "reconnect", "reconnects"),
    ];
    for (count, one, many) in counted.into_iter().filter(|c| c.0 > 0) {
        let _ = write!(out, ", {count} {}", if count == 1 { one } else { many });
    }
    Some(out)
}

/// What keeps the source from being of use, and what to do.
#[must_use]
pub fn trouble(source: &SourceHealth) -> Option<&str> {
    Some(source.trouble.as_str()).filter(|text| !text.is_empty())
}

/// For programs; null where the source is not live.
#[must_use]
pub fn json(source: &SourceHealth) -> Value {
    if source.link == Link::None as u32 {
        return Value::Null;
    }
    json!({
        "link": Link::name(source.link), "reconnects": source.reconnects, "rows": source.rows, "garbled": source.garbled,
        "cut": source.cut, "remarks": source.remarks, "values": source.values, "left_out": source.left_out, "times": source.times,
        "missed": source.missed, "segments": source.segments, "says": text(source), "trouble": trouble(source),
    })
}

#[cfg(test)]
mod tests {
    use super::{Link, SourceHealth, json, text};

    #[test]
    fn only_what_happened_is_said() {
        let source =
            SourceHealth { link: Link::Lost as u32, rows: 7, garbled: 2, reconnects: 1, ..SourceHealth::default() };
        assert_eq!(text(&source).unwrap(), "lost, 7 rows, 2 garbled, 1 reconnect");
        assert_eq!(json(&source)["garbled"], 2);
        assert!(text(&SourceHealth::default()).is_none() && json(&SourceHealth::default()).is_null());
    }
}
