//! A recording, guided: which manoeuvre next, whether the hand makes it, and whether the recording tells by now what was asked.
//!
//! [`Guide`] takes rows as they come. Twice a second somebody answers its [`Ask`] with the rows so far, beside the stream: the model is
//! fitted, and where the next order is due, each manoeuvre is rehearsed ([`Knowledge`]) to see what it would tell. Once all goals are
//! reached the recording is searched as `diagnose` does; what it cannot tell apart becomes the next goals.

mod goal;
mod hand;
mod knowledge;
mod manoeuvre;
mod state;
pub mod temperature;
#[cfg(test)]
mod tests;
mod watch;

pub use goal::{Goal, Precision, unguided};
pub use hand::Hand;
pub use knowledge::Knowledge;
pub use manoeuvre::{Kind, Manoeuvre};
pub use state::{Correction, Followed, Stage, State, Trouble};

use crate::{
    Axis, Model, Record, Row,
    diagnosis::{AxisResult, Verdict},
    effects::{Effect, Need, find},
    fit::FitError,
};
use state::Order;
use temperature::Course;
use watch::{Seen, Watch};

/// What is wanted of a recording.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// On these axes.
    pub axes: Vec<Axis>,
    /// These effects, and how well.
    pub effects: Vec<(&'static dyn Effect, Precision)>,
    /// Whether it is to tell what is missing, whatever that is: it then has every motion of the usual course.
    pub course: bool,
    /// Whether it is to have a course of temperatures.
    pub temperature: bool,
}

/// See the module's head.
#[derive(Clone, Debug)]
pub struct Guide {
    wanted: Wanted,
    goals: Vec<Goal>,
    /// Effects that are in the model besides, because the recording has them.
    found: Vec<Goal>,
    order: Option<Order>,
    /// How long each manoeuvre was made, and how often it came to its end.
    made: Vec<(Manoeuvre, f64, u32)>,
    watch: Watch,
    fastest: [f64; 3],
    model: Option<Model>,
    stage: Stage,
    /// Time of the last row, and of the last look at the hand, s.
    now: f64,
    looked: f64,
    rows: u64,
    searches: u32,
    /// Goals that were lacking when the order was given.
    lacked: usize,
    axes: Vec<AxisResult>,
    temperature: Option<Course>,
}

/// What is to be computed from the rows so far.
#[derive(Clone, Debug)]
pub struct Ask {
    goals: Vec<Goal>,
    found: Vec<Goal>,
    candidates: Vec<Manoeuvre>,
    model: Option<Model>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Answer {
    model: Result<Model, FitError>,
    gains: Vec<(Manoeuvre, f64)>,
    chosen: bool,
}

/// Between two looks at the hand, s.
const LOOK: f64 = 0.1;
/// How long a hand may take before it is corrected, s.
const PATIENCE: f64 = 1.5;
/// How long an order stands that nobody follows, s.
const REFUSED: f64 = 20.0;
/// A manoeuvre of which so much was made counts as made, s.
const MADE: f64 = 3.0;
/// By how much less a manoeuvre is preferred each time that it was made to its end.
const WEARIED: f64 = 0.6;
/// One that was skipped counts as made so often.
const SKIPPED: u32 = 3;
/// A sum of ln σ below which no manoeuvre helps.
const HELPS: f64 = 0.02;
/// Motion that does not make an error smaller by [`BETTER`] for so long tells no more of it, s.
const STALLED: f64 = 30.0;
const BETTER: f64 = 0.88;
/// Searches at most: each but the first for what the one before could not tell.
const SEARCHES: u32 = 3;
/// How many of its standard errors an effect has to be for two to be told apart.
const APART: f64 = 8.0;
/// No faster than this share of what the gyro reads at most.
const WITHIN: f64 = 0.75;
/// Rates below this are no motion, rad/s.
const STILL: f64 = 0.05;

impl Guide {
    /// Nothing is recorded yet.
    #[must_use]
    pub fn new(wanted: Wanted) -> Self {
        let mut goals = Vec::new();
        let temperature = wanted.temperature.then(Course::default);
        for &axis in &wanted.axes {
            for &(effect, precision) in &wanted.effects {
                goals.extend(Goal::of(effect, axis, precision));
            }
        }
        Self {
            wanted,
            goals,
            found: Vec::new(),
            order: None,
            made: Vec::new(),
            watch: Watch::new(),
            fastest: [f64::INFINITY; 3],
            model: None,
            stage: Stage::Recording,
            now: 0.0,
            looked: 0.0,
            rows: 0,
            searches: 0,
            lacked: 0,
            axes: Vec::new(),
            temperature,
        }
    }

