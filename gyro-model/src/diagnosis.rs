//! The results, with the keys of the JSON interface (`truerate.diagnosis/1`, `truerate.ladder/1`).
//!
//! SI units; what has no value is `None` (JSON `null`), never a number that is not finite.

use crate::{
    Axis,
    detail::AxisDetail,
    finding::{Finding, Remark},
};
pub use crate::{
    detail::FailsWhere,
    fault::{DataFault, FaultKind},
    finding::Verdict,
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, fmt};

/// Schema of what `compare` and `diagnose` say.
pub const DIAGNOSIS: &str = "truerate.diagnosis/1";
/// Schema of what `ladder` says.
pub const LADDER: &str = "truerate.ladder/1";

/// `compare`, `diagnose` and `ladder`, of one log or of several.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`DIAGNOSIS`] or [`LADDER`].
    pub schema: String,
    /// The log's name.
    pub log: String,
    /// One entry an axis.
    pub axes: Vec<AxisResult>,
    /// What several logs add to it.
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    pub several: Option<Several>,
}

impl Diagnosis {
    /// Of one log.
    #[must_use]
    pub fn new(schema: &str, log: &str, axes: Vec<AxisResult>) -> Self {
        Self { schema: schema.to_owned(), log: log.to_owned(), axes, several: None }
    }
}

/// What a result over several logs of one sensor has besides.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Several {
    /// The logs.
    pub logs: Vec<String>,
    /// Each log's own: its nuisances, what it alone says, its budget.
    pub each: Vec<EachLog>,
    /// What was named, and whose it is.
    pub repeats: Vec<Repeats>,
}

/// One log of several.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EachLog {
    /// Its name.
    pub log: String,
    /// Axis by axis.
    pub axes: Vec<EachAxis>,
}

/// One axis of one log of several.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EachAxis {
    /// The axis.
    pub axis: Axis,
    /// What this log alone comes to.
    pub verdict: Verdict,
    /// Its own parameters, which the other logs do not share: its zero, its reference.
    pub parameters: Vec<ParameterValue>,
    /// What it alone says of the parameters that all share.
    pub alone: Vec<ParameterValue>,
    /// Its noise.
    pub noise: NoiseValue,
    /// Its error under the common model.
    pub error_curve: Vec<ErrorPoint>,
    /// The largest error over floor.
    pub error_over_floor: Option<f64>,
    /// What that error is made of.
    pub budget: Vec<BudgetPoint>,
    /// The largest part of it.
    pub limited_by: Option<LimitedBy>,
}

/// An effect over several logs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Repeats {
    /// The axis.
    pub axis: Axis,
    /// The effect.
    pub effect: String,
    /// `sensor` where it repeats, `set-up` where it does not.
    pub of: String,
    /// The logs that show it.
    pub shown_in: Vec<String>,
    /// Those that could.
    pub could_show: Vec<String>,
    /// Chance that logs with one value differ as much.
    pub p_differs: Option<f64>,
    /// It in a sentence.
    pub says: String,
}

