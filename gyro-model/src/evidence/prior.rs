//! Noise known before any model is judged: from the gyro's own fastest differences and the encoder's step.
//!
//! Physics that the model lacks must not hide in the yardstick it is measured with, so nothing here looks at the
//! residual. The sixth difference of the reading removes smooth motion; its variance over white noise's (the sum of the
//! squared binomials, 924) is the noise of one sample. Where motion is so jerky that it reaches even there, the quietest
//! stretches of the log speak alone.

use super::series::Series;

/// What the sensors' own signals say about their noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// N, rad/√s.
    pub angle_random_walk: f64,
    /// Standard deviation of one reference reading, rad.
    pub encoder: f64,
    /// Where the two come from, for the report.
    pub source: String,
}

const ORDER: usize = 6;
/// Σ of the squared binomial coefficients of the sixth difference.
const GAIN: f64 = 924.0;
/// N of a poor MEMS gyro, rad/√s (0.03 °/s/√Hz): taken where motion hides the noise everywhere.
const POOR: f64 = 4e-4;
const WINDOW: usize = 18;
/// What share of their mean the variances of the quietest fiftieth of such stretches lie at, for white noise.
const QUIET: f64 = 0.25;

/// Variance of white noise in each stretch of the signal, by its sixth differences.
fn stretches(values: &[f64], skip: impl Fn(usize) -> bool) -> Vec<f64> {
    let mut out = Vec::new();
    let mut k = 0;
    while k + WINDOW + ORDER <= values.len() {
        let window = &values[k..k + WINDOW + ORDER];
        if !(k..k + WINDOW + ORDER).any(&skip) {
            let mut d = window.to_vec();
            for _ in 0..ORDER {
                d = d.windows(2).map(|w| w[1] - w[0]).collect();
            }
            out.push(d.iter().map(|x| x * x).sum::<f64>() / d.len() as f64 / GAIN);
        }
        k += WINDOW;
    }
    out
}

/// Mean variance of a signal, and what the quietest fiftieth of its stretches says it is.
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    mean: f64,
    quiet: f64,
}

impl Spread {
    fn of(mut variances: Vec<f64>) -> Self {
        if variances.is_empty() {
            return Self::default();
        }
        variances.sort_by(f64::total_cmp);
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        // The largest hundredth are outliers or jolts.
        let most = &variances[..variances.len() - variances.len() / 100];
        let mean = mean.min(1.1 * most.iter().sum::<f64>() / most.len() as f64);
        let moving: Vec<f64> = variances.iter().copied().filter(|&v| v > 0.0).collect();
        let quiet = moving.get(moving.len() / 50).map_or(0.0, |v| v / QUIET);
        Self { mean, quiet }
    }

    fn uneven(self) -> bool {
        self.mean > 4.0 * self.quiet
    }
}

/// The prior noise of one axis; `reference` is its reference angle, or for a quaternion the sum of the attitude's
/// increments about it.
#[must_use]
pub fn prior(series: &Series, reference: &[f64]) -> Prior {
    let span = series.span();
    let flat = |k: usize| {
        series.missing[k] || (k > 1 && series.gyro[k] == series.gyro[k - 1] && series.gyro[k] == series.gyro[k - 2])
    };
    let lsb = smallest_step(&series.gyro);
    let gyro = Spread::of(stretches(&series.gyro, flat));
    let angle = Spread::of(stretches(reference, |_| false));
    let step = series.quantum.powi(2) / 12.0;
    let known = if step > 0.0 { step } else { angle.quiet };
    // Jerky motion shows in the reference too; noise that grows with rate does not.
    let poor = POOR.powi(2) / span.dt;
    let jerky = angle.mean > 3.0 * known && (gyro.uneven() || gyro.mean > poor);
    let (variance, gyro_says) = if jerky && gyro.quiet > poor {
        (poor, "a poor MEMS sensor's data sheet (0.03 °/s/√Hz): the motion is jerky and never rests")
    } else if jerky {
        (gyro.quiet, "the quietest stretches (the motion is jerky)")
    } else {
        (gyro.mean, "sixth differences of the reading")
    };
    let variance = variance.max(lsb * lsb / 12.0);
    let (encoder, from) = if step > 0.0 {
        (step.sqrt(), format!("its step of {:.3} °", series.quantum.to_degrees()))
    } else {
        let variance = if angle.uneven() { angle.quiet } else { angle.mean };
        (variance.sqrt().max(1e-9), "sixth differences of the reference".to_owned())
    };
    Prior {
        angle_random_walk: (variance * span.dt).sqrt().max(1e-9),
        encoder,
        source: format!("gyro noise from {gyro_says}; reference noise from {from}"),
    }
}

/// Least significant bit of a quantised reading; 0 where there is none.
fn smallest_step(values: &[f64]) -> f64 {
    let mut steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|&d| d > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let Some(&guess) = steps.get(steps.len() / 100) else { return 0.0 };
    let on = steps
        .iter()
        .take_while(|&&d| d < 8.5 * guess)
        .filter(|&&d| (d / guess - (d / guess).round()).abs() < 0.1)
        .count();
    let all = steps.iter().take_while(|&&d| d < 8.5 * guess).count();
    if all > 20 && on * 20 >= all * 19 { guess } else { 0.0 }
}

/// F(τ) of white gyro noise and reference noise alone, rad/s: F² = N²/τ + 2σ²/τ².
#[must_use]
pub fn weights(prior: &Prior, tau: &[f64]) -> Vec<f64> {
    tau.iter().map(|t| (prior.angle_random_walk.powi(2) / t + 2.0 * (prior.encoder / t).powi(2)).sqrt()).collect()
}
