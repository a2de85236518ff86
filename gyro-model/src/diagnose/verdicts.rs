//! The finding of one axis: a table of rules over plain facts, of which the first that holds decides. `diagnose`, `ladder` and `compare`
//! take it from here, and from nowhere else.

use super::{
    decision::{
        Condition::{Above, Below, Is, Not},
        Fact, Measure, Rule, first,
    },
    observed::Observed,
};
use crate::{
    budget::Floors,
    diagnosis::LimitedBy,
    finding::{Adequate, Excess, Finding, Remark, Why, ZeroMoves},
    statistics::Estimate,
    thresholds as limit,
};

type F = Fact<Observed>;
type M = Measure<Observed>;

static IS_FAULTY: F =
    Fact { says: "a fault of the data that makes every other verdict worthless", of: |o| o.fault.is_some() };
static IS_STOPPED: F = Fact { says: "a search that was stopped before its end", of: |o| o.unfinished };
static IS_ADEQUATE_SO_FAR: F = Fact {
    says: "an error that is adequate by the rules below",
    of: |o| matches!(decide(&Observed { unfinished: false, ..o.clone() }), Finding::Adequate(_)),
};
static IS_NAMED: F = Fact { says: "a named effect", of: |o| !o.named.is_empty() };
static IS_SHOWN: F = Fact {
    says: "a motion that shows the base model's parameters, or an effect that dominates the error",
    of: |o| o.unexcited.is_none() || o.dominates,
};
static HAS_ALIAS: F =
    Fact { says: "a named effect with an alias", of: |o| o.named.iter().any(|named| !named.aliases.is_empty()) };
static ZERO_MOVES: F = Fact {
    says: "a zero that is another one while the axis moves or at some angles, and no accelerometer, or for a while",
    of: |o| o.other_zero.is_some(),
};
static IS_EXCITED: F = Fact { says: "a motion that shows the base model's parameters", of: |o| o.unexcited.is_none() };
static IS_WITHIN: F = Fact { says: "an error within the floor's band", of: |o| o.within };
static IS_NOISE: F = Fact {
    says: "an error of noise: within the floor's band, or of a size that sensors have",
    of: Observed::leaves_noise,
};
static HIDES_SLOW: F = Fact { says: "a slow effect that a wandering bias may hide", of: |o| o.slow.is_some() };
static IS_LIKELY: F = Fact { says: "a significant suspect", of: |o| o.likely.is_some() };
static WANDER_EXPLAINS: F = Fact { says: "a wandering bias that explains all of it", of: |o| o.wander_explains };
static IS_SEARCHED: F = Fact { says: "a search for effects", of: |o| o.searched };
static SET_UP_EXPLAINS: F =
    Fact { says: "an error within the band of the floor with the set-up", of: |o| o.floors.set_up.within };
static WANDER_IN_FLOOR: F = Fact {
    says: "an error within the band of the floor with the set-up and a wandering bias",
    of: |o| o.floors.wander.within,
};
static IS_GYRO_NOISE: F = Fact {
    says: "white noise of the gyro as the largest part of the error",
    of: |o| o.limited_by == LimitedBy::GyroNoise,
};
static IS_AT_REST: F = Fact { says: "an axis that does not turn", of: |o| o.at_rest };
static IS_ALIKE: F = Fact { says: "an effect that was added and has an alias", of: |o| !o.alike.is_empty() };

static SECONDS: M = Measure { name: "length of the log", of: |o| o.seconds };
static SILENT: M = Measure { name: "share of the log in which the rate is not known", of: |o| o.silent };
static UNATTRIBUTED: M = Measure { name: "share of E² without a known cause", of: |o| o.unattributed };
static OVER_SET_UP: M = Measure { name: "largest E/F with the set-up in F", of: |o| o.floors.set_up.over };
static OVER_WANDER: M =
    Measure { name: "largest E/F with the set-up and a wandering bias in F", of: |o| o.floors.wander.over };

