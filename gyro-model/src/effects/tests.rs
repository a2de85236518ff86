//! Walks the catalogue: what every effect has to keep to, whichever it is.

use super::*;
use proptest::prelude::*;
use std::collections::BTreeSet;

#[test]
fn aliases_are_so_both_ways() {
    assert!(are_aliases("delay", "lag") && are_aliases("lag", "delay"));
    assert!(!are_aliases("delay", "bias-step"));
}

#[test]
fn a_slip_of_the_pen_is_guessed() {
    assert_eq!(meant("scale-facter"), " (did you mean 'scale-factor'?)");
    assert_eq!(meant("eccentricity"), " (did you mean 'encoder-eccentricity'?)");
    assert_eq!(meant("something else entirely"), "");
    assert_eq!(meant(""), "");
}

const IDS: [&str; 30] = [
    "scale-factor",
    "bias",
    "cross-axis",
    "quadratic-nonlinearity",
    "cubic-nonlinearity",
    "scale-asymmetry",
    "g-sensitivity",
    "g-squared-sensitivity",
    "temperature-bias",
    "temperature-scale",
    "temperature-rate",
    "warm-up",
    "bias-drift",
    "bias-step",
    "supply-voltage",
    "lag",
    "delay",
    "clock-skew",
    "clock-step",
    "dead-zone",
    "saturation",
    "rate-hysteresis",
    "mount-resonance",
    "vibration-tone",
    "encoder-eccentricity",
    "encoder-subdivision",
    "encoder-backlash",
    "lost-counts",
    "reference-smoothing",
    "reference-lag",
];

/// The table of the effects' aliases, both ways.
const PAIRS: [[&str; 2]; 25] = [
    ["delay", "g-sensitivity"],
    ["quadratic-nonlinearity", "g-sensitivity"],
    ["delay", "lag"],
    ["lag", "g-sensitivity"],
    ["cross-axis", "scale-factor"],
    ["temperature-bias", "warm-up"],
    ["temperature-bias", "bias-drift"],
    ["temperature-bias", "supply-voltage"],
    ["warm-up", "bias-drift"],
    ["warm-up", "supply-voltage"],
    ["bias-drift", "supply-voltage"],
    ["temperature-bias", "temperature-scale"],
    ["encoder-eccentricity", "g-sensitivity"],
    ["encoder-eccentricity", "scale-factor"],
    ["quadratic-nonlinearity", "scale-asymmetry"],
    ["cubic-nonlinearity", "saturation"],
    ["cubic-nonlinearity", "dead-zone"],
    ["saturation", "dead-zone"],
    ["reference-smoothing", "mount-resonance"],
    ["reference-smoothing", "cubic-nonlinearity"],
    ["mount-resonance", "cubic-nonlinearity"],
    ["lost-counts", "cubic-nonlinearity"],
    ["reference-lag", "delay"],
    ["reference-lag", "mount-resonance"],
    ["reference-lag", "reference-smoothing"],
];

const SPAN: Span = Span {
    start: 0.0,
    duration: 120.0,
    dt: 0.01,
    reference_dt: 0.01,
    reading_min: 0.001,
    reading_max: 4.0,
    travel: 5.0,
};

/// A row of a lively log at `t`.
fn signals(t: f64, axis: Axis) -> Signals {
    Signals {
        t,
        dt: 0.01,
        axis: axis.index(),
        rates: [1.2 * (1.3 * t).sin(), 0.7 * (2.1 * t).cos(), -0.4 * (0.9 * t).sin()],
        rate_dot: 1.56 * (1.3 * t).cos(),
        angle: -1.2 / 1.3 * (1.3 * t).cos(),
        accel: [0.3, 9.0 * (0.2 * t).sin(), 9.0 * (0.2 * t).cos()],
        delta_temperature: 3.0 + 0.05 * t,
        delta_supply: 0.1 - 0.01 * t,
        ..Signals::default()
    }
}

/// Every effect on every axis.
fn everything() -> impl Iterator<Item = (&'static dyn Effect, Axis)> {
    CATALOGUE.iter().flat_map(|&effect| Axis::ALL.map(|axis| (effect, axis)))
}

