use super::*;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Thirteen trials of the BCG vaccine: log relative risk and its variance (Colditz et al. 1994), from the 2 × 2 tables that the R package
/// metafor has as `dat.bcg`.
const BCG: [[f64; 4]; 13] = [
    [4.0, 119.0, 11.0, 128.0],
    [6.0, 300.0, 29.0, 274.0],
    [3.0, 228.0, 11.0, 209.0],
    [62.0, 13536.0, 248.0, 12619.0],
    [33.0, 5036.0, 47.0, 5761.0],
    [180.0, 1361.0, 372.0, 1079.0],
    [8.0, 2537.0, 10.0, 619.0],
    [505.0, 87886.0, 499.0, 87892.0],
    [29.0, 7470.0, 45.0, 7232.0],
    [17.0, 1699.0, 65.0, 1600.0],
    [186.0, 50448.0, 141.0, 27197.0],
    [5.0, 2493.0, 3.0, 2338.0],
    [27.0, 16886.0, 29.0, 17825.0],
];

fn bcg(part: impl Fn(usize) -> usize) -> Vec<Reading> {
    let reading = |(k, [a, b, c, d]): (usize, &[f64; 4])| Reading {
        part: part(k),
        value: (a / (a + b) / (c / (c + d))).ln(),
        variance: 1.0 / a - 1.0 / (a + b) + 1.0 / c - 1.0 / (c + d),
    };
    BCG.iter().enumerate().map(reading).collect()
}

/// Fifty-six schools in eleven districts (Konstantopoulos 2011), `dat.konstantopoulos2011` of metafor: district, effect, variance.
pub(crate) const SCHOOLS: [(usize, f64, f64); 56] = [
    (0, -0.18, 0.118),
    (0, -0.22, 0.118),
    (0, 0.23, 0.144),
    (0, -0.3, 0.144),
    (1, 0.13, 0.014),
    (1, -0.26, 0.014),
    (1, 0.19, 0.015),
    (1, 0.32, 0.024),
    (2, 0.45, 0.023),
    (2, 0.38, 0.043),
    (2, 0.29, 0.012),
    (3, 0.16, 0.02),
    (3, 0.65, 0.004),
    (3, 0.36, 0.004),
    (3, 0.6, 0.007),
    (4, 0.08, 0.019),
    (4, 0.04, 0.007),
    (4, 0.19, 0.005),
    (4, -0.06, 0.004),
    (5, -0.18, 0.02),
    (5, 0.0, 0.018),
    (5, 0.0, 0.019),
    (5, -0.28, 0.022),
    (5, -0.04, 0.02),
    (5, -0.3, 0.021),
    (5, 0.07, 0.006),
    (5, 0.0, 0.007),
    (5, 0.05, 0.007),
    (5, -0.08, 0.007),
    (5, -0.09, 0.007),
    (6, 0.3, 0.015),
    (6, 0.98, 0.011),
    (6, 1.19, 0.01),
    (7, -0.07, 0.001),
    (7, -0.05, 0.001),
    (7, -0.01, 0.001),
    (7, 0.02, 0.001),
    (7, -0.03, 0.001),
    (7, 0.0, 0.001),
    (7, 0.01, 0.001),
    (7, -0.1, 0.001),
    (8, 0.5, 0.01),
    (8, 0.66, 0.011),
    (8, 0.2, 0.01),
    (8, 0.0, 0.009),
    (8, 0.05, 0.013),
    (8, 0.07, 0.013),
    (9, -0.52, 0.031),
    (9, 0.7, 0.031),
    (9, -0.03, 0.03),
    (9, 0.27, 0.03),
    (9, -0.34, 0.03),
    (10, 0.12, 0.087),
    (10, 0.61, 0.082),
    (10, 0.04, 0.067),
    (10, -0.05, 0.067),
];

/// Agrees to six digits.
fn agrees(own: f64, theirs: f64) {
    assert!((own / theirs - 1.0).abs() < 1e-6, "{own} here, {theirs} by metafor");
}

/// `rma(yi, vi, data=escalc(measure="RR", …, data=dat.bcg), method="REML", test="knha", control=list(threshold=1e-14))` of metafor 3.8-1, R
/// 4.2.2, and `predict` of it.
#[test]
fn the_spread_and_its_mean_are_those_of_metafor() {
    let found = Nested::fit(&bcg(|k| k)).unwrap();
    agrees(found.between, 0.313_243_258_136);
    agrees(found.mean, -0.714_532_342_158);
    agrees(found.std_error, 0.180_791_744_093);
    agrees(found.plain_error, 0.179_781_516_105);
    let (low, high) = found.next().unwrap();
    agrees(low, -1.996_016_834_2);
    agrees(high, 0.566_952_149_88);
    agrees(moments(&bcg(|k| k)), 0.308_760_262_862);
}