/// The rules, in the order in which they are asked.
pub(super) static VERDICTS: &[Rule<Observed, Finding>] = &[
    Rule { name: "bad-data", when: &[Is(&IS_FAULTY)], then: bad_data },
    Rule {
        name: "stopped",
        when: &[Is(&IS_STOPPED), Not(&IS_ADEQUATE_SO_FAR)],
        then: |o| Finding::Stopped { over_floor: o.floors.set_up.over },
    },
    Rule {
        name: "ambiguous",
        when: &[Is(&IS_NAMED), Is(&IS_SHOWN), Is(&HAS_ALIAS)],
        then: |o| Finding::Ambiguous { effects: o.named.clone(), over_floor: o.with_named, added: false },
    },
    Rule {
        name: "missing",
        when: &[Is(&IS_NAMED), Is(&IS_SHOWN)],
        then: |o| Finding::Missing { effects: o.named.clone(), over_floor: o.with_named },
    },
    Rule {
        name: "unexplained: another zero at times",
        when: &[Is(&ZERO_MOVES)],
        then: |o| {
            let unknown = (Estimate::exact(0.0), ZeroMoves::Moving);
            let (size, when) = o.other_zero.map_or(unknown, |zero| (zero.size, zero.when));
            Finding::Unexplained(Excess::OtherZero { size: size.value, std_error: size.std_error, when })
        },
    },
    Rule {
        name: "cannot-tell: the motion does not show it",
        when: &[Not(&IS_EXCITED)],
        then: |o| Finding::CannotTell(o.unexcited.clone().unwrap_or(Why::ReferenceAtRest)),
    },
    Rule {
        name: "cannot-tell: too short",
        when: &[Is(&IS_WITHIN), Below(&SECONDS, &limit::BRIEF)],
        then: |o| Finding::CannotTell(Why::TooShort { seconds: o.seconds }),
    },
    Rule {
        name: "cannot-tell: the rate is not known",
        when: &[Is(&IS_WITHIN), Above(&SILENT, &limit::SILENT)],
        then: |o| Finding::CannotTell(Why::Silent { share: o.silent }),
    },
    Rule {
        name: "cannot-tell: a slow effect or a wandering bias",
        when: &[Not(&IS_WITHIN), Is(&IS_NOISE), Is(&HIDES_SLOW)],
        then: |o| {
            let effect = o.slow.clone().unwrap_or_default();
            Finding::CannotTell(Why::SlowOrWander { effect, wander: o.wander })
        },
    },
    Rule {
        name: "cannot-tell: noise or an effect",
        when: &[Not(&IS_WITHIN), Is(&IS_NOISE), Is(&IS_LIKELY), Not(&WANDER_EXPLAINS)],
        then: |o| Finding::CannotTell(Why::NoiseOrEffect { effect: o.likely.clone().unwrap_or_default() }),
    },
    Rule {
        name: "cannot-tell: too large for a wandering bias",
        when: &[
            Is(&IS_SEARCHED),
            Not(&IS_WITHIN),
            Is(&IS_NOISE),
            Not(&WANDER_IN_FLOOR),
            Above(&OVER_WANDER, &limit::WANDER),
            Above(&UNATTRIBUTED, &limit::EXPLAINED),
        ],
        then: |o| {
            let (over_white, unattributed) = (o.floors.white.over, o.unattributed);
            Finding::CannotTell(Why::NoneStandsOut { over_white, unattributed })
        },
    },
    Rule {
        name: "unexplained: effects were not looked for",
        when: &[Not(&IS_NOISE), Not(&IS_SEARCHED)],
        then: |_| Finding::Unexplained(Excess::NotSearched),
    },
    Rule {
        name: "unexplained: no effect removes it",
        when: &[Not(&IS_NOISE), Not(&SET_UP_EXPLAINS), Above(&UNATTRIBUTED, &limit::EXPLAINED)],
        then: |o| {
            let (over_floor, unattributed) = (o.floors.set_up.over, o.unattributed);
            Finding::Unexplained(Excess::NoEffect { over_floor, unattributed })
        },
    },
    Rule {
        name: "cannot-tell: a known cause hides smaller effects",
        when: &[Not(&IS_NOISE), Not(&SET_UP_EXPLAINS), Not(&IS_GYRO_NOISE), Above(&OVER_SET_UP, &limit::WANDER)],
        then: hidden,
    },
    Rule {
        name: "ambiguous: by the ladder",
        when: &[Is(&IS_ALIKE)],
        then: |o| Finding::Ambiguous { effects: o.alike.clone(), over_floor: None, added: true },
    },
    Rule {
        name: "cannot-tell: at rest",
        when: &[Is(&IS_AT_REST)],
        then: |o| Finding::CannotTell(Why::AtRest { noise: noise(o) }),
    },
    Rule {
        name: "cannot-tell: a slow effect or a wandering bias, not looked for",
        when: &[Not(&IS_SEARCHED), Not(&SET_UP_EXPLAINS), Above(&OVER_SET_UP, &limit::WANDER), Is(&WANDER_IN_FLOOR)],
        then: |o| not_searched(o, false),
    },
    Rule {
        name: "unexplained: too large for a wandering bias, not looked for",
        when: &[Not(&IS_SEARCHED), Not(&SET_UP_EXPLAINS), Above(&OVER_SET_UP, &limit::WANDER)],
        then: |o| Finding::Unexplained(Excess::NoWander { over_floor: o.floors.set_up.over }),
    },
    Rule {
        name: "cannot-tell: a small effect or a wandering bias, not looked for",
        when: &[Not(&IS_SEARCHED), Not(&SET_UP_EXPLAINS)],
        then: |o| not_searched(o, true),
    },
    Rule { name: "adequate", when: &[], then: |o| Finding::Adequate(noise(o)) },
];

