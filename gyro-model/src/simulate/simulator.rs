//! The simulator: physics in tenths of a row, one row after the other, without end and in constant memory.

use super::{
    Hidden, Scenario,
    body::Body,
    motion::{Instant, Line, Motion, Shaft, normal},
    noise::{Flicker, Wander, stream},
    sensor::{Reference, SensorSpec},
};
use crate::{
    Axis, AxisModel, Model, Noise, Row,
    effects::{Memory, Signals, Stage},
    model::Origin,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Lines of a wobble.
const WOBBLES: u32 = 12;
/// Physical steps a row.
const OVERSAMPLING: u32 = 10;

/// One row with the truth behind it.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// As a log would have it.
    pub row: Row,
    /// ω of the three axes at the row's time, rad/s.
    pub true_rate: [f64; 3],
    /// Its integral, rad.
    pub true_angle: [f64; 3],
}

/// Yields rows for ever. Effects can be switched on and off while it runs.
#[derive(Clone, Debug)]
pub struct Simulator {
    sensor: SensorSpec,
    rate_hz: f64,
    shafts: [Shaft; 3],
    body: Body,
    hidden: Vec<Acting>,
    /// Rows given so far.
    count: u64,
    felt: f64,
    white: ChaCha8Rng,
    slow: SlowNoise,
    others: ChaCha8Rng,
    supply: (Wander, ChaCha8Rng),
    instruments: ChaCha8Rng,
    reference: ChaCha8Rng,
}

/// A hidden effect at work.
#[derive(Clone, Debug)]
struct Acting {
    hidden: Hidden,
    memory: Memory,
    /// Of the reference: what it errs by now, rad.
    error: f64,
}

/// What the gyro's bias does by itself.
#[derive(Clone, Debug)]
struct SlowNoise {
    walk: (f64, ChaCha8Rng),
    flicker: (Flicker, ChaCha8Rng),
    correlated: (Wander, ChaCha8Rng),
}