/// Coefficients `values`, shapes at their typical size.
fn with_coefficients(effect: &dyn Effect, axis: Axis, values: &[f64]) -> Vec<f64> {
    let cards = effect.parameters(axis).iter().enumerate();
    cards.map(|(k, c)| if c.role == Role::Linear { values[k] } else { c.typical }).collect()
}

#[test]
fn the_catalogue_has_exactly_the_public_ids() {
    let ids: Vec<_> = CATALOGUE.iter().map(|e| e.card().id).collect();
    assert_eq!(ids, IDS);
}

#[test]
fn every_card_is_complete() {
    for effect in CATALOGUE {
        let card = effect.card();
        for text in
            [card.title, card.physics, card.equation, card.typical, card.source, card.excited_by, card.mended_by]
        {
            assert!(!text.is_empty(), "{} has an empty field", card.id);
        }
        assert!(card.physics.ends_with('.'), "{}: physics is sentences", card.id);
    }
}

#[test]
fn parameters_have_unique_names_and_coefficients_come_before_shapes() {
    for (effect, axis) in everything() {
        let cards = effect.parameters(axis);
        let names: BTreeSet<_> = cards.iter().map(|c| c.name).collect();
        assert_eq!(names.len(), cards.len(), "{}", effect.card().id);
        assert!(!cards.is_empty() && cards.iter().all(|c| !c.unit.is_empty() && !c.says.is_empty()));
        assert!(cards.is_sorted_by_key(|c| c.role != Role::Linear), "{}", effect.card().id);
    }
}

#[test]
fn typical_and_neutral_values_lie_within_the_bounds() {
    for (effect, axis) in everything() {
        for c in effect.parameters(axis) {
            let (low, high) = c.bounds;
            for value in [c.neutral, c.typical] {
                assert!(low <= value && value <= high, "{} {}: {value}", effect.card().id, c.name);
            }
            assert!(c.typical.is_finite());
        }
    }
}

#[test]
fn aliases_are_exactly_the_known_pairs_and_stand_on_both_cards() {
    let told: BTreeSet<_> =
        CATALOGUE.iter().flat_map(|e| e.card().aliases.iter().map(|a| (e.card().id, a.id))).collect();
    let expected: BTreeSet<_> = PAIRS.iter().flat_map(|&[a, b]| [(a, b), (b, a)]).collect();
    assert_eq!(told, expected);
}

#[test]
fn cross_axis_names_the_two_other_axes() {
    let names = |axis| find("cross-axis").unwrap().parameters(axis).iter().map(|c| c.name).collect::<Vec<_>>();
    assert_eq!(names(Axis::X), ["m_y", "m_z"]);
    assert_eq!(names(Axis::Y), ["m_x", "m_z"]);
    assert_eq!(names(Axis::Z), ["m_x", "m_y"]);
}

#[test]
fn neutral_parameters_change_nothing() {
    for (effect, axis) in everything() {
        let p: Vec<f64> = effect.parameters(axis).iter().map(|c| c.neutral).collect();
        let (mut errors, mut forward, mut backward) = (Memory::default(), Memory::default(), Memory::default());
        for k in 0..200 {
            let t = f64::from(k) * 0.01;
            let (s, id) = (signals(t, axis), effect.card().id);
            assert_eq!(effect.error(&p, &s, &mut errors), 0.0, "{id} errs");
            assert_eq!(effect.valid_time(&p, t), t, "{id} moves time");
            assert_eq!(effect.respond(&p, s.rate(), 0.01, &mut forward), s.rate(), "{id} responds");
            assert_eq!(effect.undo_response(&p, s.rate(), 0.01, &mut backward), s.rate(), "{id} undoes");
            assert_eq!(effect.limit(&p, s.rate()), s.rate(), "{id} limits");
            assert!(!effect.lost(&p, s.rate()), "{id} loses");
            assert_eq!(effect.window(&p, 0.01).mean(|u| signals(t + u, axis).angle), s.angle, "{id} shows");
        }
        let t: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.01).collect();
        let felt: Vec<f64> = t.iter().map(|&t| signals(t, axis).rate()).collect();
        assert_eq!(effect.undo_response_whole(&p, &t, &felt), felt, "{}", effect.card().id);
    }
}