    /// Gives up what needs an input that these rows, the first ones, do not have.
    pub fn check(&mut self, first: &Record) {
        for goal in &mut self.goals {
            let needs = find(goal.effect).map_or(&[][..], |effect| effect.card().needs);
            if let Some(need) = needs.iter().find(|need| !need.is_in(first, goal.axis)) {
                goal.out_of_reach = Some(format!("it needs {need}, which the source does not give"));
            }
        }
    }

    /// Takes the next row.
    pub fn take(&mut self, row: &Row) {
        self.now = row.t_ns as f64 * 1e-9;
        self.rows += 1;
        self.watch.take(row);
        if self.order.is_none() && self.stage == Stage::Recording {
            self.command(Manoeuvre::new(Kind::Rest, self.wanted.axes[0], 0.0));
        }
        if let Some(course) = &mut self.temperature {
            course.take(self.now, row.temperature);
        }
        let dt = self.now - self.looked;
        if dt < LOOK {
            return;
        }
        self.looked = self.now;
        if let Some(course) = self.temperature.filter(|course| !course.is_over() && self.stage == Stage::Recording) {
            let axis = self.wanted.axes[0];
            self.command(Manoeuvre::new(course.meanwhile(), axis, self.fastest[axis.index()]));
        }
        let Some(order) = &self.order else { return };
        if self.stage == Stage::Recording && self.followed(order) == Followed::Well {
            let manoeuvre = order.manoeuvre;
            let dt = dt.min(2.0 * LOOK);
            if let Some(order) = &mut self.order {
                order.followed += dt;
            }
            match self.made.iter_mut().find(|(made, ..)| made.is_like(&manoeuvre)) {
                Some((_, seconds, _)) => *seconds += dt,
                None => self.made.push((manoeuvre, dt, 0)),
            }
            // Until it has been cold and hot, no motion tells of the temperature.
            if manoeuvre.kind != Kind::Rest && !self.has_course() {
                for goal in self.goals.iter_mut().filter(|goal| goal.lacks()) {
                    goal.stalled.1 += dt;
                }
            }
        }
    }

    /// How an order is followed.
    fn followed(&self, order: &Order) -> Followed {
        let (manoeuvre, since) = (&order.manoeuvre, order.since);
        let window = (0.5 * manoeuvre.period()).clamp(1.0, 4.0);
        let seen = |axis: Axis, seconds: f64| self.watch.seen(axis, seconds, since);
        let own = seen(manoeuvre.axis, window);
        if own.seconds < 0.9 {
            return Followed::TooEarly;
        }
        let of_others = |other: &Axis| *other != manoeuvre.axis && self.wanted.axes.contains(other);
        let others = Axis::ALL.into_iter().filter(of_others).map(|axis| (seen(axis, window).rate, axis));
        let (most, other) =
            others.fold((0.0, None), |most, (rate, axis)| if rate > most.0 { (rate, Some(axis)) } else { most });
        let wrong = |correction: Correction| Followed::Not { correction, reached: own.rate, other };
        let early = self.now - since < PATIENCE;
        let judged = match manoeuvre.kind {
            Kind::Rest => {
                if own.rate.max(most) > STILL {
                    wrong(Correction::Still)
                } else {
                    Followed::Well
                }
            }
            // What these change is seen in what is known.
            Kind::Warm | Kind::Supply => Followed::Well,
            _ if most > 1.5 * own.rate && most > 4.0 * STILL => wrong(Correction::OtherAxis),
            _ if own.rate < STILL => wrong(Correction::Move),
            _ if own.rate < 0.6 * manoeuvre.rate => wrong(Correction::Faster),
            Kind::Slow if own.rate > 3.0 * manoeuvre.rate => wrong(Correction::Slower),
            _ if own.rate > 3.0 * manoeuvre.rate || own.rate > self.fastest[manoeuvre.axis.index()] => {
                wrong(Correction::Slower)
            }
            _ => {
                let whole = seen(manoeuvre.axis, manoeuvre.period().min(10.0));
                let is_whole = whole.seconds > 0.9 * manoeuvre.period().min(10.0);
                if is_whole && whole.travel < 0.35 * manoeuvre.travel() {
                    wrong(Correction::Further)
                } else {
                    Followed::Well
                }
            }
        };
        if early && judged != Followed::Well { Followed::TooEarly } else { judged }
    }

