//! What the error that is left is made of: whose fault it is, and what to do.
//!
//! After a model is compensated its held-out error² is divided, averaging time by averaging time, among the parts of
//! [`Part`]. Each component (`COMPONENTS`) has evidence of its own in the spectra of error, gyro and reference
//! (`spectra`) and takes, band by band, no more than that evidence says. What goes with the catalogue's columns
//! (`coherent`) or with the gyro's rate, and is not named, no component of noise gets: it is `unattributed`, as is all that
//! nothing claims.
//!
//! ```text
//! E²(τ) = Σ parts,   each part's share that of ∫ S_part(f) |sin πfτ / (m sin πfΔt)|² df in the whole
//! ```

mod bias_wander;
mod coherent;
mod folded_lines;
mod folded_motion;
mod gyro_noise;
pub(crate) mod random;
mod reference_bandwidth;
mod reference_noise;
pub(crate) mod says;
mod seen;
pub(crate) mod spectra;
mod timing;

use crate::{
    Axis,
    diagnosis::{
        BudgetPoint, DataFault, ErrorPoint, FaultKind, FloorFrom, FrequencyShare, Limit, LimitedBy, RandomCause,
    },
    evidence::{study::Study, whiten::NoiseModel},
    fit::judged::Judged,
};
use folded_lines::Motion;
use random::{Cause, ErrorOf, Random};
use seen::Seen;
use spectra::Band;

/// What an error may be made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// White noise of the gyro.
    GyroNoise,
    /// A bias that wanders.
    BiasWander,
    /// Noise of the reference.
    ReferenceNoise,
    /// A reference that does not follow.
    ReferenceBandwidth,
    /// Stamps that scatter.
    Timing,
    /// Motion too fast for the sampling rate.
    FoldedMotion,
}

impl Part {
    const ALL: [Self; 6] = [
        Self::GyroNoise,
        Self::BiasWander,
        Self::ReferenceNoise,
        Self::ReferenceBandwidth,
        Self::Timing,
        Self::FoldedMotion,
    ];
}

/// What one component takes of the error, band by band, (rad/s)²/Hz, and the numbers that say why.
#[derive(Clone, Debug)]
pub(crate) struct Claim {
    taken: Vec<f64>,
    numbers: [f64; 3],
}

impl Claim {
    /// Up to a level, and what chance makes of that in a band of so few values, of what is left.
    fn up_to(seen: &Seen, left: &[f64], level: impl Fn(usize) -> f64) -> Self {
        let chance = |k: usize| 1.0 + CHANCE / seen.bands[k].count.sqrt();
        Self::exactly(left, |k| chance(k) * level(k))
    }

    fn exactly(left: &[f64], part: impl Fn(usize) -> f64) -> Self {
        let taken = left.iter().enumerate().map(|(k, left)| part(k).min(*left).max(0.0)).collect();
        Self { taken, numbers: [0.0; 3] }
    }

    fn saying(self, numbers: [f64; 3]) -> Self {
        Self { numbers, ..self }
    }
}

/// Standard deviations that a band may stand above its expectation.
const CHANCE: f64 = 2.0;

type Component = fn(&Seen, &[f64]) -> Option<Claim>;

/// Who takes first what he has evidence for.
const COMPONENTS: [(Part, Component); 6] = [
    (Part::GyroNoise, gyro_noise::claim),
    (Part::ReferenceBandwidth, reference_bandwidth::claim),
    (Part::FoldedMotion, folded_motion::claim),
    (Part::Timing, timing::claim),
    (Part::ReferenceNoise, reference_noise::claim),
    (Part::BiasWander, bias_wander::claim),
];

/// An error over a floor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Over {
    /// Whether it is within the floor's band at every averaging time.
    pub within: bool,
    /// The largest E/F.
    pub over: f64,
}

/// An error over floors, each with more in it than the one before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Floors {
    /// White noise.
    pub white: Over,
    /// And what the set-up adds.
    pub set_up: Over,
    /// And a bias that wanders.
    pub wander: Over,
}

impl Floors {
    /// Before anybody has looked what the error is made of.
    pub(crate) const UNKNOWN: Self = {
        let nothing = Over { within: false, over: f64::INFINITY };
        Self { white: nothing, set_up: nothing, wander: Over { within: true, over: 0.0 } }
    };
}

/// The budget of one axis.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    /// Averaging time by averaging time.
    pub points: Vec<BudgetPoint>,
    /// Whose error it is, frequency by frequency.
    pub by_frequency: Vec<FrequencyShare>,
    /// The largest part over the middle of the curve.
    pub limited_by: LimitedBy,
    /// It with its size, and what to do about it.
    pub limit: Limit,
    /// Random causes that were found.
    pub random: Vec<RandomCause>,
    /// Where the floor's noise comes from.
    pub floor_from: FloorFrom,
    /// What the set-up adds to the floor², (rad/s)², beyond the noise that was known beforehand; empty where nothing.
    pub set_up: Vec<f64>,
    /// What a bias that wanders adds to it, where it is believed ([`Budget::settle`]); empty where not.
    wander: Vec<f64>,
    /// Share of the error² over the middle of the curve that no component takes.
    pub unattributed: f64,
    /// Motion too fast for the sampling rate. where it makes much of the error.
    folded: Option<Motion>,
}

