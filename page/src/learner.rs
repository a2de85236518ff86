//! What learns beside a vehicle: the model refitted to the stream so far, held against it, searched for what is missing, and changed.

use crate::{
    rows,
    told::{Told, tell},
    vehicle::ROWS,
};
use anyhow::{Context, Result, anyhow, bail};
use gyro_model::{
    Axis, AxisModel, Model, Record, Term,
    diagnose::{Options, diagnose},
    diagnosis::{AxisResult, DIAGNOSIS, Diagnosis, ErrorPoint},
    drift,
    effects::find,
    headline, learning,
    thin::thinned,
    units,
    words::Voice,
};
use serde_json::{Value, json};
use std::path::Path;
use workbench::{
    agreement::{self, Agreement},
    files,
    model_file::{self, ModelFile},
    report::stream,
    story,
};

/// Rows that are looked at; longer drives are thinned to them.
const MOST: usize = 12_000;
/// Fewest rows before anything is looked at: half a second at least of every averaging time.
const FEWEST: usize = 500;

/// See the module's head.
pub struct Learner {
    axis: Axis,
    hidden: String,
    record: Record,
    model: Model,
    searches: u64,
    /// What the last search of a model with these effects found.
    found: Vec<AxisResult>,
    agreement: Agreement<&'static str>,
    /// What the newest change won, and what was hidden beside what was found.
    won: Option<String>,
}

impl Learner {
    /// Of a vehicle whose gyro turns about `axis`, with `hidden` in it.
    pub fn new(axis: &str, hidden: &str) -> Result<Self> {
        Ok(Self {
            axis: axis.parse().map_err(|_| anyhow!("no axis {axis:?}"))?,
            hidden: hidden.to_owned(),
            record: Record::default(),
            model: Model::default(),
            searches: 0,
            found: Vec::new(),
            agreement: Agreement::default(),
            won: None,
        })
    }

    /// Takes the rows that have come, learns from all of them, and says how the model stands; after a search, which takes longer,
    /// what it lacks.
    pub fn learn(&mut self, search: bool) -> Result<Value> {
        self.hear();
        if self.record.len() < FEWEST {
            return Ok(json!({ "waits": format!("{} of {FEWEST} rows are there", self.record.len()) }));
        }
        let record = thinned(&self.record, MOST);
        let solution = learning::refitted(&record, &self.model)?;
        let waits = learning::not_excited(&solution);
        if waits.is_none() {
            self.take(solution);
        }
        let mut axes = learning::judged(&record, &self.model, true);
        if search {
            tell(Told::Progress, "searching");
            let own = self.model.clone();
            self.found = diagnose(&record, &own, &record.fitted_axes(), &Options::default())?;
            self.searches += 1;
        }
        learning::take_suspects(&mut axes, &self.found);
        Ok(self.told(axes, waits))
    }

    fn hear(&mut self) {
        let bytes = files::take(Path::new(ROWS));
        self.record.rows.extend(bytes.iter().flat_map(|bytes| rows::read(bytes)));
    }

    fn take(&mut self, model: Model) {
        self.model = Model { epoch: self.model.epoch + 1, ..model };
    }

    /// Tries an effect beside the model in use, on the same samples, and takes it where it is better on what neither learned from.
    pub fn add(&mut self, effect: &str) -> Result<Value> {
        self.hear();
        let mut other = self.model.clone();
        let own = other.axes[self.axis.index()].get_or_insert_with(|| AxisModel::base(self.axis));
        let known = find(effect).with_context(|| format!("no effect {effect:?}"))?;
        if own.term(effect).is_some() {
            bail!("{effect} is in the model already");
        }
        own.terms.push(Term::neutral(known, self.axis));
        learning::begin(&mut other, &self.found);
        tell(Told::Progress, "trying it beside the model in use");
        let record = thinned(&self.record, MOST);
        let (model, trial) = learning::attempt(&record, &self.model, &other)?;
        let trial = trial.context("the model in use cannot be fitted")?;
        let (before, after) = trial.excess();
        if !trial.is_won() {
            let [before, after] = [before, after].map(|excess| units::ratio(excess.sqrt()));
            bail!(
                "{effect} is not better so far (error ÷ noise {before} → {after}): it is not taken. Drive on, and try again"
            );
        }
        let won = headline::won(effect, self.curve(&trial.present), self.curve(&trial.other));
        self.change(model);
        self.won = Some(won);
        Ok(self.told(trial.other, None))
    }

    /// Takes an effect out of the model.
    pub fn remove(&mut self, effect: &str) -> Result<Value> {
        self.hear();
        let mut other = self.model.clone();
        let own = other.axes[self.axis.index()].as_mut().context("there is no model yet")?;
        own.terms.retain(|term| term.effect.card().id != effect);
        let record = thinned(&self.record, MOST);
        let model = learning::refitted(&record, &other)?;
        self.change(model);
        self.won = None;
        let axes = learning::judged(&record, &self.model, true);
        Ok(self.told(axes, None))
    }

    /// Another model: nobody has searched with it yet.
    fn change(&mut self, model: Model) {
        self.take(model);
        self.found.clear();
        self.agreement = Agreement::default();
    }

    fn curve<'a>(&self, axes: &'a [AxisResult]) -> &'a [ErrorPoint] {
        axes.iter().find(|own| own.axis == self.axis).map_or(&[], |own| &own.error_curve)
    }

    /// How the model stands, in the words of the dashboard.
    fn told(&mut self, mut axes: Vec<AxisResult>, waits: Option<String>) -> Value {
        headline::fill(&mut axes, Voice::Stream);
        drift::fill(&mut axes);
        let verdict = |own: &AxisResult| serde_json::to_value(own.verdict).ok()?.as_str().map(str::to_owned);
        let own = axes.iter().find(|own| own.axis == self.axis);
        let verdict = own.and_then(verdict).unwrap_or_default();
        let named = own.and_then(|own| own.suspects.first()).filter(|_| agreement::is_named(&verdict));
        let name = named.and_then(|best| find(&best.effect)).map_or("", |effect| effect.card().id);
        let search = if self.found.is_empty() { 0 } else { self.searches };
        let [agreed, ..] = self.agreement.take(search, [name, "", ""]);
        let times = || self.record.rows.iter().map(|row| row.t_ns);
        let seen_ns = times().next_back().zip(times().next()).map_or(0, |(last, first)| last - first);
        let t = times().next_back().unwrap_or(0) as f64 * 1e-9;
        let diagnosis = Diagnosis::new(DIAGNOSIS, "vehicle", axes);
        let errors: Vec<stream::ErrorAt> = stream::errors(&diagnosis, t).collect();
        let mut page = stream::page(&diagnosis);
        page.axes.retain(|own| own.axis == self.axis.letter());
        let file = ModelFile { model: self.model.clone(), provenance: None, own_effects: Vec::new() };
        let hidden = [self.hidden.clone()];
        json!({
            "t": t,
            "epoch": self.model.epoch,
            "waits": waits,
            "view": page.axes.pop(),
            "errors": errors,
            "looking": agreement::looking(&verdict, agreed, seen_ns),
            "effects": self.model.axes[self.axis.index()].as_ref().map(AxisModel::effect_ids),
            "model": model_file::refuse_unseen(&file.model).is_ok().then(|| model_file::render(&file)),
            "won": self.won,
            "found": story::found(&hidden, &self.model),
        })
    }
}
