//! What a file holds, as `truerate channels` and the page in a browser say it.

use super::Look;
use log_readers::{
    formats::can,
    meaning::Pick,
    survey::{Survey, Surveyed},
};
use serde_json::{Value, json};

/// A time in seconds.
#[must_use]
pub fn seconds(ns: i64) -> f64 {
    ns as f64 / 1e9
}

/// The frames of a CAN log that nothing is said of: an identifier each, those of 11 bits first.
#[must_use]
pub fn identifiers(survey: &Survey) -> Vec<&Surveyed> {
    let mut frames: Vec<&Surveyed> = survey.topics.iter().filter(|of| of.topic.kind == can::UNNAMED).collect();
    frames.sort_by_key(|of| (bits(of), of.topic.name.as_str()));
    frames
}

/// Bits of a frame's identifier, which is shown with eight digits where it has 29, behind the bus if that is another.
#[must_use]
pub fn bits(of: &Surveyed) -> u8 {
    let digits = of.topic.name.rsplit("0x").next().map_or(0, str::len);
    if digits == 8 { 29 } else { 11 }
}

/// What a file holds, for programs.
#[must_use]
pub fn json(name: &str, look: &Look) -> Value {
    let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    let frames = identifiers(&look.survey);
    let identifiers = frames.iter().map(|of| {
        let (gaps, longest) = of.gaps();
        let length = of.fields.first().map_or([f64::NAN; 2], |length| [length.low, length.high]);
        json!({
            "identifier": of.topic.name,
            "bits": bits(of),
            "frames": of.messages,
            "bytes": length.map(finite),
            "rate_hz": of.rate_hz(),
            "from_s": seconds(of.first_ns),
            "span_s": seconds(of.last_ns.saturating_sub(of.first_ns)),
            "gaps": gaps,
            "longest_gap_s": if gaps > 0 { json!(seconds(longest)) } else { Value::Null },
        })
    });
    let named = look.survey.topics.iter().filter(|of| of.topic.kind != can::UNNAMED);
    let channels = named.flat_map(|of: &Surveyed| {
        let (gaps, longest) = of.gaps();
        of.topic.fields.iter().zip(&of.fields).map(move |(field, range)| {
            json!({
                "channel": of.topic.channel(field),
                "topic": of.topic.name,
                "kind": of.topic.kind,
                "unit": field.unit.map(|unit| unit.symbol),
                "rows": of.messages,
                "values": range.values,
                "rate_hz": of.rate_of(range),
                "from_s": seconds(of.first_ns),
                "span_s": seconds(of.last_ns.saturating_sub(of.first_ns)),
                "gaps": gaps,
                "longest_gap_s": if gaps > 0 { json!(seconds(longest)) } else { Value::Null },
                "min": finite(range.low),
                "max": finite(range.high),
            })
        })
    });
    let strings = |picks: &[Pick]| picks.iter().map(ToString::to_string).collect::<Vec<_>>();
    let advised = look.advice.as_ref().map_or_else(Vec::new, |advice| advice.flags.clone());
    let likely = [advised, strings(&look.proposal.offered)].concat();
    json!({
        "schema": "truerate.channels/1",
        "log": name,
        "format": look.format,
        "channels": channels.collect::<Vec<_>>(),
        "identifiers": identifiers.collect::<Vec<_>>(),
        "map": strings(&look.proposal.chosen),
        "likely": likely,
        "dependent": look.proposal.dependent.iter().map(|d| json!({"channel": d.channel, "by": d.by})).collect::<Vec<_>>(),
        "seconds": look.proposal.seconds.iter().map(|of| json!({"topic": of.topic, "rate_hz": finite(of.rate_hz), "map": strings(&of.picks)})).collect::<Vec<_>>(),
        "notes": look.survey.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
