//! The results of several logs as one.

use gyro_model::{
    Axis,
    diagnosis::{
        AxisResult, Diagnosis, EachAxis, EachLog, FloorFrom, LadderStep, LimitedBy, ParameterValue, RandomCause,
        Suspect, Verdict,
    },
    effects::{Effect, find, split_by},
    finding::{Adequate, Excess, Finding, NamedEffect},
    fit::parameters_of,
    pooled::{
        Key,
        column::is_own,
        curves,
        joint::Joint,
        search::{Repeated, Whose},
    },
};

/// One axis over all logs that have it, compared with the common model; `alone` has the parts of each log's error. `None` where none has it.
pub(super) fn axis(
    axis: Axis,
    held: &[Diagnosis],
    alone: &[Diagnosis],
    seconds: &[f64],
    names: &[String],
    joint: Option<&Joint>,
) -> Option<AxisResult> {
    let own = |k: usize| held[k].axes.iter().find(|own| own.axis == axis).map(|own| (k, own, seconds[k]));
    let all: Vec<(usize, &AxisResult, f64)> = (0..held.len()).filter_map(own).collect();
    let sound: Vec<(usize, &AxisResult, f64)> =
        all.iter().filter(|(_, own, _)| own.verdict != Verdict::BadData).copied().collect();
    let used = if sound.is_empty() { &all } else { &sound };
    let (_, longest, _) = used.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
    let lists: Vec<_> = used.iter().map(|(_, own, seconds)| (&own.error_curve[..], *seconds)).collect();
    let curve = curves::curve(&lists);
    let (over, within) = curves::over_floor(&curve);
    let weighed: Vec<(&AxisResult, f64)> = used.iter().map(|(_, own, seconds)| (*own, *seconds)).collect();
    let told: Vec<(&AxisResult, f64)> = used
        .iter()
        .filter_map(|(k, _, seconds)| Some((alone.get(*k)?.axes.iter().find(|own| own.axis == axis)?, *seconds)))
        .collect();
    let told = if told.is_empty() { weighed.clone() } else { told };
    let budget = curves::budget(&told, &curve);
    let finding = worst(&weighed.iter().map(|(own, _)| *own).collect::<Vec<_>>());
    let data_faults = all
        .iter()
        .flat_map(|(k, own, _)| {
            own.data_faults.iter().map(|fault| {
                let mut fault = fault.clone();
                fault.says = format!("{}: {}", names[*k], fault.says);
                fault
            })
        })
        .collect();
    let mut fails_where: Vec<_> = used.iter().flat_map(|(_, own, _)| own.fails_where.clone()).collect();
    let size = |f: &gyro_model::diagnosis::FailsWhere| {
        f.mean_error.zip(f.std_error).map_or(0.0, |(mean, error)| (mean / error).abs())
    };
    fails_where.sort_by(|a, b| size(b).total_cmp(&size(a)));
    fails_where.truncate(longest.fails_where.len().max(3));
    let mut pooled = AxisResult {
        error_curve: curve,
        error_over_floor: over,
        within_floor: Some(within),
        budget,
        fails_where,
        data_faults,
        floor_from: weighed.iter().map(|(own, _)| own.floor_from).max_by_key(|from| rank(*from)).unwrap_or_default(),
        random: random(&told),
        detail: None,
        error_by_frequency: Vec::new(),
        ..(*longest).clone()
    };
    (pooled.verdict, pooled.finding) = (finding.verdict(), finding);
    pooled.remarks.clear();
    if let Some(model) = joint.and_then(|joint| joint.model.axes[axis.index()].as_ref()) {
        pooled.parameters = parameters_of(&model.terms, axis);
        pooled.noise = gyro_model::fit::noise_of(model);
    }
    pooled.limited_by = limit(&told);
    if let Some(limit) = pooled.limited_by {
        let of = weighed.iter().find(|(own, _)| own.limited_by == Some(limit));
        pooled.limited_says = of.map(|(own, _)| own.limited_says.clone()).unwrap_or_default();
        pooled.limit = of.and_then(|(own, _)| own.limit.clone());
    }
    Some(pooled)
}

const fn rank(from: FloorFrom) -> u8 {
    match from {
        FloorFrom::Measured => 0,
        FloorFrom::Assumed => 1,
        FloorFrom::Unknown => 2,
    }
}

