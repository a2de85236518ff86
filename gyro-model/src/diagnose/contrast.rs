//! Two suspects in one place, side by side: plain numbers, and the tests of what two are to one another.

use super::decision::{
    Condition::{Above, Below, Is, Not},
    Fact, Measure, Test,
};
use crate::{diagnosis::TestName, statistics::Estimate, thresholds as limit};

/// What the tests see of two suspects, the first held against the second.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "facts that are independent of one another")]
pub(super) struct Contrast {
    /// J of both.
    pub after: [f64; 2],
    /// J of both on the rows that they keep.
    pub kept: [f64; 2],
    /// Gain in ln L of both.
    pub gain: [f64; 2],
    /// Held-out gain in ln L of both.
    pub held_out: [f64; 2],
    /// Parameters of both.
    pub freedom: [f64; 2],
    /// Whether only one leaves rows out.
    pub leave_other_rows: bool,
    /// Whether either goes slowly.
    pub is_slow: bool,
    /// Whether the catalogue says that one may be taken for the other.
    pub are_aliases: bool,
    /// Whether the motion is one exact sine.
    pub is_one_sine: bool,
    /// Which of both go with a measured channel.
    pub measured: [bool; 2],
    /// Held-out gain in ln L of the first over the second, block by block, less what noise inflates it by.
    pub gain_apart: Estimate,
    /// ln(J₂/J₁) over the blocks.
    pub error_apart: Estimate,
    /// What steps may make of a gain: those of an encoder on a motion that repeats itself, and those of a coarse temperature; 0 where
    /// there are none, or it is not known yet.
    pub of_steps: f64,
    /// Times that noise alone gains more than white noise would.
    pub inflation: f64,
}

impl Contrast {
    /// The larger J.
    fn worst(&self) -> f64 {
        self.after[0].max(self.after[1])
    }

    /// Standard error of the held-out gain apart. Twenty blocks tell it roughly. Of two models that are nearly right it is known: where
    /// their predictions lie d standard deviations of the noise apart, ln L differs by d²/2 with a standard deviation of d. (What
    /// shows once, a bias that wanders may make in one block.)
    fn gain_error(&self) -> f64 {
        let of_blocks = self.gain_apart.std_error;
        let apart = (self.gain[0] - self.gain[1]).abs() / self.inflation;
        if self.worst() < limit::ROUGH.value && !self.is_slow { of_blocks.min((2.0 * apart).sqrt()) } else { of_blocks }
    }

    /// The same two the other way round.
    #[cfg(test)]
    pub(super) fn turned(self) -> Self {
        let Self {
            after: [a, b], kept: [c, d], gain: [e, f], held_out: [g, h], freedom: [i, j], measured: [k, l], ..
        } = self;
        let (gain_apart, error_apart) = (-self.gain_apart, -self.error_apart);
        Self {
            after: [b, a],
            kept: [d, c],
            gain: [f, e],
            held_out: [h, g],
            freedom: [j, i],
            measured: [l, k],
            gain_apart,
            error_apart,
            ..self
        }
    }
}

type M = Measure<Contrast>;
type F = Fact<Contrast>;

static WORST: M = Measure { name: "the larger J", of: |c| c.worst() };
static RATIO: M = Measure { name: "J of the first over that of the second", of: |c| c.after[0] / c.after[1] };
static RATIO_BACK: M = Measure { name: "J of the second over that of the first", of: |c| c.after[1] / c.after[0] };
static KEPT_MOST: M =
    Measure { name: "the larger J, each on the rows that it keeps", of: |c| c.kept[0].max(c.kept[1]) };