/// `rma.mv(yi, vi, random=~1|district/school, method="REML", control=list(optimizer="optim", optmethod="BFGS", reltol=1e-15))` of the same: its
/// optimum is found to some 1e-6.
#[test]
fn both_spreads_of_a_nested_model_are_those_of_metafor() {
    let readings: Vec<Reading> =
        SCHOOLS.iter().map(|&(part, value, variance)| Reading { part, value, variance }).collect();
    let found = Nested::fit(&readings).unwrap();
    let near = |own: f64, theirs: f64| assert!((own / theirs - 1.0).abs() < 5e-6, "{own} here, {theirs} by metafor");
    near(found.between, 0.065_061_946_890_3);
    near(found.within, 0.032_736_515_704_1);
    near(found.mean, 0.184_713_164_038);
    near(found.plain_error, 0.084_555_920_007);
}

/// `lmer(yi ~ 1 + (1 | district), REML=TRUE)` of lme4 1.1-31 on the schools: it knows no error of a reading, so that its residual is the
/// spread between logs and the error together, here the same for all.
#[test]
fn both_spreads_of_a_nested_model_with_one_error_are_those_of_lme4() {
    let readings: Vec<Reading> =
        SCHOOLS.iter().map(|&(part, value, _)| Reading { part, value, variance: 0.01 }).collect();
    let found = Nested::fit(&readings).unwrap();
    let near = |own: f64, theirs: f64| assert!((own / theirs - 1.0).abs() < 5e-6, "{own} here, {theirs} by lme4");
    near(found.between, 0.057_687_221_153);
    near(found.within + 0.01, 0.061_310_357_181);
    near(found.mean, 0.172_430_933_198);
    near(found.plain_error, 0.080_527_015_278);
}

/// Readings that scatter less than their errors say: `test="adhoc"` of metafor, on the vaccine's values with errors ten times as large, has
/// the plain standard error.
#[test]
fn a_mean_is_never_surer_than_its_readings() {
    let all: Vec<Reading> = bcg(|k| k).iter().map(|r| Reading { variance: 100.0 * r.variance, ..*r }).collect();
    let found = Nested::fit(&all).unwrap();
    assert!(found.between == 0.0 && found.std_error == found.plain_error);
    agrees(found.mean, -0.430_285_163_654);
    agrees(found.std_error, 0.404_987_517_109);
}

#[test]
fn the_moment_start_is_that_of_dersimonian_and_laird() {
    assert!((moments(&bcg(|k| k)) - 0.3088).abs() < 5e-5, "{}", moments(&bcg(|k| k)));
}

#[test]
fn one_reading_a_part_leaves_no_spread_between_logs_and_one_part_none_between_parts() {
    let each = Nested::fit(&bcg(|k| k)).unwrap();
    assert!(each.within == 0.0 && each.between > 0.0 && each.parts == 13);
    let one = Nested::fit(&bcg(|_| 0)).unwrap();
    assert!(one.between == 0.0 && one.within > 0.0 && one.parts == 1 && one.next().is_none());
    assert!((one.within - each.between).abs() < 1e-9 && (one.mean - each.mean).abs() < 1e-9);
}

#[test]
fn the_slopes_are_those_of_the_likelihood() {
    let readings = bcg(|k| k / 3);
    let parts = 5;
    for (between, within) in [(0.0, 0.1), (0.2, 0.05), (0.7, 0.3)] {
        let here = at(&readings, parts, between, within);
        let h = 1e-6;
        let numeric = [
            (cost(&readings, parts, between + h, within) - cost(&readings, parts, between + 2.0 * h, within))
                / (2.0 * h),
            (cost(&readings, parts, between, within + h) - cost(&readings, parts, between, within + 2.0 * h))
                / (2.0 * h),
        ];
        for (slope, numeric) in here.slope.iter().zip(numeric) {
            assert!((slope - numeric).abs() < 1e-3 * (1.0 + slope.abs()), "{slope} {numeric}");
        }
    }
}

/// Readings of parts and logs with these spreads.
fn drawn(seed: u64, parts: usize, logs: usize, between: f64, within: f64, error: f64) -> Vec<Reading> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    let mut all = Vec::new();
    for part in 0..parts {
        let own = between * normal();
        for _ in 0..logs {
            let value = 1.0 + own + within * normal() + error * normal();
            all.push(Reading { part, value, variance: error * error });
        }
    }
    all
}