    /// What is to be computed now; nothing while the recording is searched, or once all is over.
    #[must_use]
    pub fn ask(&self) -> Option<Ask> {
        if self.stage != Stage::Recording || self.order.is_none() {
            return None;
        }
        let candidates = if self.is_order_due() && !self.has_course() { self.candidates() } else { Vec::new() };
        Some(Ask { goals: self.goals.clone(), found: self.found.clone(), candidates, model: self.model.clone() })
    }

    /// Whether a course of temperatures is under way.
    fn has_course(&self) -> bool {
        self.temperature.is_some_and(|course| !course.is_over())
    }

    /// Gives up what is ordered now: something else comes next.
    pub fn skip(&mut self) {
        if let Some(course) = self.temperature.as_mut().filter(|course| !course.is_over()) {
            course.next();
            return;
        }
        let Some(order) = &mut self.order else { return };
        let manoeuvre = order.manoeuvre;
        order.followed = order.followed.max(manoeuvre.seconds());
        match self.made.iter_mut().find(|(made, ..)| made.is_like(&manoeuvre)) {
            Some((.., times)) => *times += SKIPPED,
            None => self.made.push((manoeuvre, 0.0, SKIPPED)),
        }
    }

    fn lacking(&self) -> usize {
        self.goals.iter().filter(|goal| goal.lacks()).count()
    }

    fn is_order_due(&self) -> bool {
        let Some(order) = &self.order else { return true };
        let is_over = order.followed >= order.manoeuvre.seconds();
        let has_told = order.followed >= MADE && self.lacking() < self.lacked;
        is_over || has_told || self.is_refused(order)
    }

    /// Whether the hand makes something else all the time. One that does nothing is told so instead.
    fn is_refused(&self, order: &Order) -> bool {
        let moves = self.wanted.axes.iter().any(|axis| self.watch.seen(*axis, 2.0, order.since).rate > STILL);
        self.now - order.since > REFUSED + order.manoeuvre.seconds() && order.followed < MADE && moves
    }

    /// Every manoeuvre that may be next.
    fn candidates(&self) -> Vec<Manoeuvre> {
        let needs = |goal: &Goal| find(goal.effect).map_or(&[][..], |effect| effect.card().needs);
        let lacks = |need: Need| self.goals.iter().any(|goal| goal.lacks() && needs(goal).contains(&need));
        let is_possible = |kind: &Kind| match kind {
            Kind::Warm => lacks(Need::Temperature),
            Kind::Supply => lacks(Need::Supply),
            _ => true,
        };
        let about = |kind: Kind| {
            let axes = if kind.is_of_no_axis() { &self.wanted.axes[..1] } else { &self.wanted.axes[..] };
            axes.iter().map(move |axis| Manoeuvre::new(kind, *axis, self.fastest[axis.index()]))
        };
        Kind::ALL.into_iter().filter(is_possible).flat_map(about).collect()
    }

    /// Takes what was computed, and gives the next order where one is due.
    pub fn learn(&mut self, answer: Answer) {
        if self.stage != Stage::Recording {
            return;
        }
        for &axis in &self.wanted.axes {
            if let Some(rail) = self.watch.rail(axis) {
                self.fastest[axis.index()] = self.fastest[axis.index()].min(WITHIN * rail);
            }
        }
        if let Ok(model) = answer.model {
            self.watch.calibrate(&model);
            for goal in &mut self.goals {
                goal.learn(&model);
                goal.look_for_progress();
            }
            self.model = Some(model);
        }
        if answer.chosen && self.is_order_due() {
            self.choose(&answer.gains);
        }
    }

    fn choose(&mut self, gains: &[(Manoeuvre, f64)]) {
        if let Some(order) = &self.order {
            let (manoeuvre, worn) = (order.manoeuvre, if self.is_refused(order) { 3 } else { 1 });
            match self.made.iter_mut().find(|(made, ..)| made.is_like(&manoeuvre)) {
                Some((.., times)) => *times += worn,
                None => self.made.push((manoeuvre, 0.0, worn)),
            }
        }
        let times = |manoeuvre: &Manoeuvre| {
            self.made.iter().find(|(made, ..)| made.is_like(manoeuvre)).map_or(0, |(_, _, times)| *times)
        };
        let worth = |(manoeuvre, gain): &(Manoeuvre, f64)| {
            gain * manoeuvre.kind.ease() * WEARIED.powi(times(manoeuvre).cast_signed())
        };
        let best = gains.iter().max_by(|a, b| worth(a).total_cmp(&worth(b))).copied();
        if self.lacking() > 0 {
            match best {
                Some((manoeuvre, gain)) if gain > HELPS => return self.command(manoeuvre),
                // Nothing is known yet.
                _ if self.model.is_none() => return self.course_or_search(),
                _ => self.goals.iter_mut().filter(|goal| goal.lacks()).for_each(Goal::give_up),
            }
        }
        self.course_or_search();
    }

