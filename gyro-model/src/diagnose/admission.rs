//! Which suspects are let in, which are worth a mention, and which effects of a model stay.

use super::{
    case::{
        AFTER, BEFORE, Case, DOUBT, FALL, GROWS, HELD_OUT, HELD_SHARE, IS_AT_BOUND, IS_BEYOND_WANDER, IS_IN_READING,
        IS_IN_REFERENCE, IS_LINE, IS_MEAN, IS_SHAPE_AT_BOUND, IS_SLOW, JUDGED, LEAVES_NOISE, MAY_BE_ALIASED, P_VALUE,
        RATIO, REMOVED, SILENCES, SIZE, SWINGS,
    },
    decision::{
        Condition::{self, Above, Below, Is, Not},
        Test,
    },
};
use crate::{diagnosis::TestName, thresholds as limit};

/// What other missing physics cannot hide: the error itself falls, and by much.
const DOMINATES: [Condition<Case>; 4] = [
    Above(&BEFORE, &limit::ROUGH),
    Is(&IS_BEYOND_WANDER),
    Above(&REMOVED, &limit::DOMINATES),
    Above(&FALL, &limit::FALLS),
];
/// The same of an effect that goes slowly.
const DOMINATES_SLOWLY: [Condition<Case>; 5] = [
    Is(&IS_SLOW),
    Above(&BEFORE, &limit::ROUGH),
    Is(&IS_BEYOND_WANDER),
    Above(&REMOVED, &limit::DOMINATES),
    Above(&FALL, &limit::FALLS_SLOWLY),
];
/// A line that the sensor felt: no bias that wanders draws one.
const PLAIN_LINE: [Condition<Case>; 4] =
    [Is(&IS_LINE), Below(&P_VALUE, &limit::PLAIN), Is(&LEAVES_NOISE), Is(&IS_IN_READING)];