static KEPT_RATIO: M = Measure {
    name: "larger over smaller J, each on the rows that it keeps",
    of: |c| c.kept[0].max(c.kept[1]) / c.kept[0].min(c.kept[1]),
};
static ERROR_APART: M = Measure { name: "difference in ln J", of: |c| c.error_apart.value.abs() };
static ERROR_APART_SE: M = Measure { name: "difference in ln J", of: |c| c.error_apart.in_errors().abs() };
static GAIN_APART: M = Measure { name: "difference in held-out ln L", of: |c| c.gain_apart.value.abs() };
static GAIN_APART_SE: M =
    Measure { name: "difference in held-out ln L", of: |c| c.gain_apart.value.abs() / c.gain_error() };
static GAIN_MORE: M = Measure { name: "ln L of the first over that of the second", of: |c| c.gain[0] - c.gain[1] };
static GAIN_BEYOND_STEPS: M = Measure {
    name: "difference in ln L less what steps of the encoder or the temperature may add to it",
    of: |c| (c.gain[0] - c.gain[1]).abs() - c.of_steps,
};
static HELD_OUT_MORE: M =
    Measure { name: "held-out ln L of the first over that of the second", of: |c| c.held_out[0] - c.held_out[1] };
static HELD_OUT_RATIO: M =
    Measure { name: "held-out gain of the first, as a share of the second's", of: |c| c.held_out[0] / c.held_out[1] };
static PARAMETERS_MORE: M =
    Measure { name: "parameters of the first over those of the second", of: |c| c.freedom[0] - c.freedom[1] };

static PARAMETERS_LESS: M =
    Measure { name: "parameters of the second over those of the first", of: |c| c.freedom[1] - c.freedom[0] };
static GAIN_A_PARAMETER: M = Measure {
    name: "ln L of the first over that of the second, a parameter that it has more, and one",
    of: |c| (c.gain[0] - c.gain[1]) / (1.0 + (c.freedom[0] - c.freedom[1]).max(0.0)),
};

static ARE_ALIASES: F = Fact { says: "aliases in the catalogue", of: |c| c.are_aliases };
static ON_ONE_SINE: F = Fact { says: "on one exact sine", of: |c| c.is_one_sine };
static OTHER_ROWS: F = Fact { says: "only one leaves rows out", of: |c| c.leave_other_rows };
static AT_ODDS: F =
    Fact { says: "the likelier one has the larger J", of: |c| (c.gain[0] > c.gain[1]) == (c.after[0] > c.after[1]) };
static MEASURED_AS_WELL: F = Fact {
    says: "the second going with a measured channel where the first does",
    of: |c| c.measured[1] || !c.measured[0],
};
static ALONE_MEASURED: F =
    Fact { says: "the second alone going with a measured channel", of: |c| c.measured[1] && !c.measured[0] };

const SAME_ROWS: Test<Contrast> = Test {
    name: TestName::Rows,
    asks: "where only one leaves rows out, both leave about the same error on the rows that they keep",
    applies: &[Is(&OTHER_ROWS)],
    ways: &[&[Below(&KEPT_MOST, &limit::ROUGH)], &[Below(&KEPT_RATIO, &limit::KEPT_ALIKE)]],
};

/// Whether a log tells two suspects apart: both pass where it does not.
pub(super) static ALIKE: &[Test<Contrast>] = &[
    SAME_ROWS,
    Test {
        name: TestName::Likelihood,
        asks: "their held-out likelihoods differ by no more than noise or the steps of a channel explain",
        applies: &[],
        ways: &[
            &[Below(&GAIN_APART, &limit::GAIN_FOUND_TO)],
            &[Is(&ARE_ALIASES), Below(&GAIN_APART, &limit::GAIN_WITHIN_FORM)],
            &[Below(&GAIN_APART_SE, &limit::APART)],
            &[Below(&WORST, &limit::ROUGH), Below(&GAIN_BEYOND_STEPS, &limit::NO_MORE)],
            &[Is(&ON_ONE_SINE), Is(&OTHER_ROWS), Below(&WORST, &limit::ROUGH), Is(&AT_ODDS)],
        ],
    },
    Test {
        name: TestName::Error,
        asks: "their held-out errors differ by no more than noise or the steps of a channel explain",
        applies: &[],
        ways: &[
            &[Below(&ERROR_APART, &limit::ERROR_FOUND_TO)],
            &[Below(&ERROR_APART_SE, &limit::APART)],
            &[Below(&WORST, &limit::ROUGH), Below(&GAIN_BEYOND_STEPS, &limit::NO_MORE)],
            &[Is(&ON_ONE_SINE), Is(&OTHER_ROWS), Below(&WORST, &limit::ROUGH), Is(&AT_ODDS)],
        ],
    },
];