    /// What the usual course still lacks, else the search.
    fn course_or_search(&mut self) {
        let lacks_model = self.model.is_none();
        let is_made = |wanted: &Manoeuvre| {
            self.made.iter().any(|(made, seconds, times)| made.is_like(wanted) && (*seconds >= MADE || *times > 2))
        };
        let kinds: &[Kind] = if self.wanted.course || lacks_model { &Kind::COURSE } else { &[] };
        let about = |axis: &Axis| {
            let fastest = self.fastest[axis.index()];
            kinds.iter().map(|kind| Manoeuvre::new(*kind, *axis, fastest)).collect::<Vec<_>>()
        };
        let next = self.wanted.axes.iter().flat_map(about).find(|manoeuvre| !is_made(manoeuvre));
        match next {
            Some(manoeuvre) => self.command(manoeuvre),
            None if lacks_model => self.command(Manoeuvre::new(Kind::Turn, self.wanted.axes[0], f64::INFINITY)),
            None => self.stage = Stage::Searching,
        }
    }

    fn command(&mut self, manoeuvre: Manoeuvre) {
        if self.order.as_ref().is_none_or(|order| order.manoeuvre != manoeuvre || order.followed >= manoeuvre.seconds())
        {
            self.order = Some(Order { manoeuvre, since: self.now, followed: 0.0 });
        }
        self.lacked = self.lacking();
    }

    /// Takes the verdicts of a search of all rows. Effects that the recording cannot tell apart become goals, an effect that keeps a
    /// parameter from being known joins the model; where nothing more can be done, all is over.
    pub fn judge(&mut self, axes: Vec<AxisResult>) {
        self.searches += 1;
        let before = self.lacking();
        for axis in &axes {
            match (axis.verdict, axis.in_question()) {
                (Verdict::Ambiguous, Some(best)) => {
                    let others = best.aliases.iter().map(String::as_str);
                    for id in std::iter::once(best.effect.as_str()).chain(others) {
                        self.want_apart(axis, id);
                    }
                }
                (Verdict::MissingEffect, Some(best)) => self.join(axis.axis, &best.effect),
                _ => {}
            }
        }
        self.axes = axes;
        let goes_on = self.lacking() > before && self.searches < SEARCHES;
        self.stage = if goes_on { Stage::Recording } else { Stage::Over };
        if goes_on {
            self.order = None;
            // The hand goes on as it does until the rehearsals have shown what is next.
            self.command(Manoeuvre::new(Kind::Turn, self.wanted.axes[0], self.fastest[self.wanted.axes[0].index()]));
        }
    }

    /// An effect is wanted so well that it is told from what looks like it.
    fn want_apart(&mut self, axis: &AxisResult, id: &str) {
        let Some(effect) = find(id).filter(|effect| unguided(*effect).is_none()) else { return };
        let size = axis.in_question().into_iter().flat_map(|best| &best.parameters).filter(|p| p.effect == id);
        for mut goal in Goal::of(effect, axis.axis, Precision::OfTypical(1.0 / APART)) {
            let found = size.clone().find(|p| p.name == goal.name).and_then(|p| p.value);
            if let Some(value) = found.filter(|value| value.abs() > 0.0) {
                goal.wanted = goal.wanted.min(value.abs() / APART);
            }
            match self
                .goals
                .iter_mut()
                .find(|own| (own.axis, own.effect, own.name) == (goal.axis, goal.effect, goal.name))
            {
                Some(own) => {
                    own.wanted = own.wanted.min(goal.wanted);
                    (own.known, own.out_of_reach) = (false, None);
                }
                None => self.goals.push(goal),
            }
        }
    }