impl Simulator {
    /// The scenario from its first row on; `scenario.seconds` is not looked at.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let (seed, sensor) = (scenario.seed, scenario.sensor.clone());
        let streams = |number| stream(seed, number);
        let dt = 1.0 / scenario.rate_hz;
        let mut flicker = streams(2);
        let mut simulator = Self {
            shafts: shafts(scenario),
            body: Body::new(&sensor, streams(6)),
            hidden: Vec::new(),
            count: 0,
            felt: 0.0,
            white: streams(0),
            slow: SlowNoise {
                walk: (0.0, streams(1)),
                flicker: (Flicker::new(sensor.flicker, &mut flicker), flicker),
                correlated: (Wander::new(sensor.correlated, -dt / 0.99_f64.ln()), streams(3)),
            },
            others: streams(4),
            supply: (Wander::new(sensor.supply.wander, 0.8), streams(8)),
            instruments: streams(5),
            reference: streams(9),
            rate_hz: scenario.rate_hz,
            sensor,
        };
        scenario.hidden.iter().for_each(|hidden| simulator.hide(hidden.clone()));
        simulator
    }

    /// Switches an effect on, or changes its parameters; `scale-factor` and `bias` replace the sensor's own.
    pub fn hide(&mut self, hidden: Hidden) {
        let id = hidden.effect.card().id;
        match (hidden.effect.stage(), id) {
            (Stage::Calibration, "scale-factor") => self.sensor.alpha = hidden.values[0],
            (Stage::Calibration, _) => self.sensor.delta = hidden.values[0],
            _ => match self.hidden.iter_mut().find(|acting| acting.hidden.effect.card().id == id) {
                Some(acting) => acting.hidden = hidden,
                None => self.hidden.push(Acting { hidden, memory: Memory::default(), error: 0.0 }),
            },
        }
    }

    /// Switches an effect off.
    pub fn reveal(&mut self, id: &str) {
        self.hidden.retain(|acting| acting.hidden.effect.card().id != id);
    }

    /// From now on a shaft of [`Motion::Steered`] goes towards this rate, rad/s.
    pub fn steer(&mut self, axis: Axis, rate: f64) {
        let t = self.count.saturating_sub(1) as f64 / self.rate_hz;
        self.shafts[axis.index()].steer(t, rate);
    }

    /// The sensor, as it is now.
    #[must_use]
    pub fn sensor(&self) -> &SensorSpec {
        &self.sensor
    }

    /// The model that describes the simulated sensor exactly, with what is hidden now.
    #[must_use]
    pub fn truth(&self) -> Model {
        let sensor = &self.sensor;
        let mut model = Model { origin: Origin { supply: Some(sensor.supply.nominal) }, ..Model::default() };
        for axis in Axis::ALL.into_iter().filter(|&axis| axis == sensor.axis || self.turns_freely()) {
            let mut truth = AxisModel::base(axis);
            truth.terms[0].values[0] = sensor.alpha;
            truth.terms[1].values[0] = self.delta(axis);
            truth.terms.iter_mut().for_each(|term| term.std_errors = vec![0.0]);
            let of_all = |acting: &Acting| matches!(acting.hidden.effect.stage(), Stage::Timing | Stage::Shown);
            let here = |acting: &&Acting| axis == sensor.axis || of_all(acting);
            truth.terms.extend(self.hidden.iter().filter(here).map(|acting| acting.hidden.term()));
            truth.noise = Noise {
                angle_random_walk: sensor.alpha * sensor.noise_density / 2_f64.sqrt(),
                bias_random_walk: sensor.alpha * sensor.bias_random_walk,
                encoder: sensor.reference_std(),
                unexplained: 0.0,
            };
            model.axes[axis.index()] = Some(truth);
        }
        model
    }

    /// The next row.
    pub fn step(&mut self) -> Sample {
        let (rate_hz, k) = (self.rate_hz, self.count);
        let time_ns = (k as f64 * 1e9 / rate_hz).round() as i64;
        let steps = if k == 0 { 1 } else { OVERSAMPLING };
        let dt = if k == 0 { 0.0 } else { 1.0 / (rate_hz * f64::from(OVERSAMPLING)) };
        let mut signals = Signals::default();
        for step in 1..=steps {
            let t = time_ns as f64 * 1e-9 - f64::from(steps - step) * dt;
            signals = self.physics(t, dt);
        }
        self.count += 1;
        self.row(k, time_ns, signals)
    }

    /// One fine step: moves every state to `t`, s, and gives what the tested axis sees there.
    fn physics(&mut self, t: f64, dt: f64) -> Signals {
        let axis = self.sensor.axis.index();
        let free = self.turns_freely();
        let now = self.at(t);
        self.body.step(&self.sensor, free, now, dt, |t| at(&mut self.shafts, t));
        let supply = self.supply.0.step(dt, &mut self.supply.1);
        let delta_supply = supply - self.sensor.supply.sag * -(-t / 200.0).exp_m1();
        let valid = self.valid_time(t);
        let gyro = if valid == t { now } else { self.at(valid) };
        let mut signals = Signals {
            t,
            dt,
            axis,
            rates: gyro.map(|g| g.rate),
            rate_dot: gyro[axis].rate_dot,
            angle: gyro[axis].angle,
            accel: self.body.force,
            delta_temperature: self.sensor.temperature.at(t) - 25.0,
            temperature_dot: self.sensor.temperature.slope(t),
            delta_supply,
            supply: self.sensor.supply.nominal + delta_supply,
            ..Signals::default()
        };
        let mut rate = signals.rates[axis];
        for mount in of(&mut self.hidden, |stage, id| stage == Stage::Response && id == "mount-resonance") {
            rate = mount.hidden.effect.respond(&mount.hidden.values, rate, dt, &mut mount.memory);
        }
        signals.rates[axis] = rate;
        let error: f64 = of(&mut self.hidden, |stage, _| stage == Stage::Felt)
            .map(|felt| felt.hidden.effect.error(&felt.hidden.values, &signals, &mut felt.memory))
            .sum();
        rate += error;
        for own in of(&mut self.hidden, |stage, id| stage == Stage::Response && id != "mount-resonance") {
            rate = own.hidden.effect.respond(&own.hidden.values, rate, dt, &mut own.memory);
        }
        self.felt = rate;
        signals.rates = gyro.map(|g| g.rate);
        signals.angle = now[axis].angle;
        signals.rates[axis] = now[axis].rate;
        for reference in of(&mut self.hidden, |stage, _| stage == Stage::Reference) {
            reference.error = reference.hidden.effect.error(&reference.hidden.values, &signals, &mut reference.memory);
        }
        signals.rates = gyro.map(|g| g.rate);
        signals
    }

    /// What the instruments make of the state after the fine steps.
    fn row(&mut self, k: u64, t_ns: i64, signals: Signals) -> Sample {
        let (axis, t) = (self.sensor.axis.index(), signals.t);
        let now = self.at(t);
        let mut row = Row { t_ns, ..Row::EMPTY };
        for i in 0..3 {
            row.gyro[i] = self.read_gyro(i, signals.rates[i]);
            row.accel[i] = signals.accel[i] + normal(&mut self.instruments, self.sensor.accel_noise);
        }
        let temperature =
            signals.delta_temperature + 25.0 + normal(&mut self.instruments, self.sensor.temperature.noise);
        row.temperature = (temperature * 100.0).round() / 100.0;
        let nominal = self.sensor.supply.nominal;
        row.supply = nominal + signals.delta_supply + normal(&mut self.instruments, self.sensor.supply.noise);
        if k.is_multiple_of(self.sensor.reference_every.max(1) as u64) {
            self.read_reference(&mut row, axis, now);
        }
        Sample { row, true_rate: now.map(|n| n.rate), true_angle: now.map(|n| n.angle) }
    }

    fn read_gyro(&mut self, i: usize, rate: f64) -> f64 {
        let (sensor, dt) = (&self.sensor, 1.0 / self.rate_hz);
        if i != sensor.axis.index() && !self.turns_freely() {
            return quantise(rate + normal(&mut self.others, sensor.other_noise), sensor.quantum);
        }
        let white = sensor.noise_density * (0.5 * self.rate_hz).sqrt();
        let felt = if i == sensor.axis.index() { self.felt } else { rate };
        let delta = self.delta(Axis::ALL[i]);
        let mut reading = (felt - delta) / sensor.alpha;
        reading += normal(&mut self.white, white.hypot(sensor.rate_noise * rate));
        if i == sensor.axis.index() {
            reading += self.slow.step(dt, sensor.bias_random_walk);
            let limits = self.hidden.iter().map(|acting| &acting.hidden).filter(|h| h.effect.stage() == Stage::Reading);
            reading = limits.fold(reading, |reading, h| h.effect.limit(&h.values, reading));
        }
        quantise(reading, sensor.quantum).clamp(-sensor.full_scale, sensor.full_scale)
    }

    fn read_reference(&mut self, row: &mut Row, axis: usize, now: [Instant; 3]) {
        let noise = self.sensor.reference_noise;
        let now = self.shown(row.t_ns as f64 * 1e-9, now);
        match self.sensor.reference {
            Reference::Encoder(_) => {
                let errors = self.hidden.iter().filter(|a| a.hidden.effect.stage() == Stage::Reference);
                let error: f64 = errors.map(|acting| acting.error).sum();
                let angle = now[axis].angle + error + normal(&mut self.reference, noise);
                row.ref_angle[axis] = quantise(angle, self.sensor.count());
            }
            Reference::Rate => row.ref_rate[axis] = now[axis].rate + normal(&mut self.reference, noise),
            Reference::Quaternion => {
                let true_angle = self.at(row.t_ns as f64 * 1e-9).map(|instant| instant.angle);
                let off = std::array::from_fn(|i| now[i].angle - true_angle[i]);
                row.ref_quaternion = self.body.seen(off, noise, &mut self.reference);
            }
        }
    }

    /// The motion as the reference shows it at `t`, s. About the axes of a body, whose turns within a window are small.
    fn shown(&mut self, t: f64, now: [Instant; 3]) -> [Instant; 3] {
        let Self { hidden, shafts, rate_hz, .. } = self;
        let mut acting = hidden.iter().map(|acting| &acting.hidden).filter(|h| h.effect.stage() == Stage::Shown);
        let Some(own) = acting.next() else { return now };
        let window = own.effect.window(&own.values, 1.0 / *rate_hz);
        let mean = |of: &dyn Fn(Instant) -> f64, shaft: &mut Shaft| window.mean(|u| of(shaft.at(t + u)));
        std::array::from_fn(|i| Instant {
            angle: mean(&|instant| instant.angle, &mut shafts[i]),
            rate: mean(&|instant| instant.rate, &mut shafts[i]),
            ..now[i]
        })
    }

    /// Whether all three axes turn and are referenced.
    fn turns_freely(&self) -> bool {
        self.sensor.reference == Reference::Quaternion
    }

    /// δ of this axis: that of the tested one is the spec's, the others' differ from it.
    fn delta(&self, axis: Axis) -> f64 {
        self.sensor.delta * [1.0, -0.6, 0.4][(3 + axis.index() - self.sensor.axis.index()) % 3]
    }

    /// The time whose motion the gyro reads at `t`.
    fn valid_time(&self, t: f64) -> f64 {
        let timing = self.hidden.iter().filter(|acting| acting.hidden.effect.stage() == Stage::Timing);
        timing.fold(t, |t, acting| acting.hidden.effect.valid_time(&acting.hidden.values, t))
    }

    fn at(&mut self, t: f64) -> [Instant; 3] {
        at(&mut self.shafts, t)
    }
}