/// Whether the first does as well as the second, better or alike, by either measure.
pub(super) static EQUALS: &[Test<Contrast>] = &[
    SAME_ROWS,
    Test {
        name: TestName::Error,
        asks: "its error is no larger",
        applies: &[],
        ways: &[
            &[Below(&RATIO, &limit::LOWERS)],
            &[Below(&ERROR_APART, &limit::ERROR_FOUND_TO)],
            &[Below(&ERROR_APART_SE, &limit::APART)],
        ],
    },
    Test {
        name: TestName::Likelihood,
        asks: "its held-out likelihood is no less",
        applies: &[],
        ways: &[
            &[Above(&HELD_OUT_MORE, &limit::NO_MORE)],
            &[Below(&GAIN_APART, &limit::GAIN_FOUND_TO)],
            &[Is(&ARE_ALIASES), Below(&GAIN_APART, &limit::GAIN_WITHIN_FORM)],
            &[Below(&GAIN_APART_SE, &limit::APART)],
        ],
    },
];

/// Whether what the second gains beyond the first is a small share of what both gain.
pub(super) static NEARLY_EQUALS: &[Test<Contrast>] = &[
    Test {
        name: TestName::Error,
        asks: "its error is larger by 3 % at most",
        applies: &[],
        ways: &[&[Below(&RATIO, &limit::CLOSE)]],
    },
    Test {
        name: TestName::Likelihood,
        asks: "its held-out gain is less by 3 % at most",
        applies: &[],
        ways: &[&[Above(&HELD_OUT_RATIO, &limit::GAIN_CLOSE)]],
    },
];

/// Whether the first, both being nearly right, is likelier than the second by less than a parameter is worth.
pub(super) static HARDLY_BEATS: &[Test<Contrast>] = &[
    Test {
        name: TestName::Error,
        asks: "both are nearly right, and the second's error is larger by a tenth at most",
        applies: &[],
        ways: &[&[Below(&WORST, &limit::ROUGH), Below(&RATIO_BACK, &limit::CLOSE_IF_PLAINER)]],
    },
    Test {
        name: TestName::Likelihood,
        asks: "its likelihood is not worth one more parameter",
        applies: &[],
        ways: &[&[Below(&GAIN_MORE, &limit::PARAMETER)]],
    },
];

/// Whether the second is the plainer one: fewer parameters, and no free shape in the place of a measured channel.
pub(super) static PLAINER: &[Test<Contrast>] = &[
    Test {
        name: TestName::Parameters,
        asks: "the second has fewer parameters",
        applies: &[],
        ways: &[&[Above(&PARAMETERS_MORE, &limit::NO_MORE)]],
    },
    Test {
        name: TestName::Channel,
        asks: "the second depends on a measured channel where the first does",
        applies: &[],
        ways: &[&[Is(&MEASURED_AS_WELL)]],
    },
];

/// The same for the order of suspects, where a measured channel is worth one more parameter.
pub(super) static SIMPLER: &[Test<Contrast>] = &[Test {
    name: TestName::Parameters,
    asks: "the second has fewer parameters, or one more at most and a measured channel where the first has a free shape",
    applies: &[],
    ways: &[
        &[Above(&PARAMETERS_MORE, &limit::NO_MORE)],
        &[Is(&ALONE_MEASURED), Below(&PARAMETERS_LESS, &limit::ONE_PARAMETER)],
    ],
}];

