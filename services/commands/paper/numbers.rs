//! Each number beside the printed one, and a plain word about it.

use comfy_table::{ContentArrangement, Table, presets};
use gyro_model::paper::{ALPHA, DELTA_DEGREES, Found, Reproduction};

/// One number.
pub struct Number {
    /// What it is.
    pub what: &'static str,
    /// As it came out.
    pub here: String,
    /// As the paper has it.
    pub printed: String,
    /// Whether they agree; `None` where the paper has none.
    pub agrees: Option<bool>,
    /// A plain word.
    pub says: String,
}

/// Within so many standard errors two numbers agree.
const AGREES: f64 = 4.0;

/// Every number.
pub fn all(r: &Reproduction) -> Vec<Number> {
    let mut numbers = found(&r.found);
    let [riccati, printed] = &r.printed_way;
    for (k, says) in [
        "the closed form −√(q₁/S) with the paper's Q = diag(5, 5) and S = 1.1",
        "the paper's own equation (8) gives √((q₂ + 2√(q₁S))/S); nothing that we tried gives the printed number, and \
         with it the observer is stable but hardly damped (ζ = 0.08)",
    ]
    .into_iter()
    .enumerate()
    {
        numbers.push(Number {
            what: ["M₁, gain of equation (6)", "M₂, gain of equation (6)"][k],
            here: minus(&format!("{:.4}", riccati.gain[k])),
            printed: minus(&printed.gain[k].to_string()),
            agrees: Some((riccati.gain[k] - printed.gain[k]).abs() < 5e-4),
            says: says.into(),
        });
    }
    for (what, way) in
        [("α from the filtered angle, Riccati gain", riccati), ("α from the filtered angle, printed gain", printed)]
    {
        numbers.push(Number {
            what,
            here: minus(&format!("{:.3}", way.found.alpha)),
            printed: ALPHA.to_string(),
            agrees: Some((way.found.alpha - ALPHA).abs() < 0.01),
            says: minus(&format!(
                "the filter (9) leaves out its input θ̇ and passes 0.25 Hz with a gain of {:.3} at {:.1}°, so least \
                 squares of (10) on its output gives about α cos φ/gain; encoder and gyro both through the same filter \
                 give {:.3}",
                way.amplitude,
                way.phase.to_degrees(),
                way.found_both_filtered.alpha
            )),
        });
    }
    numbers.push(Number {
        what: "error over 10 s, open loop, °/s",
        here: format!("{:.4} (uncompensated {:.2})", r.error_after.to_degrees(), r.error_before.to_degrees()),
        printed: "–".into(),
        agrees: None,
        says: format!("{:.0} times less than before compensation", r.error_before / r.error_after),
    });
    numbers
}

/// α, δ and what they mean.
fn found(found: &Found) -> Vec<Number> {
    let delta = found.delta.to_degrees();
    let delta_std = found.delta_std.to_degrees();
    let away = |value: f64, printed: f64, std: f64| ((value - printed) / std).abs();
    let says = |away: f64| format!("{away:.1} of its own standard errors away");
    let (alpha_away, delta_away) = (away(found.alpha, ALPHA, found.alpha_std), away(delta, DELTA_DEGREES, delta_std));
    vec![
        Number {
            what: "scale factor α",
            here: format!("{:.5} ± {:.5}", found.alpha, found.alpha_std),
            printed: ALPHA.to_string(),
            agrees: Some(alpha_away < AGREES),
            says: says(alpha_away),
        },
        Number {
            what: "bias δ, °/s",
            here: minus(&format!("{delta:.4} ± {delta_std:.4}")),
            printed: minus(&format!("{DELTA_DEGREES} (no unit)")),
            agrees: Some(delta_away < AGREES),
            says: format!(
                "{}; read in °/s, for then the gyro reads {:.1} °/s at rest (−δ/α), as low-cost gyros do; in rad/s it \
                 would read 177 °/s",
                says(delta_away),
                -delta / found.alpha
            ),
        },
    ]
}

/// A word for the agreement.
pub fn word(agrees: Option<bool>) -> &'static str {
    match agrees {
        Some(true) => "agrees",
        Some(false) => "does not agree",
        None => "not in the paper",
    }
}

/// The numbers for the terminal.
pub fn table(numbers: &[Number]) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_content_arrangement(ContentArrangement::Dynamic);
    if table.width().is_none() {
        table.set_width(100);
    }
    table.set_header(["", "here", "printed", ""]);
    for n in numbers {
        table.add_row([n.what, &n.here, &n.printed, &format!("{}: {}", word(n.agrees), n.says)]);
    }
    table.to_string()
}

/// With a true minus sign.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}