/// What a suspect has to pass to be named, and to be added by the ladder.
pub(super) static ADMISSION: &[Test<Case>] = &[
    Test {
        name: TestName::Bounds,
        asks: "no parameter is at its physical bound; a shape parameter may be, where the effect dominates the error",
        applies: &[JUDGED],
        ways: &[
            &[Not(&IS_AT_BOUND), Not(&IS_SHAPE_AT_BOUND)],
            &[Not(&IS_AT_BOUND), DOMINATES[0], DOMINATES[1], DOMINATES[2], DOMINATES[3]],
        ],
    },
    Test {
        name: TestName::Known,
        asks: "every parameter is known: its standard error is below its own size, or below a tenth of the log for an instant. Otherwise \
               the simpler effect that it contains is tried in its place",
        applies: &[JUDGED],
        ways: &[&[Below(&DOUBT, &limit::KNOWN)]],
    },
    Test {
        name: TestName::Error,
        asks: "the held-out error falls; near the floor it may rise by 1 %, where the likelihood is clear",
        applies: &[JUDGED],
        ways: &[
            &[Below(&RATIO, &limit::LOWERS_BESIDE_OTHERS)],
            &[Is(&IS_LINE), Below(&RATIO, &limit::SCATTERS)],
            &[
                Below(&P_VALUE, &limit::PLAIN),
                Above(&HELD_OUT, &limit::CLEAR),
                Below(&BEFORE, &limit::NOISE),
                Is(&LEAVES_NOISE),
                Below(&RATIO, &limit::SCATTERS),
            ],
        ],
    },
    Test {
        name: TestName::EveryAveragingTime,
        asks: "at no averaging time where the held-out error is more than noise does it grow by a tenth",
        applies: &[JUDGED],
        ways: &[&[Below(&GROWS, &limit::GROWS)]],
    },
    Test {
        name: TestName::Rows,
        asks: "it does not mark nearly all steps as unknown: one of the 30 blocks at least is left to judge it by",
        applies: &[JUDGED],
        ways: &[&[Below(&SILENCES, &limit::LEAVES_OUT)]],
    },
    Test {
        name: TestName::Significance,
        asks: "noise alone would rarely gain as much (likelihood-ratio test, corrected for the search), or the effect dominates the error",
        applies: &[JUDGED],
        ways: &[&[Below(&P_VALUE, &limit::SIGNIFICANCE)], &DOMINATES, &DOMINATES_SLOWLY],
    },
    Test {
        name: TestName::Share,
        asks: "it removes a tenth of J − 1; near the floor it may remove less, if p is very small and only noise is left",
        applies: &[JUDGED, Above(&BEFORE, &limit::NOISE)],
        ways: &[
            &[Above(&REMOVED, &limit::SHARE)],
            &[Below(&BEFORE, &limit::ROUGH), Below(&P_VALUE, &limit::PLAIN), Is(&LEAVES_NOISE)],
            &PLAIN_LINE,
        ],
    },
    Test {
        name: TestName::Size,
        asks: "while much error is unexplained, no coefficient is far larger than such sensors have",
        applies: &[JUDGED, Above(&AFTER, &limit::ROUGH)],
        ways: &[&[Below(&SIZE, &limit::OUTSIZED)]],
    },
    Test {
        name: TestName::Line,
        asks: "while much error is unexplained, a spectral line is in the gyro's own readings",
        applies: &[JUDGED, Is(&IS_LINE), Above(&AFTER, &limit::ROUGH)],
        ways: &[&PLAIN_LINE],
    },
    Test {
        name: TestName::Motion,
        asks: "a spectral line, if it is fast or far larger than such sensors have, is not in the reference: a line in both is motion, perhaps \
               aliased",
        applies: &[JUDGED, Is(&IS_LINE)],
        ways: &[&[Not(&IS_IN_REFERENCE)], &[Below(&SIZE, &limit::OUTSIZED), Not(&MAY_BE_ALIASED)]],
    },
    Test {
        name: TestName::Mean,
        asks: "an effect that averages over time also reduces noise, so it is named only where the error is more than noise",
        applies: &[JUDGED, Is(&IS_MEAN)],
        ways: &[&[Above(&BEFORE, &limit::NOISE)]],
    },
    Test {
        name: TestName::HeldOut,
        asks: "it improves the likelihood or the error on blocks that it was not fitted on; an effect that shows only once removes much of the error",
        applies: &[JUDGED],
        ways: &[
            &[Above(&HELD_SHARE, &limit::HOLDS), Above(&HELD_OUT, &limit::HELD_OUT)],
            &[Above(&HELD_SHARE, &limit::HOLDS), Above(&FALL, &limit::FALLS_TOO)],
            &[Above(&FALL, &limit::FALLS)],
            &[
                Is(&IS_SLOW),
                Below(&SWINGS, &limit::SWINGS),
                Below(&P_VALUE, &limit::PLAIN),
                Above(&BEFORE, &limit::ROUGH),
                Above(&REMOVED, &limit::DOMINATES),
            ],
        ],
    },
    Test {
        name: TestName::ShownOnce,
        asks: "an effect that shows only once has a very small p, or dominates the error, since a wandering bias can look like it",
        applies: &[JUDGED, Is(&IS_SLOW), Below(&SWINGS, &limit::SWINGS)],
        ways: &[&[Below(&P_VALUE, &limit::PLAIN)], &DOMINATES_SLOWLY],
    },
];

/// What a suspect has to pass to be listed, be it that it is not let in.
pub(super) static MENTION: &[Test<Case>] = &[
    Test {
        name: TestName::Bounds,
        asks: "no parameter is at its physical bound",
        applies: &[],
        ways: &[&[Not(&IS_AT_BOUND), Not(&IS_SHAPE_AT_BOUND)]],
    },
    Test {
        name: TestName::Significance,
        asks: "noise alone would rarely gain as much",
        applies: &[],
        ways: &[&[Below(&P_VALUE, &limit::SIGNIFICANCE)]],
    },
    Test {
        name: TestName::HeldOut,
        asks: "the likelihood holds on data that were not fitted, or the error falls",
        applies: &[],
        ways: &[&[Above(&HELD_OUT, &limit::NOTHING)], &[Above(&FALL, &limit::FALLS)]],
    },
];

