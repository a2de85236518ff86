//! What a hand can do with a sensor: a few manoeuvres, each about one axis, as a rate over time and as a sentence.

use crate::Axis;
use serde::{Serialize, Serializer};
use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    fmt,
};

/// The kinds of manoeuvres, the easiest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Held still.
    Rest,
    /// To and fro through half a turn.
    Turn,
    /// To and fro through a quarter turn, quickly.
    Fast,
    /// Short strokes that start and stop at once.
    Sharp,
    /// To and fro through a quarter turn, slowly.
    Slow,
    /// Full turns, first one way and then the other.
    Round,
    /// Its temperature changes while it turns slowly.
    Warm,
    /// Its supply changes while it turns slowly.
    Supply,
}

impl Kind {
    /// All of them, in order.
    pub const ALL: [Self; 8] =
        [Self::Rest, Self::Turn, Self::Fast, Self::Sharp, Self::Slow, Self::Round, Self::Warm, Self::Supply];

    /// Those that any recording should have: a motion that it lacks hides the effects that this motion shows.
    pub const COURSE: [Self; 5] = [Self::Rest, Self::Fast, Self::Turn, Self::Sharp, Self::Slow];

    /// Whether it is the same about any axis.
    #[must_use]
    pub fn is_of_no_axis(self) -> bool {
        self == Self::Rest
    }

    /// How much it is preferred to others that tell as much: what is easy for a hand, and soon done. What is fast comes early: a
    /// recording that is slow at first cannot tell a delay from a clock that was set meanwhile.
    #[must_use]
    pub fn ease(self) -> f64 {
        match self {
            Self::Rest | Self::Fast => 1.0,
            Self::Turn | Self::Sharp => 0.7,
            Self::Slow => 0.6,
            Self::Round => 0.5,
            Self::Warm | Self::Supply => 0.3,
        }
    }

    /// Largest rate, rad/s; time of one period, s; how long it is wanted, s.
    fn facts(self) -> (f64, f64, f64) {
        let degrees = f64::to_radians;
        let slow = degrees(30.0);
        match self {
            Self::Rest => (0.0, 1.0, 4.0),
            Self::Turn => (degrees(90.0), TAU, 10.0),
            Self::Fast => (degrees(180.0), FRAC_PI_2, 8.0),
            Self::Sharp => (degrees(150.0), 1.6, 8.0),
            Self::Slow => (slow, PI * FRAC_PI_2 / slow, 10.0),
            Self::Round => (degrees(120.0), 12.0, 12.0),
            Self::Warm | Self::Supply => (slow, PI * FRAC_PI_2 / slow, 40.0),
        }
    }
}

/// One manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manoeuvre {
    /// About which axis.
    pub axis: Axis,
    /// Which.
    pub kind: Kind,
    /// Rates are wanted up to this, rad/s.
    pub rate: f64,
}

impl Manoeuvre {
    /// About this axis, no faster than `fastest`, rad/s.
    #[must_use]
    pub fn new(kind: Kind, axis: Axis, fastest: f64) -> Self {
        Self { axis, kind, rate: kind.facts().0.min(fastest) }
    }

    /// Whether it is this kind about this axis, however fast.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        self.kind == other.kind && (self.axis == other.axis || self.kind.is_of_no_axis())
    }

    /// Time of one to and fro, s.
    #[must_use]
    pub fn period(&self) -> f64 {
        self.kind.facts().1
    }

    /// How long it is wanted, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.kind.facts().2
    }

    /// From one end of it to the other, rad.
    #[must_use]
    pub fn travel(&self) -> f64 {
        match self.kind {
            Kind::Sharp => self.rate * self.period() / 4.0,
            Kind::Round => self.rate * self.period() / 2.0,
            _ => self.rate * self.period() / PI,
        }
    }

    /// The rate that is wanted `s` seconds after it began, rad/s.
    #[must_use]
    pub fn rate_at(&self, s: f64) -> f64 {
        let phase = (s / self.period()).rem_euclid(1.0);
        match self.kind {
            Kind::Rest => 0.0,
            Kind::Sharp => match phase {
                0.0..0.25 => self.rate,
                0.5..0.75 => -self.rate,
                _ => 0.0,
            },
            Kind::Round => self.rate * if phase < 0.5 { 1.0 } else { -1.0 },
            _ => self.rate * (TAU * phase).sin(),
        }
    }
}

impl fmt::Display for Manoeuvre {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (axis, fast) = (self.axis, format!("{:.0} °/s at its fastest", self.rate.to_degrees()));
        match self.kind {
            Kind::Rest => f.write_str("hold it still"),
            Kind::Turn => write!(f, "turn it about {axis}, to and fro through half a turn, 3 s each way: {fast}"),
            Kind::Fast => write!(f, "turn it about {axis}, to and fro through a quarter turn, quickly: {fast}"),
            Kind::Sharp => {
                write!(f, "turn it about {axis} in short strokes, to and fro: start and stop sharply, {fast}")
            }
            Kind::Slow => {
                write!(f, "turn it about {axis}, to and fro through a quarter turn, slowly, 5 s each way: {fast}")
            }
            Kind::Round => write!(f, "turn it about {axis} all the way round twice, then as far back: {fast}"),
            Kind::Warm => write!(f, "warm it by 5 K or more, or cool it, while it turns slowly about {axis}"),
            Kind::Supply => write!(f, "change its supply by 0.1 V or more while it turns slowly about {axis}"),
        }
    }
}

impl Serialize for Manoeuvre {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Order {
            manoeuvre: Kind,
            axis: Axis,
            rate: f64,
            travel: f64,
            period: f64,
            seconds: f64,
            says: String,
        }
        let (manoeuvre, axis, rate) = (self.kind, self.axis, self.rate);
        let (travel, period, seconds) = (self.travel(), self.period(), self.seconds());
        Order { manoeuvre, axis, rate, travel, period, seconds, says: self.to_string() }.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_manoeuvre_goes_as_far_and_as_fast_as_it_says_and_comes_back() {
        for kind in Kind::ALL {
            let own = Manoeuvre::new(kind, Axis::Y, 100.0);
            let n = 10_000;
            let step = own.period() / f64::from(n);
            let (mut angle, mut low, mut high, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
            for k in 0..n {
                let rate = own.rate_at((f64::from(k) + 0.5) * step);
                angle += rate * step;
                (low, high, fastest) = (low.min(angle), high.max(angle), fastest.max(rate.abs()));
            }
            assert!(angle.abs() < 1e-6, "{own}: {angle}");
            assert!((high - low - own.travel()).abs() < 1e-3, "{own}: {} and {}", high - low, own.travel());
            assert!((fastest - own.rate).abs() < 1e-6, "{own}");
        }
        let degrees = |kind| Manoeuvre::new(kind, Axis::X, 100.0).travel().to_degrees().round();
        assert_eq!([Kind::Turn, Kind::Fast, Kind::Slow, Kind::Round].map(degrees), [180.0, 90.0, 90.0, 720.0]);
    }

    #[test]
    fn no_manoeuvre_is_faster_than_what_the_gyro_reads() {
        for kind in Kind::ALL {
            assert!(Manoeuvre::new(kind, Axis::X, 1.0).rate <= 1.0);
        }
    }
}
