//! Whose a misalignment is. Of two axes that feel each other's rate, a rotation of the whole sensor makes m_ik = −m_ki: it is the mount's.
//! What both have alike, m_ik = m_ki, no mount makes: it is the chip's.
//!
//! ```text
//! ω_s = ω − φ × ω        m_ik = ±φ_j + s,   m_ki = ∓φ_j + s        i, k, j the axes in any order
//! ```
//!
//! Log by log both come from the joint equations of the two axes, with the covariance of m_ik and m_ki, and then go through the same mixed
//! model as any parameter ([`super::spread`]).

use super::{
    Key,
    spread::{Nested, Reading},
};
use crate::{Axis, effects::Trait};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// What two axes of a type feel of each other.
#[derive(Clone, Debug)]
pub struct Tilt {
    /// The type.
    pub kind: String,
    /// The two axes, in order.
    pub axes: [Axis; 2],
    /// By how much the sensor is turned about the third axis, rad.
    pub turned: Share,
    /// What both axes have alike, as a share of the other's rate.
    pub alike: Share,
    /// Part by part, the best predictions.
    pub parts: Vec<OfPart>,
}

/// One of the two.
#[derive(Clone, Debug)]
pub struct Share {
    /// Mean and spreads.
    pub nested: Nested,
    /// Chance of such a mean or such spreads where there is nothing of it, priced for the questions.
    pub p_value: f64,
}

/// The same of one part, best prediction. A standard error that is not known is not finite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OfPart {
    /// The part.
    pub part: String,
    /// By how much it is turned, rad.
    pub turned: f64,
    /// Standard error of that.
    pub turned_error: f64,
    /// The share that both axes have alike.
    pub alike: f64,
    /// Standard error of that.
    pub alike_error: f64,
}

impl Tilt {
    /// The axis about which a mount is turned that shows in these two.
    #[must_use]
    pub fn about(&self) -> Axis {
        third(self.axes)
    }
}

fn third(axes: [Axis; 2]) -> Axis {
    Axis::ALL[3 - axes[0].index() - axes[1].index()]
}

/// Questions that are asked of each pair: of either share the mean and two spreads.
const QUESTIONS: f64 = 6.0;
/// Pairs of axes.
const PAIRS: [[Axis; 2]; 3] = [[Axis::X, Axis::Y], [Axis::X, Axis::Z], [Axis::Y, Axis::Z]];

/// The share of axis `of`'s rate that axis `on` feels.
fn felt(on: Axis, of: Axis, id: &str) -> Key {
    Key::new(on, id, &format!("m_{of}"))
}

/// Whether an effect is what a turned sensor makes.
fn is_turn(key: &Key) -> bool {
    crate::effects::find(&key.effect).is_some_and(|effect| effect.is(Trait::Turn))
}