/// Whether the first belongs in the place of the second, which the model has.
pub(super) static REPLACES: &[Test<Contrast>] = &[
    Test {
        name: TestName::Error,
        asks: "both are nearly right, and its error is larger by 3 % at most",
        applies: &[],
        ways: &[&[Below(&WORST, &limit::ROUGH), Below(&RATIO, &limit::CLOSE)]],
    },
    Test {
        name: TestName::Likelihood,
        asks: "it is likelier by what its parameters are worth, and one more",
        applies: &[],
        ways: &[&[Above(&GAIN_A_PARAMETER, &limit::PARAMETER)]],
    },
];

/// Which of two leads: by the held-out error where that tells them apart, else by the held-out likelihood, which tells more finely.
/// Passed where the first, whose error is larger, may lead nevertheless.
pub(super) static MAY_LEAD: &[Test<Contrast>] = &[Test {
    name: TestName::Error,
    asks: "its error is the least, or, both being nearly right, within 3 % or two standard errors of the least",
    applies: &[],
    ways: &[
        &[Below(&WORST, &limit::ROUGH), Below(&RATIO, &limit::CLOSE)],
        &[Below(&WORST, &limit::ROUGH), Below(&ERROR_BEHIND_SE, &limit::APART)],
        &[Not(&ERRS_MORE)],
    ],
}];

static ERROR_BEHIND_SE: M = Measure { name: "ln J behind the least", of: |c| -c.error_apart.in_errors() };
static ERRS_MORE: F = Fact { says: "erring more", of: |c| c.after[0] > c.after[1] };

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::decision::passes;

    const TWO: Contrast = Contrast {
        after: [1.1, 1.1],
        kept: [1.1, 1.1],
        gain: [50.0, 48.0],
        held_out: [40.0, 39.0],
        freedom: [2.0, 1.0],
        leave_other_rows: false,
        is_slow: false,
        are_aliases: false,
        is_one_sine: false,
        measured: [false, false],
        gain_apart: Estimate { value: 1.0, std_error: 1.0 },
        error_apart: Estimate { value: 0.01, std_error: 0.01 },
        of_steps: 0.0,
        inflation: 1.0,
    };

    #[test]
    fn two_are_alike_within_two_standard_errors_of_either_measure() {
        assert!(passes(ALIKE, &TWO));
        assert!(!passes(ALIKE, &Contrast { error_apart: Estimate { value: 0.03, std_error: 0.01 }, ..TWO }));
        let likelier = Contrast { gain: [90.0, 48.0], gain_apart: Estimate { value: 30.0, std_error: 5.0 }, ..TWO };
        assert!(!passes(ALIKE, &likelier));
        assert!(passes(ALIKE, &Contrast { of_steps: 50.0, ..likelier }), "steps of an encoder make as much");
    }

    #[test]
    fn being_alike_does_not_hang_on_which_comes_first() {
        for two in [TWO, Contrast { gain_apart: Estimate { value: 9.0, std_error: 1.0 }, gain: [60.0, 1.0], ..TWO }] {
            assert_eq!(passes(ALIKE, &two), passes(ALIKE, &two.turned()));
        }
    }

    #[test]
    fn the_likelihoods_of_two_that_are_nearly_right_are_known_better_than_blocks_tell() {
        let apart = Contrast { gain: [80.0, 48.0], gain_apart: Estimate { value: 30.0, std_error: 20.0 }, ..TWO };
        assert!(!passes(ALIKE, &apart), "eight standard deviations apart");
        assert!(passes(ALIKE, &Contrast { is_slow: true, ..apart }), "what is slow, one block may decide");
    }

    #[test]
    fn a_plainer_one_is_preferred_where_the_other_is_hardly_likelier() {
        assert!(passes(PLAINER, &TWO) && passes(HARDLY_BEATS, &TWO));
        assert!(!passes(HARDLY_BEATS, &Contrast { gain: [60.0, 48.0], ..TWO }));
        assert!(!passes(PLAINER, &TWO.turned()));
    }
}