/// Random causes, each as the longest log that shows it has it.
fn random(all: &[(&AxisResult, f64)]) -> Vec<RandomCause> {
    let mut list: Vec<&(&AxisResult, f64)> = all.iter().collect();
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found: Vec<RandomCause> = Vec::new();
    for cause in list.into_iter().flat_map(|(own, _)| &own.random) {
        if found.iter().all(|known| known.cause != cause.cause) {
            found.push(cause.clone());
        }
    }
    found
}

/// What limits most of the time that was recorded.
fn limit(all: &[(&AxisResult, f64)]) -> Option<LimitedBy> {
    let seconds = |limit: LimitedBy| -> f64 {
        all.iter().filter(|(own, _)| own.limited_by == Some(limit)).map(|(_, seconds)| seconds).sum()
    };
    let list = LimitedBy::ALL.into_iter().filter(|limit| seconds(*limit) > 0.0);
    list.max_by(|a, b| seconds(*a).total_cmp(&seconds(*b)))
}

/// The finding of several logs of which nothing more is known: an error that one of them does not explain counts, one that cannot tell
/// does not where another can.
fn worst(all: &[&AxisResult]) -> Finding {
    let of = |verdict: Verdict| all.iter().find(|own| own.verdict == verdict).map(|own| own.finding.clone());
    let order = [Verdict::Unexplained, Verdict::Adequate, Verdict::CannotTell, Verdict::BadData];
    order.into_iter().find_map(of).unwrap_or(Finding::Adequate(Adequate::Limited))
}

/// Gives each axis its answer: what the logs show together, else what one of them names, else what they come to.
pub(super) fn judge(axes: &mut [AxisResult], alone: &[Diagnosis], repeated: &[Repeated], end: &[AxisResult]) {
    for axis in axes {
        let own: Vec<&AxisResult> =
            alone.iter().filter_map(|log| log.axes.iter().find(|own| own.axis == axis.axis)).collect();
        let found: Vec<&Repeated> =
            repeated.iter().filter(|r| r.axis == axis.axis && r.whose == Whose::Sensor).collect();
        axis.searched = true;
        axis.unfinished = own.iter().any(|own| own.unfinished);
        if !found.is_empty() {
            let end = end.iter().find(|end| end.axis == axis.axis);
            let curve = end.map(|end| end.error_curve.clone()).unwrap_or_default();
            let (j0, j1) = (curves::excess(&axis.error_curve), curves::excess(&curve));
            let fall = (axis.within_floor != Some(true) && j0 > 1.0).then(|| (j0 - j1) / (j0 - 1.0));
            axis.suspects = found.iter().map(|r| suspect(r, end, &curve, fall.filter(|_| found.len() == 1))).collect();
            axis.missing.clear();
            axis.missing_error_curve.clear();
            if found.len() > 1 {
                axis.missing = found.iter().map(|r| r.effect.clone()).collect();
                axis.missing_error_curve.clone_from(&curve);
            }
            let effects: Vec<NamedEffect> =
                found.iter().map(|r| NamedEffect { effect: r.effect.clone(), aliases: r.aliases.clone() }).collect();
            let over_floor = if found.len() > 1 { curves::over_floor(&curve).0 } else { None };
            axis.find(if effects.iter().any(|named| !named.aliases.is_empty()) {
                Finding::Ambiguous { effects, over_floor, added: false }
            } else {
                Finding::Missing { effects, over_floor }
            });
            continue;
        }
        // What one log names and the others do not is its set-up's: that log still lacks it.
        let names =
            own.iter().filter(|own| own.finding.names()).max_by_key(|own| own.verdict == Verdict::MissingEffect);
        if let Some(names) = names {
            axis.suspects.clone_from(&names.suspects);
            axis.missing.clone_from(&names.missing);
            axis.missing_error_curve.clone_from(&names.missing_error_curve);
            axis.find(names.finding.clone());
            continue;
        }
        let finding = worst(&own);
        // What no log explains by itself may still be within the band of all.
        let all_within =
            axis.within_floor == Some(true) && matches!(finding, Finding::Unexplained(Excess::NotSearched));
        axis.find(if all_within { Finding::Adequate(Adequate::WithinFloor { silent: 0.0 }) } else { finding });
    }
}

