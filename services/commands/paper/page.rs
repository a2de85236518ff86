//! One self-contained page: the numbers, then the figures.

use super::numbers::{Number, word};
use gyro_model::paper::{ENCODER_COUNTS, NOISE_DENSITY_DEGREES, RATE_HZ, SECONDS, SETTLED};
use std::fmt::Write;

const STYLE: &str = "\
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 980px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; line-height: 1.25; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; } th, td { text-align: left; vertical-align: top; padding: .45rem .7rem .45rem 0; border-bottom: 1px solid #ddd; }
td.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
.yes { color: #00704f; font-weight: 600; } .no { color: #b34700; font-weight: 600; } .none { color: #666; font-weight: 600; }
figure { margin: 1.6rem 0; } figure svg { width: 100%; height: auto; } figcaption { color: #444; }";

/// The page.
pub fn html(numbers: &[Number], figures: &[(u32, String, String)], seed: u64) -> String {
    let mut rows = String::new();
    for n in numbers {
        let class = match n.agrees {
            Some(true) => "yes",
            Some(false) => "no",
            None => "none",
        };
        let _ = writeln!(
            rows,
            "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td><span class=\"{class}\">{}</span>: {}</td></tr>",
            n.what,
            n.here,
            n.printed,
            word(n.agrees),
            n.says
        );
    }
    let mut drawn = String::new();
    for (number, svg, caption) in figures {
        let _ = writeln!(drawn, "<figure id=\"figure-{number}\">{svg}<figcaption>{caption}</figcaption></figure>");
    }
    format!(
        "<!doctype html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<title>The paper, reproduced</title>
<style>{STYLE}</style>
</head>
<body>
<h1>Parameter Compensation and Noise Reduction of Low-cost Gyroscope, reproduced</h1>
<p>The paper by S. Saraporn, J. Pranarak, J. Srisertpol and K. Teecha turns a gyro to and fro about X by a sine of
0.25 Hz within ±150° and finds its scale factor α and bias δ by least squares against an encoder. Its log is not public,
so this page simulates the rig with the printed α and δ and asks whether the method gives them back.</p>
<p>Simulated: {SECONDS} s at {RATE_HZ} Hz; white gyro noise of {NOISE_DENSITY_DEGREES} °/s/√Hz; an encoder of
{ENCODER_COUNTS} counts a turn; δ in °/s; draw {seed} of the noise. The printed way is fitted from {SETTLED} s on, when its
filter has swung in.</p>
<h2>Each number beside the printed one</h2>
<div class=\"scroll\"><table>
<thead><tr><th></th><th>here</th><th>printed</th><th></th></tr></thead>
<tbody>
{rows}</tbody></table></div>
<h2>Why the printed way cannot give α</h2>
<p>The compensator minimises e = θ<sub>e</sub> − θ̂<sub>g</sub> (10) with θ̂<sub>g</sub> out of the observer (9). That
observer has no input: it does not know that the shaft is driven, and follows the angle like a loop of about the sine's
own frequency. What it makes of amplitude and phase, least squares puts into α. Fitted to the integral of the reading
itself, or with the encoder through the same observer, α comes out right. The standard errors here are those of the
real residual, a random walk from the gyro's noise and white noise from the encoder's counts; over many draws the spread
agrees with them.</p>
<h2>Figures 4–10</h2>
{drawn}</body>
</html>
"
    )
}