/// The pairs of axes of one type of which a misalignment was found, where the logs tell both axes. `logs` are the parts' numbers and the
/// logs' equations, `chosen` what was found on all axes.
pub(super) fn tilts(
    kind: &str,
    names: &[String],
    logs: &[(usize, &super::search::Member)],
    chosen: &BTreeSet<Key>,
) -> Vec<Tilt> {
    let of = |axes: [Axis; 2]| -> Option<Tilt> {
        let [i, k] = axes;
        let own = chosen.iter().find(|key| is_turn(key) && (key.axis == i || key.axis == k))?;
        let pair = [felt(i, k, &own.effect), felt(k, i, &own.effect)];
        pair.iter().any(|key| chosen.contains(key)).then_some(())?;
        let beside: BTreeSet<Key> = chosen.iter().filter(|key| axes.contains(&key.axis)).cloned().collect();
        // m_ik is +φ_j where i, k, j go round as x, y, z do.
        let sign = if (i.index() + 1) % 3 == k.index() { 1.0 } else { -1.0 };
        let (mut turned, mut alike) = (Vec::new(), Vec::new());
        for (part, member) in logs {
            let Some(([a, b], [aa, ab, bb])) = member.told_both(&pair, &beside) else { continue };
            let reading = |value: f64, variance: f64| Reading { part: *part, value, variance };
            turned.push(reading(0.5 * sign * (a - b), 0.25 * (aa - 2.0 * ab + bb)));
            alike.push(reading(0.5 * (a + b), 0.25 * (aa + 2.0 * ab + bb)));
        }
        let share = |readings: &[Reading]| -> Option<Share> {
            let nested = Nested::fit(readings)?;
            let p = nested.p_of_mean().min(nested.p_of_spread()).min(nested.p_of_spread_of_logs());
            Some(Share { p_value: (p * QUESTIONS * PAIRS.len() as f64).min(1.0), nested })
        };
        let (of_mount, of_chip) = (share(&turned)?, share(&alike)?);
        let mut by_part: BTreeMap<usize, (Vec<Reading>, Vec<Reading>)> = BTreeMap::new();
        for (turned, alike) in turned.iter().zip(&alike) {
            let own = by_part.entry(turned.part).or_default();
            own.0.push(*turned);
            own.1.push(*alike);
        }
        let parts = by_part.into_iter().map(|(part, (turned, alike))| {
            let (turned, turned_error) = of_mount.nested.predicted(&turned);
            let (alike, alike_error) = of_chip.nested.predicted(&alike);
            OfPart { part: names[part].clone(), turned, turned_error, alike, alike_error }
        });
        Some(Tilt { kind: kind.to_owned(), axes, parts: parts.collect(), turned: of_mount, alike: of_chip })
    };
    PAIRS.into_iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pooled::{Column, Piece, piece::Noise, search::Member};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Standard error of one log.
    const SIGMA: f64 = 5e-4;

    /// A log of two axes, whose shares of the other's rate are these, each known to [`SIGMA`].
    fn log(shares: [f64; 2], random: &mut ChaCha8Rng) -> Member {
        let keys = [felt(Axis::X, Axis::Y, "cross-axis"), felt(Axis::Y, Axis::X, "cross-axis")];
        let columns = keys.map(|key| Column { key, unit: "1".to_owned(), at: 0.0, own: false }).to_vec();
        let weight = SIGMA.powi(-2);
        // The two are correlated: what turns one axis shakes the other.
        let score = |k: usize, noise: [f64; 2]| weight * (shares[k] + 0.5 * shares[1 - k]) + weight.sqrt() * noise[k];
        let [a, b]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(random));
        let noise = [a, 0.5 * a + 0.75_f64.sqrt() * b];
        let none = Noise {
            angle_random_walk: 0.0,
            bias_random_walk: 0.0,
            encoder: 0.0,
            correlated: 0.0,
            correlation_time: 1.0,
            rate_random_walk: 0.0,
        };
        Member::of(&[Piece {
            axes: vec![Axis::X, Axis::Y],
            columns,
            information: vec![weight, 0.5 * weight, weight],
            score: vec![score(0, noise), score(1, noise)],
            expected: vec![0.0; 2],
            inflation: vec![1.0; 2],
            shows: vec![0.0; 2],
            squares: 1.0,
            readings: 100,
            noise: none,
        }])
    }

    fn found(turned: f64, alike: f64, spread: f64, seed: u64) -> Tilt {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let names: Vec<String> = (0..12).map(|part| format!("p{part:02}")).collect();
        let logs: Vec<(usize, Member)> = (0..24)
            .map(|k| {
                let own: f64 = StandardNormal.sample(&mut random);
                let turned = turned + spread * own;
                (k % 12, log([turned + alike, alike - turned], &mut random))
            })
            .collect();
        let members: Vec<(usize, &Member)> = logs.iter().map(|(part, member)| (*part, member)).collect();
        let chosen = BTreeSet::from([felt(Axis::X, Axis::Y, "cross-axis")]);
        let mut all = tilts("T", &names, &members, &chosen);
        assert_eq!(all.len(), 1);
        all.remove(0)
    }

    #[test]
    fn a_rotation_is_the_mounts_and_what_axes_have_alike_the_chips() {
        let (mut right, n) = (0, 100);
        for seed in 0..n {
            let mount = found(0.013, 0.0, 0.003, seed);
            let chip = found(0.0, 0.002, 0.0, 1000 + seed);
            let is_of = |tilt: &Tilt| (tilt.turned.p_value < 2e-3, tilt.alike.p_value < 2e-3);
            right += usize::from(is_of(&mount) == (true, false)) + usize::from(is_of(&chip) == (false, true));
            let off = (mount.turned.nested.mean - 0.013).abs() / mount.turned.nested.std_error;
            assert!(off < 5.0 && mount.about() == Axis::Z && mount.parts.len() == 12, "{off}");
        }
        assert!(right >= 190, "{right} of 200");
    }

    #[test]
    fn turned_about_y_axes_z_and_x_go_round_and_x_and_z_do_not() {
        assert_eq!(third([Axis::X, Axis::Z]), Axis::Y);
        let sign = |i: Axis, k: Axis| (i.index() + 1) % 3 == k.index();
        assert!(sign(Axis::X, Axis::Y) && sign(Axis::Y, Axis::Z) && !sign(Axis::X, Axis::Z));
    }
}
