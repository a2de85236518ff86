//! The worst regimes in words: "above 31 °C the rate reads 0.70 ± 0.02 °/s high; elsewhere it is within its noise".

use super::{AxisDetail, FailsWhere, Regime, RegimeBin, Spectrum, channels::FREE};
use crate::units::{self, Shown};
use statrs::distribution::{ContinuousCDF, Normal};

/// Chance that noise alone makes one of all bins that are looked at stand out.
const CHANCE: f64 = 0.01;
/// Standard errors that a mean is off by at least, however few bins there are.
const LEAST: f64 = 4.0;
/// Standard error of a mean over the mean below which it is none.
const STILL: f64 = 1e-6;
/// Sentences at most.
const SENTENCES: usize = 5;

/// The worst few regimes, the one that explains most of the error first.
#[must_use]
pub fn fails_where(detail: &AxisDetail) -> Vec<FailsWhere> {
    let most = detail.regimes.first().map_or(0.0, |r| r.explains);
    let off = significant(detail.regimes.iter().map(|r| r.bins.len()).sum());
    let shown = detail.regimes.iter().filter(|r| r.explains > 0.25 * most);
    let mut throughout = false;
    let mut found: Vec<FailsWhere> = shown
        .filter_map(|regime| worst_stretch(regime, off))
        // What is off throughout is so by whatever it is sorted: said once.
        .filter(|(whole, _)| !whole || !std::mem::replace(&mut throughout, true))
        .map(|(_, fails)| fails)
        .take(SENTENCES - 1)
        .collect();
    found.extend(worst_band(&detail.spectrum));
    found
}

/// Standard errors from zero from which on a mean stands out among so many.
fn significant(bins: usize) -> f64 {
    let normal = Normal::standard();
    normal.inverse_cdf(1.0 - 0.5 * CHANCE / bins.max(1) as f64).max(LEAST)
}

/// A run of neighbouring bins that are off to the same side.
struct Stretch {
    first: usize,
    last: usize,
    samples: usize,
    mean: f64,
    std_error: f64,
}

/// The worst stretch of a regime, and whether it is the whole of it.
fn worst_stretch(regime: &Regime, off: f64) -> Option<(bool, FailsWhere)> {
    let bins = &regime.bins;
    let mut stretches = stretches(bins, off);
    stretches.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    let worst = stretches.first()?;
    let (from, to) = (bins[worst.first].from, bins[worst.last].to);
    let whole = worst.first == 0 && worst.last + 1 == bins.len();
    let mut says = if whole {
        reads(worst).replacen("the rate reads", "it reads", 1) + " throughout"
    } else {
        format!("{} {}", place(regime, worst), reads(worst))
    };
    if let Some(other) = stretches.iter().skip(1).find(|s| s.mean * worst.mean < 0.0) {
        says = format!("{says}; {} {}", place(regime, other), reads(other));
    } else if quiet_elsewhere(bins, worst, off) {
        says.push_str("; elsewhere it is within its noise");
    }
    let fails = FailsWhere {
        regressor: regime.regressor.clone(),
        from: Some(from),
        to: Some(to),
        samples: worst.samples,
        mean_error: Some(worst.mean),
        std_error: Some(worst.std_error),
        says,
    };
    Some((whole, fails))
}

fn weight(stretch: &Stretch) -> f64 {
    stretch.samples as f64 * stretch.mean * stretch.mean
}

fn stretches(bins: &[RegimeBin], significant: f64) -> Vec<Stretch> {
    let off = |b: &RegimeBin| b.mean.abs() > significant * b.std_error;
    let mut found = Vec::new();
    let mut first = 0;
    while first < bins.len() {
        let mut last = first;
        if off(&bins[first]) {
            while last + 1 < bins.len() && off(&bins[last + 1]) && bins[last + 1].mean * bins[first].mean > 0.0 {
                last += 1;
            }
            let run = &bins[first..=last];
            let samples: usize = run.iter().map(|b| b.samples).sum();
            let share = |b: &RegimeBin| b.samples as f64 / samples as f64;
            found.push(Stretch {
                first,
                last,
                samples,
                mean: run.iter().map(|b| share(b) * b.mean).sum(),
                std_error: run.iter().map(|b| (share(b) * b.std_error).powi(2)).sum::<f64>().sqrt(),
            });
        }
        first = last + 1;
    }
    found
}

fn quiet_elsewhere(bins: &[RegimeBin], worst: &Stretch, off: f64) -> bool {
    let mut others = bins.iter().enumerate().filter(|(i, _)| !(worst.first..=worst.last).contains(i)).peekable();
    others.peek().is_some() && others.all(|(_, b)| b.mean.abs() < (off * b.std_error).min(0.5 * worst.mean.abs()))
}

fn reads(stretch: &Stretch) -> String {
    let (mean, error) = (stretch.mean.to_degrees(), stretch.std_error.to_degrees());
    let side = if mean > 0.0 { "high" } else { "low" };
    // A reading that stands still has no scatter to take a standard error from.
    let error = Some(error).filter(|error| *error > STILL * mean.abs());
    let mean = units::uncertain(Some(mean.abs()), error, &Shown { factor: 1.0, unit: " °/s".into() });
    format!("the rate reads {mean} {side}")
}

