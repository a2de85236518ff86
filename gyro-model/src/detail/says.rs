//! The worst regimes in words: "above 31 °C the rate reads 0.70 ± 0.02 °/s high; elsewhere it is within its noise".

use super::{AxisDetail, FailsWhere, Regime, RegimeBin, Spectrum, channels::FREE};

/// A bin counts as off when its mean is so many standard errors from zero: 16 bins × 10 regressors are looked at.
const SIGNIFICANT: f64 = 4.0;
/// Sentences at most.
const SENTENCES: usize = 5;

/// The worst few regimes, the one that explains most of the error first.
#[must_use]
pub fn fails_where(detail: &AxisDetail) -> Vec<FailsWhere> {
    let most = detail.regimes.first().map_or(0.0, |r| r.explains);
    let mut found: Vec<FailsWhere> = detail
        .regimes
        .iter()
        .filter(|r| r.explains > 0.25 * most)
        .filter_map(worst_stretch)
        .take(SENTENCES - 1)
        .collect();
    found.extend(worst_band(&detail.spectrum));
    found
}

/// A run of neighbouring bins that are off to the same side.
struct Stretch {
    first: usize,
    last: usize,
    samples: usize,
    mean: f64,
    std_error: f64,
}

fn worst_stretch(regime: &Regime) -> Option<FailsWhere> {
    let bins = &regime.bins;
    let mut stretches = stretches(bins);
    stretches.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    let worst = stretches.first()?;
    let (from, to) = (bins[worst.first].from, bins[worst.last].to);
    let mut says = format!("{} {}", place(regime, worst), reads(worst));
    if let Some(other) = stretches.iter().skip(1).find(|s| s.mean * worst.mean < 0.0) {
        says = format!("{says}; {} {}", place(regime, other), reads(other));
    } else if quiet_elsewhere(bins, worst) {
        says.push_str("; elsewhere it is within its noise");
    }
    Some(FailsWhere {
        regressor: regime.regressor.clone(),
        from: Some(from),
        to: Some(to),
        samples: worst.samples,
        mean_error: Some(worst.mean),
        std_error: Some(worst.std_error),
        says,
    })
}

fn weight(stretch: &Stretch) -> f64 {
    stretch.samples as f64 * stretch.mean * stretch.mean
}

fn stretches(bins: &[RegimeBin]) -> Vec<Stretch> {
    let off = |b: &RegimeBin| b.mean.abs() > SIGNIFICANT * b.std_error;
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

fn quiet_elsewhere(bins: &[RegimeBin], worst: &Stretch) -> bool {
    let mut others = bins.iter().enumerate().filter(|(i, _)| !(worst.first..=worst.last).contains(i)).peekable();
    others.peek().is_some()
        && others.all(|(_, b)| b.mean.abs() < (SIGNIFICANT * b.std_error).min(0.5 * worst.mean.abs()))
}

fn reads(stretch: &Stretch) -> String {
    let (mean, error) = (stretch.mean.to_degrees(), stretch.std_error.to_degrees());
    let side = if mean > 0.0 { "high" } else { "low" };
    let digits = (1.0 - error.max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("the rate reads {:.digits$} ± {error:.digits$} °/s {side}", mean.abs())
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
        (true, true) if regime.unit == FREE => format!("over the whole range of {}", regime.regressor),
        (true, true) => "over the whole range of ".to_string() + &regime.regressor.replace('-', " "),
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
        says: format!(
            "between {} and {} Hz the error is {} times what noise alone makes",
            number(from),
            number(to),
            number(ratio)
        ),
    })
}