#[test]
fn typical_parameters_change_something() {
    for (effect, axis) in everything().filter(|(e, _)| e.stage() != Stage::Calibration) {
        let p: Vec<f64> = effect.parameters(axis).iter().map(|c| c.typical).collect();
        let (mut errors, mut forward) = (Memory::default(), Memory::default());
        let changes = (0..6000).any(|k| {
            let t = f64::from(k) * 0.01;
            let s = signals(t, axis);
            let s = Signals { rates: s.rates.map(|rate| 10.0 * rate), ..s };
            effect.error(&p, &s, &mut errors) != 0.0
                || effect.valid_time(&p, t) != t
                || effect.respond(&p, s.rate(), 0.01, &mut forward) != s.rate()
                || [0.01, 3.0].iter().any(|&r| effect.limit(&p, r) != r)
        });
        assert!(changes, "{}", effect.card().id);
    }
}

#[test]
fn a_limit_changes_only_readings_that_are_lost() {
    for effect in CATALOGUE.iter().filter(|e| e.stage() == Stage::Reading) {
        let p: Vec<f64> = effect.parameters(Axis::X).iter().map(|c| c.typical).collect();
        for k in -500..=500 {
            let reading = f64::from(k) * 0.01;
            let limited = effect.limit(&p, reading);
            assert!(limited == reading || (effect.lost(&p, reading) && effect.lost(&p, limited)), "{reading}");
        }
    }
}

#[test]
fn grids_hold_every_shape_and_stay_within_the_bounds() {
    for (effect, axis) in everything() {
        let shapes: Vec<_> = effect.parameters(axis).iter().filter(|c| c.role != Role::Linear).collect();
        let grid = effect.grid(&SPAN);
        let sought_elsewhere = effect.card().id == "vibration-tone";
        assert_eq!(grid.is_empty(), shapes.is_empty() || sought_elsewhere, "{}", effect.card().id);
        for point in grid {
            assert_eq!(point.len(), shapes.len(), "{}", effect.card().id);
            for (value, card) in point.iter().zip(&shapes) {
                assert!(card.bounds.0 <= *value && *value <= card.bounds.1, "{} {value}", effect.card().id);
            }
        }
    }
}

/// Runs `respond` over a smooth motion in fine steps and hands every tenth back: times, true rates, felt rates.
fn forward(effect: &dyn Effect, p: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut memory = Memory::default();
    let motion = |t: f64| (1.9 * t).sin() - (7.0 * t).sin() * 0.3 + 0.1 * (17.0 * t).cos();
    let fine: Vec<_> = (0..20_000)
        .map(|k| {
            let t = f64::from(k) * 0.0005;
            (t, motion(t), effect.respond(p, motion(t), 0.0005, &mut memory))
        })
        .collect();
    let coarse = fine.iter().step_by(10);
    let (mut t, mut rate, mut felt) = (Vec::new(), Vec::new(), Vec::new());
    coarse.for_each(|&(a, b, c)| {
        t.push(a);
        rate.push(b);
        felt.push(c);
    });
    (t, rate, felt)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    f64::sqrt(sum / n)
}

#[test]
fn the_inverse_response_undoes_the_forward_one() {
    for effect in CATALOGUE.iter().filter(|e| e.stage() == Stage::Response) {
        let p: Vec<f64> = effect.parameters(Axis::X).iter().map(|c| c.typical).collect();
        let (t, rate, felt) = forward(*effect, &p);
        let settled = 400..t.len() - 3;
        let harm = rms(settled.clone().map(|k| felt[k] - rate[k]));

        let whole = effect.undo_response_whole(&p, &t, &felt);
        let left = rms(settled.clone().map(|k| whole[k] - rate[k]));
        assert!(left < 1e-3 * harm, "{} whole: {left} of {harm}", effect.card().id);

        let mut memory = Memory::default();
        let causal: Vec<f64> = (0..t.len())
            .map(|k| effect.undo_response(&p, felt[k], if k == 0 { 0.0 } else { 0.005 }, &mut memory))
            .collect();
        let left = rms(settled.map(|k| causal[k] - rate[k]));
        assert!(left < 0.1 * harm, "{} causal: {left} of {harm}", effect.card().id);
    }
}