/// The finding of these facts.
pub(super) fn decide(observed: &Observed) -> Finding {
    // The last rule has no condition.
    first(VERDICTS, observed).unwrap_or_else(|| Finding::Adequate(noise(observed)))
}

/// Whether the search left nothing but noise, whatever the error is made of: the floor then has the bias that wanders in it.
pub(super) fn leaves_noise(observed: &Observed) -> bool {
    let undivided = Observed {
        unfinished: false,
        floors: Floors::UNKNOWN,
        unattributed: 1.0,
        limited_by: LimitedBy::Unattributed,
        ..observed.clone()
    };
    matches!(
        decide(&undivided),
        Finding::Adequate(_) | Finding::CannotTell(Why::AtRest { .. }) | Finding::Ambiguous { added: true, .. }
    )
}

/// What is said beside a finding of an axis that does not turn.
pub(super) fn at_rest(observed: &Observed, finding: &Finding) -> Option<Remark> {
    (observed.at_rest && !matches!(finding, Finding::BadData { .. })).then_some(Remark::AtRest)
}

fn bad_data(o: &Observed) -> Finding {
    o.fault.as_ref().map_or(Finding::Unexplained(Excess::NotSearched), |fault| Finding::BadData {
        fault: fault.kind,
        axis: fault.axis,
        count: fault.count,
    })
}

fn hidden(o: &Observed) -> Finding {
    Finding::CannotTell(Why::Hidden { known: 1.0 - o.unattributed })
}

fn not_searched(o: &Observed, small: bool) -> Finding {
    Finding::CannotTell(Why::NotSearched { over_floor: o.floors.set_up.over, small })
}

/// Why the remaining error counts as adequate.
fn noise(o: &Observed) -> Adequate {
    match (o.within, o.is_sensor_noise) {
        (true, _) => Adequate::WithinFloor { silent: o.silent },
        (false, true) if o.wanders => Adequate::Wanders(o.wander),
        (false, true) => Adequate::WhiteNoise { gyro: o.white[0], reference: o.white[1] },
        (false, false) => Adequate::Limited,
    }
}

#[cfg(test)]
mod tests;