/// What `compare`, `diagnose` and `ladder` say of one axis. Of a ladder the errors are those at its end.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AxisResult {
    /// The axis.
    pub axis: Axis,
    /// What it comes to.
    pub verdict: Verdict,
    /// The verdict in one or two sentences, with what to do next.
    pub says: String,
    /// What was found, with its reasons and numbers; the verdict is it in one word.
    pub finding: Finding,
    /// What is said beside it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<Remark>,
    /// The answer in a sentence or two, with its number ([`crate::words::headline`]).
    #[serde(default)]
    pub headline: String,
    /// What several logs say of it beside the answer; empty for one log.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub of_logs: String,
    /// What to do about it on the vehicle; empty where nothing is to be done.
    #[serde(default)]
    pub at_source: String,
    /// By how much the angle is off after 10 s, 1 min and 10 min without a reference, as far as the log is long enough to say it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drift: Vec<Drift>,
    /// The same in a sentence.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub drift_says: String,
    /// What the model has.
    pub effects: Vec<String>,
    /// Its parameters.
    pub parameters: Vec<ParameterValue>,
    /// Its noise.
    pub noise: NoiseValue,
    /// The steps of a ladder, the first of which is the starting model; empty for `compare` and `diagnose`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<LadderStep>,
    /// Held out, open loop, rad/s.
    pub error_curve: Vec<ErrorPoint>,
    /// Largest error/floor.
    pub error_over_floor: Option<f64>,
    /// Every error below its `floor_99`.
    pub within_floor: Option<bool>,
    /// Where the floor's noise comes from, in words.
    pub floor_source: String,
    /// Regimes in which the model errs, worst first.
    pub fails_where: Vec<FailsWhere>,
    /// Whether suspects were looked for: `diagnose` does, `compare` does not.
    #[serde(default)]
    pub searched: bool,
    /// Best first; empty for `compare` and `ladder`.
    pub suspects: Vec<Suspect>,
    /// The effects that are missing together, where there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// The error curve with all of these added; empty where there are not several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing_error_curve: Vec<ErrorPoint>,
    /// Why each effect was named or was not, where that was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub explained: Vec<Explained>,
    /// Whether the search was stopped before its end.
    #[serde(default, skip_serializing_if = "is_false")]
    pub unfinished: bool,
    /// Faults of the data.
    pub data_faults: Vec<DataFault>,
    /// Where the noise of the floor is known from.
    #[serde(default)]
    pub floor_from: FloorFrom,
    /// What the error of each averaging time is made of; empty where nobody looked.
    #[serde(default)]
    pub budget: Vec<BudgetPoint>,
    /// Whose error it is, frequency by frequency.
    #[serde(default)]
    pub error_by_frequency: Vec<FrequencyShare>,
    /// The largest part over the middle of the curve.
    #[serde(default)]
    pub limited_by: Option<LimitedBy>,
    /// It in one sentence, and what to do about it: [`Limit::says`].
    #[serde(default)]
    pub limited_says: String,
    /// The same in its parts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<Limit>,
    /// Random causes that were found, the largest first.
    #[serde(default)]
    pub random: Vec<RandomCause>,
    /// What the pictures are drawn from, where they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<AxisDetail>,
}

impl AxisResult {
    /// With this finding, and nothing else that is known.
    #[must_use]
    pub fn new(axis: Axis, finding: Finding) -> Self {
        Self {
            axis,
            verdict: finding.verdict(),
            says: String::new(),
            finding,
            remarks: Vec::new(),
            headline: String::new(),
            of_logs: String::new(),
            at_source: String::new(),
            drift: Vec::new(),
            drift_says: String::new(),
            effects: Vec::new(),
            parameters: Vec::new(),
            noise: NoiseValue::default(),
            steps: Vec::new(),
            error_curve: Vec::new(),
            error_over_floor: None,
            within_floor: None,
            floor_source: String::new(),
            fails_where: Vec::new(),
            searched: false,
            suspects: Vec::new(),
            missing: Vec::new(),
            missing_error_curve: Vec::new(),
            explained: Vec::new(),
            unfinished: false,
            data_faults: Vec::new(),
            floor_from: FloorFrom::default(),
            budget: Vec::new(),
            error_by_frequency: Vec::new(),
            limited_by: None,
            limited_says: String::new(),
            limit: None,
            random: Vec::new(),
            detail: None,
        }
    }

    /// With another finding in the place of its own.
    pub fn find(&mut self, finding: Finding) {
        (self.verdict, self.finding) = (finding.verdict(), finding);
        self.remarks.clear();
    }

    /// What is missing: the suspects that are named, best first.
    #[must_use]
    pub fn lacks(&self) -> Vec<&Suspect> {
        let named = |suspect: &&Suspect| self.missing.is_empty() || self.missing.contains(&suspect.effect);
        self.suspects.iter().filter(named).take(self.missing.len().max(1)).collect()
    }

    /// The suspect of which a verdict in a word speaks: that which others cannot be told from, where one is.
    #[must_use]
    pub fn in_question(&self) -> Option<&Suspect> {
        let lacks = self.lacks();
        let open = lacks.iter().find(|suspect| self.verdict == Verdict::Ambiguous && !suspect.aliases.is_empty());
        open.or_else(|| lacks.first()).copied()
    }