#[test]
fn both_spreads_come_out_as_they_went_in() {
    let found: Vec<Nested> = (0..60).map(|seed| Nested::fit(&drawn(seed, 40, 4, 0.3, 0.2, 0.1)).unwrap()).collect();
    let mean = |of: &dyn Fn(&Nested) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
    assert!((mean(&|n| n.between) / 0.09 - 1.0).abs() < 0.12, "{}", mean(&|n| n.between));
    assert!((mean(&|n| n.within) / 0.04 - 1.0).abs() < 0.06, "{}", mean(&|n| n.within));
    assert!((mean(&|n| n.mean) - 1.0).abs() < 0.03);
    let covered = found.iter().filter(|n| ((n.mean - 1.0) / n.std_error).abs() < 2.02).count();
    assert!(covered >= 51, "95 % intervals hold the truth in {covered} of 60");
}

#[test]
fn without_an_effect_few_means_and_few_spreads_are_significant() {
    let found: Vec<Nested> =
        (0..400).map(|seed| Nested::fit(&drawn(seed + 900, 6, 2, 0.0, 0.0, 0.1)).unwrap()).collect();
    let shifted = found
        .iter()
        .filter(|n| 2.0 * StudentsT::new(0.0, 1.0, n.freedom).unwrap().sf((n.mean - 1.0).abs() / n.std_error) < 0.05)
        .count();
    let spread = found.iter().filter(|n| n.p_of_spread() < 0.05).count();
    // With the plain error the quantile of t with five degrees of freedom, 2.57, leaves 1 %: few parts are told with care.
    assert!((1..=20).contains(&shifted), "{shifted} of 400 at 5 %");
    assert!(spread <= 32, "{spread} of 400 at 5 %");
}

#[test]
fn the_gain_is_the_sum_of_the_parts_gains_and_nothing_gains_nothing() {
    let all = drawn(5, 8, 3, 0.3, 0.2, 0.1);
    let nested = Nested::fit(&all).unwrap();
    let each: f64 = (0..8).map(|part| nested.gain_of_part(&all[3 * part..3 * part + 3])).sum();
    assert!((nested.gain - each).abs() < 1e-9 * each.abs(), "{} {each}", nested.gain);
    assert!(nested.gain > 100.0, "{}", nested.gain);
    let none: Vec<Reading> = all.iter().map(|r| Reading { value: r.value - 1.0, ..*r }).collect();
    let flat: Vec<Reading> =
        drawn(6, 8, 3, 0.0, 0.0, 0.1).iter().map(|r| Reading { value: r.value - 1.0, ..*r }).collect();
    assert!(Nested::fit(&flat).unwrap().gain < 5.0 && Nested::fit(&none).unwrap().gain > 20.0);
}

#[test]
fn the_next_part_lies_in_its_interval() {
    let inside = (0..300).filter(|&seed| {
        let all = drawn(seed + 7000, 13, 1, 0.3, 0.0, 0.05);
        let (low, high) = Nested::fit(&all[..12]).unwrap().next().unwrap();
        (low..=high).contains(&all[12].value)
    });
    let inside = inside.count();
    assert!(inside >= 275, "95 % intervals hold the next part in {inside} of 300");
}

#[test]
fn a_step_is_found_where_it_is_and_noise_has_none() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    let mut late = 0;
    for at in [5_usize, 10, 14] {
        let readings: Vec<(f64, f64)> = (0..20).map(|k| (normal() + if k < at { 0.0 } else { 6.0 }, 1.0)).collect();
        let found = change(&readings, f64::INFINITY).unwrap();
        assert!(
            found.p_value < 1e-6
                && found.from <= at
                && at <= found.to
                && (found.by - 6.0).abs() < 4.0 * found.std_error,
            "{found:?}"
        );
        late += found.after.abs_diff(at);
    }
    assert!(late <= 1, "{late}");
    let alarms = (0..300).filter(|_| {
        let readings: Vec<(f64, f64)> = (0..20).map(|_| (normal(), 1.0)).collect();
        change(&readings, f64::INFINITY).unwrap().p_value < 0.05
    });
    let alarms = alarms.count();
    assert!(alarms <= 21, "{alarms} of 300 at 5 %");
}

