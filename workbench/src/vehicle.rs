//! Vehicles to play with: simulated ones that drive, with an effect hidden in their gyro that a minute of driving shows.

use anyhow::anyhow;
use gyro_model::{
    Axis, Model, diagnose,
    diagnose::compare,
    fit::fit,
    simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
};

/// Rows a second.
pub const RATE_HZ: f64 = 100.0;
/// What may be hidden, as `--hide` takes it: effects that a minute of driving shows. Left out: what takes longer or needs
/// another motion (`lag`, `saturation`, `g-squared-sensitivity`, `mount-resonance`, `bias-drift`) and `reference-smoothing`,
/// which an encoder does not have. What happens once happens early enough to be seen from both sides.
pub const HIDDEN: [&str; 20] = [
    "bias-step:t0=15",
    "clock-skew",
    "clock-step:t0=15",
    "cross-axis",
    "cubic-nonlinearity",
    "dead-zone",
    "delay",
    "encoder-backlash",
    "encoder-eccentricity",
    "encoder-subdivision",
    "g-sensitivity",
    "quadratic-nonlinearity",
    "rate-hysteresis",
    "scale-asymmetry",
    "supply-voltage",
    "temperature-bias",
    "temperature-rate",
    "temperature-scale",
    "vibration-tone:f=7",
    "warm-up",
];
/// It is doubled from its typical size on until the error is so many times its floor, …
const SEEN: f64 = 6.0;
/// … which is looked at after so many seconds, …
const SEEN_WITHIN: f64 = 30.0;
/// … at most so many times.
const DOUBLED: i32 = 3;

/// The temperature goes up and down by so much, K, …
pub const SWING: f64 = 3.0;
/// … within this time, s. A sensor that only warms up once shows a temperature, a warm-up and a drift alike.
pub const SWING_PERIOD: f64 = 24.0;

/// What this seed hides, at its typical size.
#[must_use]
pub fn hidden(seed: u64) -> &'static str {
    let mixed = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
    HIDDEN[(mixed % HIDDEN.len() as u64) as usize]
}

/// The vehicle of this seed, without anything hidden and without end.
///
/// # Errors
/// None: its motion is known.
pub fn scenario(seed: u64) -> anyhow::Result<Scenario> {
    let mut sensor = SensorSpec::random(seed);
    (sensor.temperature.swing, sensor.temperature.period) = (SWING, SWING_PERIOD);
    let motion: Motion = "drive".parse().map_err(|error: String| anyhow!(error))?;
    Ok(Scenario { motion, seconds: f64::INFINITY, rate_hz: RATE_HZ, seed, hidden: Vec::new(), sensor })
}

/// An effect, as `--hide` takes it, so large that nobody overlooks it on this vehicle.
///
/// # Errors
/// An effect that is not known, or a vehicle that cannot be judged.
pub fn sized(hidden: &str, vehicle: &Scenario) -> anyhow::Result<String> {
    let axis: Axis = vehicle.sensor.axis;
    let typical = Hidden::parse(hidden, axis)?;
    let mut larger = typical.clone();
    for doubled in 0..=DOUBLED {
        larger = typical.scaled(2_f64.powi(doubled), axis);
        let scenario = Scenario { seconds: SEEN_WITHIN, hidden: vec![larger.clone()], ..vehicle.clone() };
        let record = simulate(&scenario).record;
        let fitted = fit(&record, &Model::default(), &[axis])?;
        let found = compare(&record, &fitted, &[axis], &diagnose::Options::default())?;
        if found.iter().filter_map(|axis| axis.error_over_floor).any(|ratio| ratio >= SEEN) {
            break;
        }
    }
    Ok(larger.text(axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::diagnosis::Verdict;

    #[test]
    fn every_effect_that_may_be_hidden_is_known_and_comes_up() {
        for id in HIDDEN {
            assert!(Hidden::parse(id, Axis::Z).is_ok(), "{id}");
            let times = (0..2000).filter(|seed| hidden(*seed) == id).count();
            assert!((60..140).contains(&times), "{id}: {times} of 2000");
        }
    }

    /// Of vehicles that no demo was tried on. `TRUERATE_VEHICLES` says how many, `TRUERATE_SECONDS` after how long.
    #[test]
    #[ignore = "some minutes: cargo test -p truerate-workbench vehicle:: -- --ignored --nocapture"]
    fn what_is_hidden_is_named_within_a_minute_of_driving() {
        let number = |name: &str, usual: u64| std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(usual);
        let (vehicles, seconds) = (number("TRUERATE_VEHICLES", 10), number("TRUERATE_SECONDS", 50) as f64);
        let mut missed = 0;
        for hidden in HIDDEN {
            let id = hidden.split(':').next().unwrap();
            let mut others = Vec::new();
            let mut ratios = Vec::new();
            for seed in 0..vehicles {
                let bare = scenario(5000 + seed).unwrap();
                let larger = Hidden::parse(&sized(hidden, &bare).unwrap(), bare.sensor.axis).unwrap();
                let scenario = Scenario { seconds, hidden: vec![larger], ..bare };
                let record = simulate(&scenario).record;
                let options = diagnose::Options::default();
                let found = diagnose::diagnose(&record, &Model::default(), &record.fitted_axes(), &options).unwrap();
                let axis = found.iter().find(|a| a.axis == scenario.sensor.axis).unwrap();
                ratios.push(axis.error_over_floor.unwrap_or(f64::NAN));
                let best = axis.suspects.first().map_or("nothing", |s| s.effect.as_str());
                if axis.verdict != Verdict::MissingEffect || best != id {
                    others.push(format!("{}: {} ({:?})", 5000 + seed, best, axis.verdict));
                }
            }
            missed += others.len();
            ratios.sort_by(f64::total_cmp);
            println!("{hidden}: error/floor {:.1} to {:.1}; missed {others:?}", ratios[0], ratios[ratios.len() - 1]);
        }
        let all = HIDDEN.len() * vehicles as usize;
        println!("{} of {all} named", all - missed);
        assert!(50 * missed <= all, "{missed} of {all} not named");
    }
}