/// What an effect of a model has to pass to stay, the model without it being what stands.
pub(super) static ELIMINATION: &[Test<Case>] = &[
    Test {
        name: TestName::Error,
        asks: "the held-out error is larger without it; near the floor it may be smaller by 1 %",
        applies: &[],
        ways: &[
            &[Below(&RATIO, &limit::LOWERS)],
            &[Below(&BEFORE, &limit::NOISE), Is(&LEAVES_NOISE), Below(&RATIO, &limit::SCATTERS)],
        ],
    },
    Test {
        name: TestName::Significance,
        asks: "noise alone would rarely gain as much, or J is larger by a tenth without it",
        applies: &[],
        ways: &[&[Below(&P_VALUE, &limit::SIGNIFICANCE)], &[Below(&RATIO, &limit::NEEDED)]],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        diagnose::decision::{outcomes, passes},
        statistics::Estimate,
    };

    /// The names of the tests that refuse a case.
    fn refused(case: &Case) -> Vec<TestName> {
        let all = outcomes(ADMISSION, case).into_iter();
        all.filter(|outcome| !outcome.passed).map(|outcome| outcome.test).collect()
    }

    #[test]
    fn an_effect_that_takes_all_of_an_error_is_let_in() {
        assert_eq!(refused(&Case::UNKNOWN), []);
    }

    #[test]
    fn what_the_readings_show_is_let_in_whatever_the_error_does() {
        assert!(passes(ADMISSION, &Case { is_read_off: true, after: 20.0, p_value: 1.0, ..Case::UNKNOWN }));
    }

    #[test]
    fn each_test_refuses_what_it_is_for() {
        let no_more = Estimate { value: 0.01, std_error: 0.1 };
        let weak = Case { before: 1.4, after: 1.1, fall: no_more, is_beyond_wander: false, ..Case::UNKNOWN };
        let cases = [
            ("bounds", Case { is_at_bound: true, ..Case::UNKNOWN }),
            ("bounds", Case { is_shape_at_bound: true, ..weak }),
            ("known", Case { doubt: 1.5, ..Case::UNKNOWN }),
            ("known", Case { doubt: f64::INFINITY, ..weak }),
            ("error", Case { after: 10.1, ..Case::UNKNOWN }),
            ("every averaging time", Case { grows: 1.5, ..Case::UNKNOWN }),
            ("rows", Case { silences: 0.99, ..Case::UNKNOWN }),
            ("significance", Case { p_value: 0.01, ..weak }),
            ("share", Case { after: 9.5, ..Case::UNKNOWN }),
            ("size", Case { size: 50.0, after: 2.0, ..Case::UNKNOWN }),
            ("line", Case { is_line: true, after: 8.0, ..Case::UNKNOWN }),
            ("motion", Case { is_line: true, size: 50.0, is_in_reading: true, is_in_reference: true, ..Case::UNKNOWN }),
            ("motion", Case { is_line: true, may_be_aliased: true, is_in_reference: true, ..Case::UNKNOWN }),
            ("mean", Case { is_mean: true, before: 1.1, ..weak }),
            ("held-out", Case { held_out: Estimate { value: 80.0, std_error: 90.0 }, p_value: 1e-3, ..weak }),
            ("held-out", Case { held_out: Estimate { value: -3.0, std_error: 1.0 }, ..weak }),
            ("shown once", Case { is_slow: true, swings: 1.0, p_value: 6e-4, ..weak }),
        ];
        for (test, case) in cases {
            assert!(refused(&case).iter().any(|name| name.name() == test), "{test}: {:?} of {case:?}", refused(&case));
        }
    }

    #[test]
    fn a_shape_may_stand_at_its_bound_where_the_effect_is_what_is_missing() {
        assert!(passes(ADMISSION, &Case { is_shape_at_bound: true, ..Case::UNKNOWN }));
    }

    #[test]
    fn beside_other_effects_a_fall_of_the_error_within_their_forms_is_none() {
        let slight = Case { before: 1.6, after: 1.598, ..Case::UNKNOWN };
        assert!(refused(&slight).contains(&TestName::Error));
    }

    #[test]
    fn an_effect_stays_where_it_is_significant_or_the_error_grows_without_it() {
        let stays = |case: Case| passes(ELIMINATION, &case);
        assert!(stays(Case { p_value: 0.5, ..Case::UNKNOWN }));
        assert!(stays(Case { before: 1.02, after: 1.01, ..Case::UNKNOWN }));
        assert!(!stays(Case { before: 1.02, after: 1.01, p_value: 0.5, ..Case::UNKNOWN }));
        assert!(!stays(Case { before: 3.0, after: 3.1, ..Case::UNKNOWN }));
    }
}