fn suspect(
    r: &Repeated,
    end: Option<&AxisResult>,
    curve: &[gyro_model::diagnosis::ErrorPoint],
    fall: Option<f64>,
) -> Suspect {
    let fitted: Vec<ParameterValue> =
        end.map(|end| end.parameters.iter().filter(|p| p.effect == r.effect).cloned().collect()).unwrap_or_default();
    Suspect {
        effect: r.effect.clone(),
        aliases: r.aliases.clone(),
        separate_by: split_by(&r.effect, &r.aliases),
        p_value: Some(r.p_value),
        error_fall: fall.filter(|fall| fall.is_finite()),
        log_likelihood_gain: Some(r.gain),
        parameters: if fitted.is_empty() { parameters(r) } else { fitted },
        error_curve: curve.to_vec(),
    }
}

/// The parameters of an effect as the equations say them.
fn parameters(r: &Repeated) -> Vec<ParameterValue> {
    let of = |(key, value, error): &(Key, f64, f64)| {
        let card = key.card();
        ParameterValue {
            effect: key.effect.clone(),
            name: key.name.clone(),
            value: Some(*value),
            std_error: Some(*error).filter(|error| error.is_finite()),
            unit: card.map_or("1", |card| card.unit).to_owned(),
            typical: card.map(|card| card.typical).filter(|typical| typical.is_finite()),
        }
    };
    r.parameters.iter().map(of).collect()
}

/// Each log's own.
pub(super) fn each(
    held: &[Diagnosis],
    alone: &[Diagnosis],
    names: &[String],
    joint: Option<&Joint>,
    repeated: &[Repeated],
) -> Vec<EachLog> {
    let of = |k: usize| {
        let axes = held[k].axes.iter().map(|own| {
            let fitted = joint.map(|joint| &joint.each[k]);
            let is_own = |id: &str| find(id).is_some_and(|effect: &dyn Effect| is_own(effect));
            let mut said: Vec<ParameterValue> = fitted.map_or_else(Vec::new, |fitted| {
                let told = fitted.alone.iter().filter(|(key, _)| key.axis == own.axis);
                told.map(|(key, (value, error))| value_of(key, *value, *error)).collect()
            });
            for r in repeated.iter().filter(|r| r.axis == own.axis) {
                let key = r.parameters.iter().max_by(|a, b| (a.1 / a.2).abs().total_cmp(&(b.1 / b.2).abs()));
                if let (Some((key, ..)), Some((value, error))) = (key, r.each.get(k).copied().flatten()) {
                    said.push(value_of(key, value, error));
                }
            }
            EachAxis {
                axis: own.axis,
                verdict: alone[k].axes.iter().find(|a| a.axis == own.axis).map_or(own.verdict, |a| a.verdict),
                parameters: own.parameters.iter().filter(|p| is_own(&p.effect)).cloned().collect(),
                alone: said,
                noise: own.noise,
                error_curve: own.error_curve.clone(),
                error_over_floor: own.error_over_floor,
                budget: own.budget.clone(),
                limited_by: own.limited_by,
            }
        });
        EachLog { log: names[k].clone(), axes: axes.collect() }
    };
    (0..held.len()).map(of).collect()
}

fn value_of(key: &Key, value: f64, error: f64) -> ParameterValue {
    let card = key.card();
    ParameterValue {
        effect: key.effect.clone(),
        name: key.name.clone(),
        value: Some(value).filter(|v| v.is_finite()),
        std_error: Some(error).filter(|e| e.is_finite()),
        unit: card.map_or("1", |card| card.unit).to_owned(),
        typical: card.map(|card| card.typical).filter(|typical| typical.is_finite()),
    }
}

/// What a ladder over several logs ends with on one axis.
pub(super) fn at_the_top(found: &AxisResult, end: AxisResult, steps: Vec<LadderStep>) -> AxisResult {
    let added = steps.iter().any(|step| step.added.is_some());
    let mut top =
        AxisResult { steps, of_logs: found.of_logs.clone(), unfinished: found.unfinished, searched: true, ..end };
    if !added {
        let finding = found.finding.clone();
        top.find(finding);
        top.suspects.clone_from(&found.suspects);
        return top;
    }
    top.suspects.clear();
    let alike: Vec<NamedEffect> = found
        .suspects
        .iter()
        .filter(|s| !s.aliases.is_empty())
        .map(|s| NamedEffect { effect: s.effect.clone(), aliases: s.aliases.clone() })
        .collect();
    if !alike.is_empty() {
        top.find(Finding::Ambiguous { effects: alike, over_floor: None, added: true });
    }
    top
}