#[test]
fn logs_that_scatter_are_no_change_and_a_part_that_changed_is_no_scatter() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    // Eight parts of four logs, each mounted anew: the scatter is 25 times a log's error.
    let mut parts = |step: f64| -> Vec<Vec<(f64, f64)>> {
        (0..8)
            .map(|part| {
                let level = |k: usize| if part == 3 && k >= 2 { step } else { 0.0 };
                (0..4).map(|k| (level(k) + 0.5 * normal() + 0.02 * normal(), 0.02_f64.powi(2))).collect()
            })
            .collect()
    };
    let p_values = |parts: &[Vec<(f64, f64)>]| -> Vec<f64> {
        let Scatter { variance, freedom } = scatter(parts);
        let own = |part: &Vec<(f64, f64)>| part.iter().map(|(value, own)| (*value, own + variance)).collect::<Vec<_>>();
        parts.iter().map(|part| change(&own(part), freedom).unwrap().p_value).collect()
    };
    let alarms = (0..200).flat_map(|_| p_values(&parts(0.0))).filter(|p| *p < 0.05).count();
    assert!((40..=112).contains(&alarms), "{alarms} of 1600 at 5 %");
    let found = (0..50).filter(|_| p_values(&parts(8.0))[3] < 2e-3 / 8.0).count();
    assert!(found >= 45, "{found} of 50");
    // One odd log of four is no change.
    let odd = [(0.0, 1.0), (50.0, 1.0), (50.0, 1.0), (50.0, 1.0)];
    assert_eq!(change(&odd, f64::INFINITY).unwrap().after, 2);
    assert!(change(&odd[..3], f64::INFINITY).is_none());
    // Errors that explain everything leave no scatter, and are known.
    let none = scatter(&[vec![(0.0, 1.0), (0.1, 1.0), (-0.1, 1.0), (0.0, 1.0)]]);
    assert_eq!((none.variance, none.freedom), (0.0, f64::INFINITY));
}

#[test]
fn readings_that_no_log_makes_are_left_out_and_nothing_panics() {
    let sound = drawn(1, 6, 2, 0.2, 0.1, 0.1);
    for (value, variance) in [(1e300, 1.0), (f64::NAN, 1.0), (1e200, 1e-200), (1.0, 1e-200), (1.0, f64::INFINITY)] {
        let poisoned: Vec<Reading> = sound.iter().copied().chain([Reading { part: 2, value, variance }]).collect();
        let (a, b) = (Nested::fit(&sound).unwrap(), Nested::fit(&poisoned).unwrap());
        assert_eq!(a, b);
        assert!(
            (0.0..=1.0).contains(&b.p_of_part(&poisoned))
                && (0.0..=1.0).contains(&b.beside(&poisoned).p_of_part(&poisoned))
        );
    }
    for odd in [f64::NAN, f64::INFINITY] {
        let nested = Nested { mean: odd, spread_ratio: odd, between: 1.0, ..Nested::fit(&sound).unwrap() };
        let all = [nested.p_of_mean(), nested.p_of_spread(), nested.p_of_part(&sound)];
        assert!(all.iter().all(|p| (0.0..=1.0).contains(p)), "{all:?}");
    }
}

#[test]
fn of_hypotheses_that_hold_few_are_refused() {
    assert_eq!(discoveries(&[0.5, 0.001, 0.04, 0.9, 0.012], 0.05), [false, true, false, false, true]);
    assert_eq!(discoveries(&[0.5, 0.6], 0.05), [false, false]);
    assert!(discoveries(&[], 0.05).is_empty());
}

proptest! {
    #[test]
    fn the_order_of_the_readings_changes_nothing(seed in 0_u64..500, turn in 1_usize..20) {
        let all = drawn(seed, 7, 3, 0.2, 0.1, 0.1);
        let mut turned = all.clone();
        turned.rotate_left(turn);
        let (a, b) = (Nested::fit(&all).unwrap(), Nested::fit(&turned).unwrap());
        for (a, b) in [(a.mean, b.mean), (a.between, b.between), (a.within, b.within), (a.std_error, b.std_error)] {
            prop_assert!((a - b).abs() < 1e-8 * (1.0 + a.abs()), "{a} {b}");
        }
    }

    #[test]
    fn values_in_another_unit_give_the_same_in_that_unit(seed in 0_u64..500, factor in 1e-6..1e6_f64) {
        let all = drawn(seed, 6, 2, 0.2, 0.1, 0.1);
        let scaled: Vec<Reading> = all
            .iter()
            .map(|r| Reading { value: factor * r.value, variance: factor * factor * r.variance, ..*r })
            .collect();
        let (a, b) = (Nested::fit(&all).unwrap(), Nested::fit(&scaled).unwrap());
        prop_assert!((b.mean / factor - a.mean).abs() < 1e-8);
        prop_assert!((b.between / factor.powi(2) - a.between).abs() < 1e-7, "{} {}", b.between / factor.powi(2), a.between);
        prop_assert!((b.within / factor.powi(2) - a.within).abs() < 1e-7);
    }
}