impl Iterator for Simulator {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        Some(self.step())
    }
}

impl SlowNoise {
    /// The bias of the next row, rad/s of reading.
    fn step(&mut self, dt: f64, random_walk: f64) -> f64 {
        self.walk.0 += normal(&mut self.walk.1, random_walk * dt.sqrt());
        let flicker = self.flicker.0.step(dt, &mut self.flicker.1);
        self.walk.0 + flicker + self.correlated.0.step(dt, &mut self.correlated.1)
    }
}

/// The effects at work that act here.
fn of(hidden: &mut [Acting], here: impl Fn(Stage, &str) -> bool) -> impl Iterator<Item = &mut Acting> {
    hidden.iter_mut().filter(move |acting| here(acting.hidden.effect.stage(), acting.hidden.effect.card().id))
}

fn at(shafts: &mut [Shaft; 3], t: f64) -> [Instant; 3] {
    shafts.each_mut().map(|shaft| shaft.at(t))
}

/// The motions of the three axes: on a rig the next axis wobbles and the one after next moves by its own.
fn shafts(scenario: &Scenario) -> [Shaft; 3] {
    let (sensor, seed) = (&scenario.sensor, scenario.seed);
    let i = sensor.axis.index();
    let mut shafts = [(); 3].map(|()| Shaft::Lines(Vec::new()));
    if sensor.reference == Reference::Quaternion {
        for (offset, shaft) in shafts.iter_mut().enumerate() {
            let motion = match scenario.motion {
                Motion::Sine { .. } => Motion::Multisine { travel: 5.0 },
                motion => motion,
            };
            *shaft = Shaft::new(motion, seed.wrapping_mul(3).wrapping_add(offset as u64));
        }
    }
    shafts[i] = Shaft::new(scenario.motion, seed);
    if sensor.reference != Reference::Quaternion {
        let random = &mut stream(seed, 10);
        let own = [(0.173, 2.0 / 3.0), (0.607, 1.0 / 3.0)].map(|(frequency, share)| Line {
            rate: share * sensor.other_rate,
            frequency: frequency * random.random_range(0.8..1.25),
            phase: random.random_range(0.0..TAU),
        });
        shafts[(i + 2) % 3] = Shaft::Lines(own.to_vec());
        let wobble = (0..WOBBLES).map(|_| Line {
            rate: sensor.wobble * (2.0 / f64::from(WOBBLES)).sqrt(),
            frequency: random.random_range(0.3..5.0),
            phase: random.random_range(0.0..TAU),
        });
        shafts[(i + 1) % 3] = Shaft::Lines(wobble.collect());
    }
    shafts
}

/// The nearest whole number of `quantum`s; the value itself where that is 0.
fn quantise(value: f64, quantum: f64) -> f64 {
    if quantum > 0.0 { (value / quantum).round() * quantum } else { value }
}
