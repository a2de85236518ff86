//! From where on something counts as a fault: every threshold of the checks that judge a reading by its neighbours or by
//! the reference, with its unit and where it comes from.
//!
//! *Calibrated* ones come from `cargo run --release -p gyro-model --example false_faults -- --count 1000 LOG …`, which counts
//! clean logs: simulated ones, with and without hidden effects, and recorded ones given as files.

/// Standard deviations (1) of a reading's distance from its neighbours' cubic, from which on it is a spike. Calibrated: the
/// largest on recorded logs is 20, a stepper's click that a gyro feels across its axis for one sample.
pub(super) const SPIKE: f64 = 25.0;

/// The same where the size of the distance keeps coming back: what is real does not. Calibrated: beyond it lie some readings of
/// recorded logs, no five of one size.
pub(super) const RECURRING: f64 = 8.0;

/// What the neighbours may miss their own cubic by, as a share of that distance (1). Derived: a corner of the motion leaves a
/// third to a half, a step of it more.
pub(super) const UNEVEN: f64 = 0.15;

/// Share of the range (1) by which a reading at the end of a stretch has to lie apart.
pub(super) const AT_AN_END: f64 = 0.5;

/// Share of a channel's readings (1) that spikes may be; more are no exceptions, and left as they are.
pub(super) const MOST_SPIKES: f64 = 0.1;

/// Readings of one size of deviation from which on it keeps coming back, and their share of all that deviate (1).
pub(super) const SAME_SIZE: (usize, f64) = (5, 0.7);

/// Spread of a size that is one, as a share of it (1).
pub(super) const SIZE_SPREAD: f64 = 0.06;

/// How near that size is to a bit of the converter's word, as a share of it (1).
pub(super) const BIT_SPREAD: f64 = 0.02;

/// Standard deviations (1) of what deviates by a size that is known to come back.
pub(super) const KNOWN_SIZE: f64 = 4.0;

/// Rows apart, in the usual distance of two readings (1), from which on they are no neighbours. As in `evidence::series`.
pub(super) const HOLE: f64 = 3.5;

/// Times (1) that one value has to be found far from what is around to be a marker.
pub(super) const MARKED: usize = 3;

/// Single readings of one value that are spikes which happen to be alike, unless it is a value that is known as a marker (1):
/// a line that is pulled to one level brings the same reading each time. Fewer than so many.
pub(super) const ALIKE: usize = 8;

/// How near (1) a value is to a range's end, as a share of it, to be that.
pub(super) const AT_RANGE: f64 = 5e-4;

/// Share (1) of what stands far from its neighbours that has this one value.
pub(super) const MARKED_SHARE: f64 = 0.5;

/// Usual steps (1; nine in ten are smaller) that a marker lies from the readings on either side.
pub(super) const MARKER_STEPS: f64 = 8.0;

/// A value so many times (1) further out than all others that it is none of them, wherever it stands.
pub(super) const BEYOND: f64 = 1.5;

/// Rows (1) of one value at a log's end that are a marker and not chance, where it lies far from what follows.
pub(super) const LEADING: usize = 3;

/// Size of a jump of the reading, over its largest value (1), that may be a wrap: it is nearly two of the range.
pub(super) const WRAP: f64 = 1.5;

/// Size of a jump of a reading that lost its sign, over its largest value (1): nearly the whole of it.
pub(super) const SIGN_LOST: f64 = 0.8;

/// Steps beside a wrap, over its own (1).
pub(super) const BESIDE_WRAP: f64 = 0.2;

/// Spread of the range that wraps tell, as a share of it (1): within it they are of one range.
pub(super) const ONE_RANGE: f64 = 0.03;

/// How far, s, the reference is asked about on either side of a reading: longer than any usual delay between the two.
pub(super) const WITNESS: f64 = 0.1;

/// What of a deviation the reference shows (1) from which on it is motion.
pub(super) const SHOWN: f64 = 0.5;

/// Standard errors (1) by which that has to be known.
pub(super) const SURE: f64 = 2.0;

/// Times (1) the usual step between reference and gyro, from which on a step of it is a jump: the median over the whole log or
/// nearby, whichever is larger, and one count of an encoder at least. Calibrated: the largest on clean logs is below 9.
pub(super) const JUMP: f64 = 12.0;

/// And at least so far, rad: 3°. Calibrated: a camera system's largest single error at a fast turn is 1.6°.
pub(super) const LEAST_JUMP: f64 = 0.052;

/// A small step of a shaft's angle that is looked at: times (1) the usual step, and at least so far, rad: 0.2°.
pub(super) const SLIP: f64 = 6.0;
pub(super) const LEAST_SLIP: f64 = 0.0035;

/// More such steps than these are no slips.
pub(super) const FEW_SLIPS: usize = 20;

