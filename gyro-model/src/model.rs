//! The model: effects and their parameters, axis by axis.

use crate::{
    Axis,
    effects::{Effect, ParameterCard, Role},
};

/// A model of up to three axes.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Grows by one with every change; stamped on every estimate made with it.
    pub epoch: u64,
    /// The axes that are modelled.
    pub axes: [Option<AxisModel>; 3],
    /// What the parameters are relative to.
    pub origin: Origin,
}

/// Zero points that belong to the log on which the model was fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Origin {
    /// Supply voltage against which ΔV counts (the log's median), V.
    pub supply: Option<f64>,
}

/// One axis: which effects it has, with which parameters, and how noisy it is.
#[derive(Clone, Debug, Default)]
pub struct AxisModel {
    /// The effects, in the order of adding; the base model is `scale-factor`, `bias`.
    pub terms: Vec<Term>,
    /// The identified noise.
    pub noise: Noise,
}

/// One effect with its parameters.
#[derive(Clone, Debug)]
pub struct Term {
    /// The effect, out of the catalogue or a user's own.
    pub effect: &'static dyn Effect,
    /// Values in the order of `effect.parameters(axis)`.
    pub values: Vec<f64>,
    /// Their standard errors; `NaN` before a fit.
    pub std_errors: Vec<f64>,
}

/// The stochastic errors of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// N, rad/√s.
    pub angle_random_walk: f64,
    /// Random walk of the bias, rad/s/√s.
    pub bias_random_walk: f64,
    /// Standard deviation of one reference angle, rad.
    pub encoder: f64,
    /// Error that the model leaves and no noise of a sensor makes, as a share of the motion: α is known no better than that. 0 where noise
    /// is all that is left.
    pub unexplained: f64,
}

impl Term {
    /// A term at the parameters that change nothing.
    #[must_use]
    pub fn neutral(effect: &'static dyn Effect, axis: Axis) -> Self {
        let values: Vec<f64> = effect.parameters(axis).iter().map(|p| p.neutral).collect();
        let std_errors = vec![f64::NAN; values.len()];
        Self { effect, values, std_errors }
    }

    /// Each parameter with its card: (card, value, standard error).
    pub fn parameters(&self, axis: Axis) -> impl Iterator<Item = (&'static ParameterCard, f64, f64)> + '_ {
        self.effect.parameters(axis).iter().zip(&self.values).zip(&self.std_errors).map(|((c, &v), &s)| (c, v, s))
    }

    /// By how many of its standard errors it differs from nothing: the most of its coefficients or, where it has none, of the
    /// shapes that are zero without it. `None` where none of them has a standard error.
    #[must_use]
    pub fn size_in_errors(&self, axis: Axis) -> Option<f64> {
        let of = |role: Role| {
            let sized = self.parameters(axis).filter(|(card, ..)| card.role == role && card.neutral == 0.0);
            sized.map(|(_, value, error)| value.abs() / error).filter(|size| size.is_finite()).max_by(f64::total_cmp)
        };
        of(Role::Linear).or_else(|| of(Role::Shape))
    }
}

impl Model {
    /// An effect that a fit saw nothing of, so that its parameters are no numbers to go by: a resonance without a frequency,
    /// a limit that no reading reaches.
    #[must_use]
    pub fn unseen(&self) -> Option<(Axis, &'static str)> {
        let of_axis =
            |axis: Axis| self.axes[axis.index()].iter().flat_map(|own| &own.terms).map(move |term| (axis, term));
        let mut terms = Axis::ALL.into_iter().flat_map(of_axis);
        let (axis, term) = terms.find(|(_, term)| term.values.iter().any(|value| !value.is_finite()))?;
        Some((axis, term.effect.card().id))
    }
}

impl AxisModel {
    /// No effect at all.
    pub const EMPTY: Self = Self {
        terms: Vec::new(),
        noise: Noise { angle_random_walk: 0.0, bias_random_walk: 0.0, encoder: 0.0, unexplained: 0.0 },
    };

    /// The base model at α = 1, δ = 0.
    #[must_use]
    pub fn base(axis: Axis) -> Self {
        use crate::effects::{bias::BIAS, scale_factor::SCALE_FACTOR};
        Self { terms: vec![Term::neutral(&SCALE_FACTOR, axis), Term::neutral(&BIAS, axis)], noise: Noise::default() }
    }

    /// The term of this id, if the model has it.
    #[must_use]
    pub fn term(&self, id: &str) -> Option<&Term> {
        self.terms.iter().find(|t| t.effect.card().id == id)
    }

    /// The ids of the effects, in the order of adding.
    #[must_use]
    pub fn effect_ids(&self) -> Vec<&'static str> {
        self.terms.iter().map(|t| t.effect.card().id).collect()
    }

    /// α of the paper's equation (1); 1 where the model has no `scale-factor`.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        self.term("scale-factor").map_or(1.0, |t| t.values[0])
    }

    /// δ of the paper's equation (1), rad/s; 0 where the model has no `bias`.
    #[must_use]
    pub fn delta(&self) -> f64 {
        self.term("bias").map_or(0.0, |t| t.values[0])
    }
}