    /// The error curve with what is missing added: all of it, where that is several effects; empty where there is no suspect.
    #[must_use]
    pub fn corrected_curve(&self) -> &[ErrorPoint] {
        let names = matches!(self.verdict, Verdict::MissingEffect | Verdict::Ambiguous);
        match self.suspects.first() {
            _ if names && !self.missing_error_curve.is_empty() => &self.missing_error_curve,
            Some(best) => &best.error_curve,
            None => &[],
        }
    }
}

/// By how much an angle is off after some time without a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// How long, s.
    pub tau_s: f64,
    /// RMS, rad, with its band.
    #[serde(flatten)]
    pub angle: Off,
    /// The same once what is missing is corrected; `None` where nothing is.
    pub corrected: Option<Off>,
}

/// An angle with its band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Off {
    /// RMS, rad.
    pub angle: f64,
    /// The band's lower end, rad.
    pub low: f64,
    /// Its upper end, rad.
    pub high: f64,
}

/// Where the noise that a floor is made of is known from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FloorFrom {
    /// This log's own signals.
    Measured,
    /// What such sensors usually have: the motion hides this one's own.
    Assumed,
    /// Nothing.
    #[default]
    Unknown,
}

/// What limits a log most, with its size, and what to do about it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// What it is, with its size: the part of a sentence.
    pub what: String,
    /// Its share of the error² at its largest, in words; empty where the log is too short to divide its error.
    pub share: String,
    /// What to do about it, in sentences; empty where nothing is to be done.
    pub remedy: String,
}

impl Limit {
    /// What it is, and its share.
    #[must_use]
    pub fn named(&self) -> String {
        if self.share.is_empty() { self.what.clone() } else { format!("{} ({})", self.what, self.share) }
    }

    /// All of it.
    #[must_use]
    pub fn says(&self) -> String {
        if self.remedy.is_empty() { self.named() } else { format!("{}. {}", self.named(), self.remedy) }
    }
}

/// What limits a log most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LimitedBy {
    /// White noise of the gyro.
    GyroNoise,
    /// A bias that wanders.
    BiasWander,
    /// Noise of the reference.
    ReferenceNoise,
    /// A reference that does not follow: slow, smoothed, interpolated.
    ReferenceBandwidth,
    /// Stamps that scatter.
    Timing,
    /// Motion too fast for the sampling rate.
    FoldedMotion,
    /// A scale that wanders within seconds.
    RandomScale,
    /// Noise that grows with the rate.
    RateNoise,
    /// A step of random size at each reversal.
    ReversalSteps,
    /// A step of random size at each start and stop.
    StartStopSteps,
    /// Motion in holes of the log.
    LostMotion,
    /// An effect that is named and not in the model.
    MissingEffect,
    /// What none of these explains.
    Unattributed,
}

impl LimitedBy {
    /// Whether it is noise of gyro or reference.
    #[must_use]
    pub const fn is_noise(self) -> bool {
        matches!(self, Self::GyroNoise | Self::BiasWander | Self::ReferenceNoise)
    }

    /// Whether it is of the set-up and no noise: what gyro and reference are recorded with, and how they move.
    #[must_use]
    pub const fn is_of_recording(self) -> bool {
        matches!(self, Self::ReferenceBandwidth | Self::Timing | Self::FoldedMotion) || self.is_random()
    }

    /// Whether it is a random cause, of which only the variance follows the motion.
    #[must_use]
    pub const fn is_random(self) -> bool {
        matches!(
            self,
            Self::RandomScale | Self::RateNoise | Self::ReversalSteps | Self::StartStopSteps | Self::LostMotion
        )
    }

    /// All of them, in the order in which they are declared.
    pub const ALL: [Self; PARTS] = [
        Self::GyroNoise,
        Self::BiasWander,
        Self::ReferenceNoise,
        Self::ReferenceBandwidth,
        Self::Timing,
        Self::FoldedMotion,
        Self::RandomScale,
        Self::RateNoise,
        Self::ReversalSteps,
        Self::StartStopSteps,
        Self::LostMotion,
        Self::MissingEffect,
        Self::Unattributed,
    ];
}

/// Parts that an error is divided into.
pub const PARTS: usize = 13;

/// A random cause that was found in an axis' error.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RandomCause {
    /// Which.
    pub cause: LimitedBy,
    /// Its size.
    pub size: Option<f64>,
    /// Standard error of the size.
    pub std_error: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// Events in the log, where it is made of events.
    pub count: Option<u64>,
    /// Random causes that would explain the same nearly as well in its place.
    #[serde(default)]
    pub aliases: Vec<LimitedBy>,
    /// It in a sentence, and what to do about it.
    pub says: String,
}