/// Share of a step (1) by which the step that stays may differ from it, and how many standard deviations of what is left it has to be.
pub(super) const FROM_ONE_STEP: f64 = 0.25;
pub(super) const SHOWN_SLIP: f64 = 6.0;

/// From so many steps on, most of them where the rate is below this share (1) of its root mean square, they are those of reversals.
pub(super) const AT_REVERSALS: (usize, f64) = (5, 0.1);

/// Share of a jump (1) that the gyro's own jerk nearby makes in a step, from which on it was felt, only not at that row.
pub(super) const FELT: f64 = 0.25;

/// What gyro and reference may drift apart while the reference is away, rad/s: 1 °/s, the bias left by a coarse calibration.
pub(super) const DRIFT: f64 = 0.0175;

/// And what of the way that they turn meanwhile, 1: the scale left by such a calibration.
pub(super) const SCALED: f64 = 0.02;

/// How long a reference may be away and come back, s.
pub(super) const AWAY: f64 = 10.0;

/// How long a reference has to go with the gyro again to be one that has moved and stays, s.
pub(super) const STAYS: f64 = 1.0;

/// What is near the largest reading (1) may be cut off, so that it tells nothing of the reference.
pub(super) const NEAR_THE_END: f64 = 0.97;

/// Gyro against reference, 1, between which scales the two are of one unit.
pub(super) const COMPARABLE: std::ops::Range<f64> = 0.5..2.0;

/// How far about a jump, s, the delay between gyro and reference is looked at, and over which times it is seen.
pub(super) const DELAY_SEEN: (f64, f64) = (20.0, 0.15);

/// Least change of the delay, s, and share of a jump (1) that it may leave, for a clock that was set.
pub(super) const CLOCK_SET: (f64, f64) = (0.002, 0.35);

/// Intervals shorter than this share (1) of the mean one are within a burst, longer than [`PAUSE`] of it between two.
pub(super) const BURST: f64 = 0.5;
/// See [`BURST`].
pub(super) const PAUSE: f64 = 1.3;

/// Share (1) of the intervals that are within bursts, where there are some. Derived: of arrivals that know nothing of each other
/// 1 − e^{−0.5} = 39 % are so near, and of even ones with ±50 % of jitter none.
pub(super) const BURST_SHARE: f64 = 0.45;

/// α, or what of the gyro's rate a reference shows (1): no sensor's scale is off by more than this share (low-cost gyros: ±3 %
/// by their data sheets, the worst ones 10 %).
pub(super) const SCALE: f64 = 0.1;

/// How near (1) a ratio is to one of small numbers that may be meant: the gyro's own scale is off by as much (±3 %).
pub(super) const NEAR_A_RATIO: f64 = 0.03;

/// What the second difference of a rate may be, as a share of the fastest rate (1), and be none; a good servo's ripple is 0.1 %.
pub(super) const TOLD: f64 = 1e-4;

/// Share of the rows that turn (1) in which it is none, for a command.
pub(super) const TOLD_SHARE: f64 = 0.9;

/// What the gyro's readings leave of a reference, over their noise (1), below which it is made of them. Derived: of a measured
/// one their noise is left, less what a mean of 17 readings takes off it (to a quarter); decimals leave a hundredth of a step.
pub(super) const OWN: f64 = 0.003;
/// Variance of second differences of reference less gyro over that of the gyro's own random walk, 1, below which the walk is in the
/// reference too. Of an independent reference it is 1 at least, and two dozen windows tell it to 0.3.
pub(super) const OWN_WALK: f64 = 0.25;
/// Share of what scale factor, bias and drift leave of an angle's increments (variance, 1), below which a pull to something else leaves
/// so little that it is there. Of 30 logs with an encoder the least is 0.27, of a yaw that is pulled to a wrong heading 0.0002 to 0.08.
pub(super) const OWN_PULLED: f64 = 0.2;
/// How far that turns over how far the gyro does (1), below which it is no heading.
pub(super) const PULLED_TO: f64 = 0.8;

/// Usual steps (1; nine in ten are smaller) that a reading jumps by as it goes on after it stood still.
pub(super) const GOES_ON: f64 = 4.0;

/// The least such jump, rad/s and rad: 2.9 °/s, 2.9°. A dead zone, play and hysteresis of such size would be known.
pub(super) const LEAST_STEP: f64 = 0.05;

/// What the other sensor shows of that jump, over it (1): all, less what it turned in the time that it is averaged over.
pub(super) const CAUGHT_UP: std::ops::Range<f64> = 0.6..1.6;

/// Rows within which an angle that was averaged or interpolated crosses its end: filters of more are not made of wrapped angles.
pub(super) const CROSSING: usize = 12;

/// How near (1) what it goes back there is to a whole turn: the gyro's scale and bias over a few rows, and the encoder's counts.
pub(super) const CROSSED: f64 = 0.05;