/// "above 31 °C", "while turning in the positive direction", "from 20 to 45 s".
fn place(regime: &Regime, stretch: &Stretch) -> String {
    let bins = &regime.bins;
    let (from, to) = (bins[stretch.first].from, bins[stretch.last].to);
    let is = |name: &str| regime.regressor == name && regime.unit != FREE;
    if is("direction") {
        return match (from > 0.0, to < 0.0) {
            (true, _) => "while turning in the positive direction".into(),
            (_, true) => "while turning in the negative direction".into(),
            _ if stretch.first == stretch.last => "while hardly turning".into(),
            _ => "whichever way it turns".into(),
        };
    }
    let (what, unit, factor) = match (regime.regressor.as_str(), regime.unit.as_str()) {
        (name, FREE) => (format!("where {name} is "), "", 1.0),
        ("time", _) => (String::new(), " s", 1.0),
        ("temperature", _) => (String::new(), " °C", 1.0),
        ("angle", _) => ("at shaft angles ".into(), "°", 1f64.to_degrees()),
        ("rate", _) => ("at rates ".into(), " °/s", 1f64.to_degrees()),
        ("rate-change", _) => ("while the rate changes ".into(), " °/s²", 1f64.to_degrees()),
        (name, "rad/s") => (format!("where {} is ", name.replace('-', " ")), " °/s", 1f64.to_degrees()),
        (name, "m/s²") => (format!("where {} is ", name.replace('-', " ")), " m/s²", 1.0),
        (name, "V") => (format!("where {name} is "), " V", 1.0),
        (name, _) => (format!("where {name} is "), "", 1.0),
    };
    let [a, b] = ends(from * factor, to * factor);
    if is("rate-change")
        && let Some(words) = faster(from * factor, to * factor, stretch.first == 0, stretch.last + 1 == bins.len())
    {
        return words;
    }
    let by = if is("rate-change") { "by " } else { "" };
    match (stretch.first == 0, stretch.last + 1 == bins.len()) {
        (true, true) => "throughout".into(),
        (false, true) if is("time") => format!("from {a} s on"),
        (true, false) if is("time") => format!("until {b} s"),
        (false, true) => format!("{what}{by}above {a}{unit}"),
        (true, false) => format!("{what}{by}below {b}{unit}"),
        (false, false) => format!("{what}{by}between {a} and {b}{unit}"),
    }
}

/// "while the rate falls faster than 35 °/s²": where the stretch lies on one side of zero, but for a fifth of it: bins are that wide.
fn faster(from: f64, to: f64, lowest: bool, highest: bool) -> Option<String> {
    let (way, near, far, open) = match () {
        () if from > -0.2 * to => ("rises", from, to, highest),
        () if to < -0.2 * from => ("falls", -to, -from, lowest),
        () => return None,
    };
    Some(match (near > 0.1 * far, open) {
        (true, true) => format!("while the rate {way} faster than {} °/s²", number(near)),
        (true, false) => format!("while the rate {way} by {} to {} °/s²", number(near), number(far)),
        (false, true) => format!("while the rate {way}"),
        (false, false) => format!("while the rate {way}, by less than {} °/s²", number(far)),
    })
}

/// Three significant digits without needless zeros.
fn number(x: f64) -> String {
    rounded(x, digits(x))
}

/// Digits behind the point that show three of a number.
fn digits(x: f64) -> usize {
    if x == 0.0 { 0 } else { (2.0 - x.abs().log10().floor()).clamp(0.0, 6.0) as usize }
}

/// The two ends of a range, with as many digits as tell them apart.
fn ends(from: f64, to: f64) -> [String; 2] {
    let apart = digits(10.0 * (to - from));
    [from, to].map(|end| rounded(end, digits(end).max(apart)))
}

fn rounded(x: f64, digits: usize) -> String {
    // Not −0.
    let text = format!("{:.digits$}", x + 0.0);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

/// The third of an octave in which the error stands highest above what noise makes.
fn worst_band(spectrum: &Spectrum) -> Option<FailsWhere> {
    let third = 2f64.powf(1.0 / 3.0);
    let mut low = *spectrum.frequency.first()?;
    let mut worst: Option<(f64, f64, f64, usize)> = None;
    while low < *spectrum.frequency.last()? {
        let high = low * third;
        let ratios: Vec<f64> = (0..spectrum.frequency.len())
            .filter(|&i| (low..high).contains(&spectrum.frequency[i]))
            .filter_map(|i| Some((spectrum.error[i]? / spectrum.floor[i]?).powi(2)))
            .collect();
        let ratio = super::mean(&ratios).sqrt();
        if ratio > worst.map_or(1.5, |w| w.2) {
            worst = Some((low, high, ratio, ratios.len()));
        }
        low = high;
    }
    worst.map(|(from, to, ratio, samples)| FailsWhere {
        regressor: "frequency".into(),
        from: Some(from),
        to: Some(to),
        samples,
        mean_error: None,
        std_error: None,
        says: band_says(from, to, ratio),
    })
}

/// Frequency below which an error is said by its period, Hz.
const SLOW: f64 = 1.0;

/// `a slow error, period about 6 s: 12 times noise in amplitude`.
fn band_says(from: f64, to: f64, ratio: f64) -> String {
    let middle = (from * to).sqrt();
    let what = if middle < SLOW {
        format!("a slow error, period about {}", units::time(1.0 / middle))
    } else {
        format!("an error at {} to {} Hz", number(from), number(to))
    };
    format!("{what}: {} times noise in amplitude", number(ratio))
}