    /// An effect joins the model where some goal is out of reach without it.
    fn join(&mut self, axis: Axis, id: &str) {
        let Some(effect) = find(id).filter(|effect| unguided(*effect).is_none()) else { return };
        let is_new = !self.goals.iter().chain(&self.found).any(|own| own.axis == axis && own.effect == id);
        let mut given_up =
            self.goals.iter_mut().filter(|goal| goal.axis == axis && goal.out_of_reach.is_some()).peekable();
        if is_new && given_up.peek().is_some() {
            given_up.for_each(|goal| (goal.out_of_reach, goal.stalled) = (None, (f64::INFINITY, 0.0)));
            self.found.extend(Goal::of(effect, axis, Precision::OfTypical(1.0)));
        }
    }

    /// How it stands, to be shown.
    #[must_use]
    pub fn state(&self) -> State {
        let order = self.order.as_ref().filter(|_| self.stage == Stage::Recording);
        State {
            stage: self.stage,
            seconds: self.now,
            rows: self.rows,
            order: order.map(|order| order.manoeuvre),
            followed: order.map_or(0.0, |order| order.followed),
            hand: order.map_or(Followed::TooEarly, |order| self.followed(order)),
            troubles: self.troubles(),
            goals: self.goals.clone(),
            temperature: self.temperature,
        }
    }

    /// Whether all that was asked can be told: every goal is known; where the question is what is missing, a search has told.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let decided = |axis: &AxisResult| {
            matches!(
                axis.verdict,
                Verdict::Adequate | Verdict::MissingEffect | Verdict::Ambiguous | Verdict::Unexplained
            )
        };
        let told = !self.axes.is_empty() && self.axes.iter().all(decided);
        self.stage == Stage::Over && (self.goals.iter().all(|goal| goal.known) || self.wanted.course && told)
    }

    /// The axes that are recorded.
    #[must_use]
    pub fn judged_axes(&self) -> Vec<Axis> {
        self.wanted.axes.clone()
    }

    /// What the last search came to.
    #[must_use]
    pub fn axes(&self) -> &[AxisResult] {
        &self.axes
    }

    fn troubles(&self) -> Vec<Trouble> {
        let mut troubles = Vec::new();
        troubles.extend(self.watch.rows_a_second().filter(|rows| *rows < state::FEWEST_ROWS).map(Trouble::SlowRows));
        for &axis in &self.wanted.axes {
            let Seen { seconds, travel, reference, .. } = self.watch.seen(axis, 3.0, 0.0);
            let (far, near) = (state::FAR, state::FAR / 20.0);
            if seconds > 2.0 && travel > far && reference < near {
                troubles.push(Trouble::ReferenceStands(axis));
            }
            if seconds > 2.0 && reference > far && travel < near {
                troubles.push(Trouble::GyroStands(axis));
            }
            if let Some(rail) = self.watch.rail(axis) {
                troubles.push(Trouble::Saturates(axis, rail));
            }
        }
        troubles
    }
}

impl Ask {
    /// The answer, from the rows so far.
    #[must_use]
    pub fn answer(&self, record: &Record) -> Answer {
        let all: Vec<Goal> = self.goals.iter().chain(&self.found).cloned().collect();
        let chosen = !self.candidates.is_empty();
        match Knowledge::of(record, &all, self.model.as_ref()) {
            Ok(mut knowledge) => {
                let mut gains = Vec::new();
                if chosen {
                    let mut goals = self.goals.clone();
                    for goal in &mut goals {
                        goal.learn(&knowledge.model);
                    }
                    knowledge.weigh(record);
                    let each = knowledge.gains(&self.candidates, &goals);
                    gains = self.candidates.iter().copied().zip(each).collect();
                }
                Answer { model: Ok(knowledge.model), gains, chosen }
            }
            Err(error) => Answer { model: Err(error), gains: Vec::new(), chosen },
        }
    }
}

impl Goal {
    /// Notes whether motion still makes its error smaller; gives it up where it does not.
    fn look_for_progress(&mut self) {
        let Some(error) = self.std_error.filter(|_| self.lacks()) else { return };
        if error < BETTER * self.stalled.0 {
            self.stalled = (error, 0.0);
        } else if self.stalled.1 > STALLED {
            self.out_of_reach = Some(
                "more of this motion makes it no better: something else spoils the reading, which the search is to find".to_owned(),
            );
        }
    }

    /// No manoeuvre tells more of it.
    fn give_up(&mut self) {
        let shown = find(self.effect).map_or("", |effect| effect.card().excited_by);
        self.out_of_reach = Some(format!("no motion shows it as this sensor is mounted; it shows by: {shown}"));
    }
}