/// The mean square error of one averaging time, divided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BudgetPoint {
    /// Averaging time, s.
    pub tau_s: f64,
    /// Parts that add up to the mean square error, (rad/s)², in the order of [`LimitedBy::ALL`].
    pub parts: [f64; PARTS],
}

/// The keys of the parts in JSON.
const PART_KEYS: [&str; PARTS] = [
    "gyro_noise",
    "bias_wander",
    "reference_noise",
    "reference_bandwidth",
    "timing",
    "folded_motion",
    "random_scale",
    "rate_noise",
    "reversal_steps",
    "start_stop_steps",
    "lost_motion",
    "missing",
    "unattributed",
];

impl BudgetPoint {
    /// One part, (rad/s)².
    #[must_use]
    pub const fn of(&self, part: LimitedBy) -> f64 {
        self.parts[part as usize]
    }

    /// The mean square error.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.parts.iter().sum()
    }

    /// The share of one part.
    #[must_use]
    pub fn share(&self, part: LimitedBy) -> f64 {
        self.of(part) / self.total().max(1e-300)
    }
}

impl Serialize for BudgetPoint {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([("tau_s", self.tau_s)].into_iter().chain(PART_KEYS.into_iter().zip(self.parts)))
    }
}

impl<'de> Deserialize<'de> for BudgetPoint {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = BTreeMap::<String, Option<f64>>::deserialize(deserializer)?;
        let value = |key: &str| values.get(key).copied().flatten().unwrap_or(0.0);
        Ok(Self { tau_s: value("tau_s"), parts: PART_KEYS.map(value) })
    }
}

/// The error of one band of frequency, and who shows it: densities, (rad/s)²/Hz.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrequencyShare {
    /// From, Hz.
    pub from_hz: f64,
    /// To, Hz.
    pub to_hz: f64,
    /// Of the error.
    pub error: f64,
    /// Of the compensated rate.
    pub gyro: f64,
    /// Of the reference's rate.
    pub reference: f64,
    /// The error that only the gyro shows; `None` where the motion hides it.
    pub of_gyro: Option<f64>,
    /// The error that only the reference shows; `None` where the motion hides it.
    pub of_reference: Option<f64>,
    /// The error that goes with the gyro's rate all through the log.
    pub with_motion: f64,
    /// The error that no component takes.
    pub unattributed: f64,
}

/// One parameter with its uncertainty.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Effect id.
    pub effect: String,
    /// Parameter name.
    pub name: String,
    /// Value, SI.
    pub value: Option<f64>,
    /// Standard error, SI.
    pub std_error: Option<f64>,
    /// Unit.
    pub unit: String,
    /// The size that is typical of low-cost sensors.
    pub typical: Option<f64>,
}

/// Noise as reported.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct NoiseValue {
    /// rad/√s.
    pub angle_random_walk: Option<f64>,
    /// rad/s/√s.
    pub bias_random_walk: Option<f64>,
    /// rad.
    pub encoder: Option<f64>,
}

/// One averaging time of the error curve.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct ErrorPoint {
    /// Averaging time, s.
    pub tau_s: f64,
    /// Held-out error, rad/s.
    pub error: Option<f64>,
    /// Expected where no physics is missing, rad/s.
    pub floor: Option<f64>,
    /// Upper end of the band in which 99 % of such logs lie, rad/s.
    pub floor_99: Option<f64>,
}

/// A physical effect that may be missing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Suspect {
    /// Effect id.
    pub effect: String,
    /// Effects that cannot be told from it on this log, best first, at most three.
    pub aliases: Vec<String>,
    /// The manoeuvre that would tell them apart.
    pub separate_by: String,
    /// Significance, priced for the whole search.
    pub p_value: Option<f64>,
    /// Share of the held-out excess that adding it removes.
    pub error_fall: Option<f64>,
    /// What ln L gains by it, over what noise alone gains beyond white noise; `None` where no likelihood says so.
    #[serde(default)]
    pub log_likelihood_gain: Option<f64>,
    /// Its parameters after an exact refit: with all that is missing, where that is several effects.
    pub parameters: Vec<ParameterValue>,
    /// The error curve with it added.
    pub error_curve: Vec<ErrorPoint>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