impl Budget {
    /// Divides the error of one axis, `judged`; `missing` is the share of each averaging time's error² that an effect removes
    /// which is named, and `study` the model with it. It is `None` where no effect was looked for: what the catalogue's columns
    /// foretell is then no random cause's.
    #[must_use]
    pub(crate) fn of(
        study: &Study,
        series: usize,
        judged: &Judged,
        noise: &NoiseModel,
        missing: Option<&[f64]>,
    ) -> Self {
        let seen = Seen::new(study, series, noise);
        let mut left: Vec<f64> = seen.bands.iter().map(|band| band.error).collect();
        let mut claims: Vec<(Part, Claim)> = Vec::new();
        for (part, component) in COMPONENTS {
            if let Some(claim) = component(&seen, &left) {
                left.iter_mut().zip(&claim.taken).for_each(|(left, taken)| *left -= taken);
                claims.push((part, claim));
            }
        }
        let error = if missing.is_some() { ErrorOf::Model } else { ErrorOf::ModelAndColumns };
        let random = Random::of(study, series, error, &judged.tau);
        let missing = missing.unwrap_or_default();
        let mut points = Vec::new();
        let (mut set_up, mut by_chance) = (Vec::new(), Vec::new());
        for (k, &tau) in judged.tau.iter().enumerate() {
            let passes: Vec<f64> = seen.bands.iter().map(|band| band.passes(tau, seen.dt)).collect();
            let through = |density: &dyn Fn(usize) -> f64| -> f64 {
                passes.iter().enumerate().map(|(b, pass)| pass * density(b)).sum()
            };
            let all = through(&|b| seen.bands[b].error).max(1e-300);
            let own = |part: Part| -> f64 {
                claims.iter().filter(|(p, _)| *p == part).map(|(_, claim)| through(&|b| claim.taken[b])).sum()
            };
            let square = judged.error[k].powi(2);
            let absent = missing.get(k).copied().unwrap_or(0.0).clamp(0.0, 1.0);
            let rest = square * (1.0 - absent);
            let incoherent = rest * (1.0 - seen.with_columns[k]);
            let of = |part: Part| incoherent * (own(part) / all + 0.0).clamp(0.0, 1.0);
            // What a random cause makes has evidence of its own, window by window. Where all together claim more than there is, the
            // others give way.
            let made = Cause::ALL.map(|cause| random.share(cause, k) * rest);
            let all_made = made.iter().sum::<f64>();
            let made = made.map(|part| if all_made > rest { part * rest / all_made } else { part });
            let of_random: f64 = made.iter().sum();
            let parts = Part::ALL.map(of);
            let fits = ((rest - of_random) / parts.iter().sum::<f64>().max(1e-300)).min(1.0);
            let parts = parts.map(|part| part * fits);
            let mut parts = parts;
            // How far a bias walks within one log is seen once.
            let open = (incoherent - of_random - parts.iter().sum::<f64>()).max(0.0);
            let wander = &mut parts[Part::ALL.iter().position(|part| *part == Part::BiasWander).unwrap_or(1)];
            if bias_wander::is_seen_once(&seen) {
                *wander += open.min((bias_wander::MOST - 1.0) * *wander);
            }
            let taken: f64 = parts.iter().sum::<f64>() + of_random;
            let of_set_up = Part::ALL.iter().zip(parts).filter(|(part, _)| is_of_set_up(**part)).map(|(_, own)| own);
            let known = seen.walks.1.powi(2) / tau + 2.0 * (seen.prior.encoder / tau).powi(2);
            set_up.push((of_set_up.sum::<f64>() - known).max(0.0));
            by_chance.push(of_random);
            // A part that is not known counts as nothing, and no part is -0.
            let rest_of_all = [square * absent, (rest - taken).max(0.0)];
            let mut divided = parts
                .into_iter()
                .chain(made)
                .chain(rest_of_all)
                .map(|part| if part.is_finite() { part + 0.0 } else { 0.0 });
            points.push(BudgetPoint { tau_s: tau, parts: std::array::from_fn(|_| divided.next().unwrap_or(0.0)) });
        }
        let shows = |(part, _): &(Part, Claim)| match part {
            Part::ReferenceNoise => reference_noise::is_told(&seen),
            part => is_of_set_up(*part),
        };
        if !claims.iter().any(shows) {
            set_up.fill(0.0);
        }
        set_up.iter_mut().zip(by_chance).for_each(|(set_up, by_chance)| *set_up += by_chance);
        let numbers = |part: Part| claims.iter().find(|(p, _)| *p == part).map(|(_, claim)| claim.numbers);
        let (limited_by, unattributed) = says::largest(&points, seen.dt);
        let limit = says::limit(limited_by, &points, &seen, &numbers, &random);
        let by_frequency = seen.bands.iter().zip(&left).map(|(band, left)| by_frequency(band, *left)).collect();
        let floor_from = if seen.prior.assumed { FloorFrom::Assumed } else { FloorFrom::Measured };
        let much = |point: &BudgetPoint| point.share(LimitedBy::FoldedMotion) > MUCH;
        let folded = Motion::behind(&seen.folded, seen.dt).filter(|_| points.iter().any(much));
        Self {
            points,
            by_frequency,
            limited_by,
            limit,
            random: says::reported(&random),
            floor_from,
            set_up,
            wander: Vec::new(),
            unattributed,
            folded,
        }
    }
}

