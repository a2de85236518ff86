//! Effects that a log may not be able to tell apart, as the catalogue of aliases has them.

use gyro_model::simulate::Motion;

/// Alike on any such log: slow effects on a minute's heating, a delay and a lag far below the lag's corner, a lever arm's
/// tangential acceleration.
const ALWAYS: [(&str, &str); 9] = [
    ("delay", "lag"),
    ("delay", "g-sensitivity"),
    ("quadratic-nonlinearity", "g-sensitivity"),
    ("temperature-bias", "warm-up"),
    ("temperature-bias", "bias-drift"),
    ("temperature-bias", "supply-voltage"),
    ("warm-up", "bias-drift"),
    ("warm-up", "supply-voltage"),
    ("bias-drift", "supply-voltage"),
];

/// Alike where there is one amplitude.
const ONE_AMPLITUDE: [(&str, &str); 4] = [
    ("quadratic-nonlinearity", "scale-asymmetry"),
    ("cubic-nonlinearity", "saturation"),
    ("cubic-nonlinearity", "dead-zone"),
    ("saturation", "dead-zone"),
];

/// Alike where there is one frequency: whatever goes with dω/dt, and gravity.
const ONE_FREQUENCY: [&str; 7] =
    ["delay", "lag", "mount-resonance", "rate-hysteresis", "encoder-backlash", "g-sensitivity", "encoder-eccentricity"];

/// Effects that a log of this motion may not tell from `id`.
pub fn partners(id: &str, motion: Motion) -> Vec<&'static str> {
    let one_sine = matches!(motion, Motion::Sine { .. });
    let pairs = ALWAYS.iter().chain(ONE_AMPLITUDE.iter().filter(|_| one_sine));
    let mut partners: Vec<&str> =
        pairs.filter_map(|&(a, b)| if a == id { Some(b) } else { (b == id).then_some(a) }).collect();
    if one_sine && ONE_FREQUENCY.contains(&id) {
        partners.extend(ONE_FREQUENCY.iter().filter(|&&other| other != id));
    }
    partners
}