const fn is_false(value: &bool) -> bool {
    !*value
}

/// The tests of a suspect, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum TestName {
    /// No parameter is at its physical bound.
    Bounds,
    /// Both are of one channel.
    Channel,
    /// The held-out error.
    Error,
    /// The held-out error, averaging time by averaging time.
    #[serde(rename = "every averaging time")]
    EveryAveragingTime,
    /// Blocks that took no part in the fit.
    HeldOut,
    /// The standard errors of the parameters.
    Known,
    /// The likelihood of the identified noise.
    Likelihood,
    /// A spectral line.
    Line,
    /// An effect that averages over time.
    Mean,
    /// A line that is motion.
    Motion,
    /// How many parameters.
    Parameters,
    /// The rows that are left to judge by.
    Rows,
    /// The share of the error that it removes.
    Share,
    /// An effect that shows only once.
    #[serde(rename = "shown once")]
    ShownOnce,
    /// The likelihood-ratio test.
    Significance,
    /// The size that such sensors have.
    Size,
}

impl TestName {
    /// As it is written.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bounds => "bounds",
            Self::Channel => "channel",
            Self::Error => "error",
            Self::EveryAveragingTime => "every averaging time",
            Self::HeldOut => "held-out",
            Self::Known => "known",
            Self::Likelihood => "likelihood",
            Self::Line => "line",
            Self::Mean => "mean",
            Self::Motion => "motion",
            Self::Parameters => "parameters",
            Self::Rows => "rows",
            Self::Share => "share",
            Self::ShownOnce => "shown once",
            Self::Significance => "significance",
            Self::Size => "size",
        }
    }
}

impl fmt::Display for TestName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How a number is held against a threshold, or whether a fact is asked for or denied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Relation {
    /// The measure has to be larger.
    #[serde(rename = "above")]
    Above,
    /// The measure has to be smaller.
    #[serde(rename = "below")]
    Below,
    /// The fact has to hold.
    #[serde(rename = "is")]
    Is,
    /// The fact must not hold.
    #[serde(rename = "is not")]
    IsNot,
}

impl fmt::Display for Relation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Above => "above",
            Self::Below => "below",
            Self::Is => "is",
            Self::IsNot => "is not",
        })
    }
}

/// How far a suspect came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SuspectStage {
    /// The score test left it behind others.
    Scan,
    /// It was refitted, and a test refused it.
    Refit,
    /// It passed every test.
    Admitted,
}

/// One test of one suspect: it is passed where every condition of one of its ways holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestOutcome {
    /// Its name.
    pub test: TestName,
    /// What it asks.
    pub asks: String,
    /// Whether it is asked of this suspect at all.
    pub applies: bool,
    /// Whether it is passed, or does not apply.
    pub passed: bool,
    /// The ways to pass it.
    pub ways: Vec<Vec<TestCondition>>,
}

/// One inequality, or one thing that is so or is not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestCondition {
    /// What is measured.
    pub measure: String,
    /// What is asked of it.
    pub relation: Relation,
    /// Its value.
    pub value: Option<f64>,
    /// What it is held against.
    pub threshold: Option<f64>,
    /// The unit of both; empty where they have none.
    pub unit: String,
    /// Whether it holds.
    pub holds: bool,
}

/// Why one effect was named, or was not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Explained {
    /// Effect id.
    pub effect: String,
    /// How far it came.
    pub stage: SuspectStage,
    /// Gain in ln L that the score test promises.
    pub score: Option<f64>,
    /// Share of the error that the score test says it removes.
    pub promises: Option<f64>,
    /// The tests of its exact refit; empty where there was none.
    pub tests: Vec<TestOutcome>,
}

/// One step of a ladder.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LadderStep {
    /// Effect added in this step.
    pub added: Option<String>,
    /// Effect removed in this step.
    pub removed: Option<String>,
    /// Aliases of what was added, on this log.
    pub aliases: Vec<String>,
    /// The error curve after this step.
    pub error_curve: Vec<ErrorPoint>,
    /// Largest error/floor after this step.
    pub error_over_floor: Option<f64>,
}