fn by_frequency(band: &Band, left: f64) -> FrequencyShare {
    let told =
        |(density, error): (f64, f64)| (error < 0.5 * band.error).then(|| digits(density.clamp(0.0, band.error)));
    FrequencyShare {
        from_hz: digits(band.low),
        to_hz: digits(band.high),
        error: digits(band.error),
        gyro: digits(band.gyro),
        reference: digits(band.reference),
        of_gyro: told(band.of_gyro()),
        of_reference: told(band.of_reference()),
        with_motion: digits(band.coherent()),
        unattributed: digits(left),
    }
}

/// Four digits of it: more is noise.
fn digits(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let scale = 10_f64.powi(3 - value.abs().log10().floor() as i32);
    (value * scale).round() / scale
}

impl Budget {
    /// The floor of the set-up as it is: what it adds to a floor of gyro and reference alone.
    pub(crate) fn raise(&self, judged: &mut Judged) {
        let floor = &mut judged.floor;
        for (k, (floor, upper)) in floor.floor.iter_mut().zip(&mut floor.upper).enumerate() {
            if *floor > 0.0 {
                let raised = (*floor * *floor + self.added(k)).sqrt();
                *upper *= raised / *floor;
                *floor = raised;
            }
        }
    }

    /// What is added to the floor² of an averaging time.
    fn added(&self, k: usize) -> f64 {
        [&self.set_up, &self.wander].map(|part| part.get(k).copied().unwrap_or(0.0)).iter().sum()
    }

    /// Raises the floor of a curve of the same averaging times.
    pub(crate) fn raise_points(&self, points: &mut [ErrorPoint]) {
        for (k, point) in points.iter_mut().enumerate() {
            if let Some(floor) = point.floor.filter(|floor| *floor > 0.0) {
                let raised = (floor * floor + self.added(k)).sqrt();
                point.floor_99 = point.floor_99.map(|upper| upper * raised / floor);
                point.floor = Some(raised);
            }
        }
    }

    /// The error over the floor of white noise, of the set-up as it is, and with a bias that wanders besides.
    #[must_use]
    pub(crate) fn floors(&self, judged: &Judged) -> Floors {
        let over = |judged: &Judged| Over { within: judged.within(), over: judged.over_floor() };
        let white = over(judged);
        let mut raised = judged.clone();
        self.raise(&mut raised);
        let mut budget = self.clone();
        budget.believe_wander();
        let mut wander = judged.clone();
        budget.raise(&mut wander);
        Floors { white, set_up: over(&raised), wander: over(&wander) }
    }

    /// Raises the floor of `judged` by what the set-up adds; and by the bias that wanders, where the search left nothing but noise, which
    /// is more than white.
    pub(crate) fn settle(&mut self, judged: &mut Judged, is_noise: bool) {
        if is_noise && !judged.within() {
            self.believe_wander();
        }
        self.raise(judged);
    }

    /// Counts the bias that wanders to the floor.
    fn believe_wander(&mut self) {
        self.wander = self.points.iter().map(|point| point.of(LimitedBy::BiasWander)).collect();
    }

    /// Whether an error is noise once a bias that wanders is believed.
    #[must_use]
    pub(crate) fn is_wander(&self, judged: &Judged) -> bool {
        self.floors(judged).wander.within
    }

    /// Motion that is folded, as a fault of the data of an axis.
    #[must_use]
    pub(crate) fn fault(&self, axis: Axis) -> Option<DataFault> {
        let says = format!(
            "{}. Gyro and reference both show it, but not in the proportion of motion of that frequency, so no effect is named for it. Sample \
             faster, or filter both before sampling",
            self.folded?.says()
        );
        Some(DataFault { kind: FaultKind::AliasedMotion, axis: Some(axis), count: 1, first_t: None, says })
    }
}

/// Share of the error² of an averaging time that makes folded motion a fault.
const MUCH: f64 = 0.2;

/// Whether a part is of the set-up, and not of the gyro.
const fn is_of_set_up(part: Part) -> bool {
    matches!(part, Part::ReferenceNoise | Part::ReferenceBandwidth | Part::Timing | Part::FoldedMotion)
}