proptest! {
    #[test]
    fn errors_are_linear_in_their_coefficients(
        a in prop::collection::vec(-1.0..1.0_f64, 3),
        b in prop::collection::vec(-1.0..1.0_f64, 3),
        t in 0.0..100.0_f64,
        axis in 0..3_usize,
    ) {
        let axis = Axis::ALL[axis];
        for effect in CATALOGUE.iter().filter(|e| e.parameters(axis)[0].role == Role::Linear) {
            let error = |values: &[f64]| {
                let (p, mut memory) = (with_coefficients(*effect, axis, values), Memory::default());
                (0..5).map(|k| effect.error(&p, &signals(t + f64::from(k) * 0.01, axis), &mut memory)).sum::<f64>()
            };
            let sum: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + 2.0 * b).collect();
            let expected = error(&a) + 2.0 * error(&b);
            prop_assert!((error(&sum) - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{}", effect.card().id);
        }
    }

    #[test]
    fn play_stays_within_its_clearance_and_moves_only_when_pushed(
        w in 0.0..1.0_f64,
        inputs in prop::collection::vec(-3.0..3.0_f64, 1..60),
    ) {
        let mut memory = Play::default();
        let mut before = f64::NAN;
        for input in inputs {
            let output = play(w, input, &mut memory);
            prop_assert!((output - input).abs() <= 0.5 * w + 1e-12);
            let pushed = before.is_nan() || (before - input).abs() > 0.5 * w;
            prop_assert!(pushed || output == before);
            before = output;
        }
    }

    #[test]
    fn play_does_not_care_how_finely_a_monotonic_move_is_sampled(
        w in 0.0..1.0_f64,
        turns in prop::collection::vec(-3.0..3.0_f64, 2..10),
    ) {
        let (mut coarse, mut fine) = (Play::default(), Play::default());
        play(w, turns[0], &mut coarse);
        play(w, turns[0], &mut fine);
        for pair in turns.windows(2) {
            for k in 1..=20 {
                play(w, pair[0] + (pair[1] - pair[0]) * f64::from(k) / 20.0, &mut fine);
            }
            prop_assert!((play(w, pair[1], &mut coarse) - fine.output).abs() < 1e-9);
        }
    }

    #[test]
    fn a_low_pass_holds_a_constant_and_forgets_its_start(
        u in -5.0..5.0_f64,
        start in -5.0..5.0_f64,
        time_constant in 0.001..1.0_f64,
    ) {
        prop_assert!((low_pass(u, u, u, 0.01, time_constant) - u).abs() < 1e-12);
        prop_assert!((low_pass(start, u, u, 40.0 * time_constant, time_constant) - u).abs() < 1e-9);
    }
}

#[test]
fn a_sensor_that_is_turned_shows_it_on_both_axes_of_the_plane() {
    let cross = find("cross-axis").unwrap();
    // x feels 7 % of y and −3 % of z: of a turned sensor y feels −7 % of x, and z 3 % of it.
    assert_eq!(cross.carried_over(&[0.07, -0.03], Axis::X, Axis::Y), [Some(-0.07), None]);
    assert_eq!(cross.carried_over(&[0.07, -0.03], Axis::X, Axis::Z), [Some(0.03), None]);
    assert_eq!(cross.carried_over(&[0.01, 0.02], Axis::Z, Axis::Y), [None, Some(-0.02)]);
    assert_eq!(find("delay").unwrap().carried_over(&[0.01], Axis::X, Axis::Y), [Some(0.01)]);
    assert_eq!(find("bias").unwrap().carried_over(&[0.01], Axis::X, Axis::Y), [None]);
}
