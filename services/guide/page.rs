//! The same in a browser: the manoeuvre in large words, whether it is followed, and what each parameter's standard error lacks.

use super::{Ending, Show, goal::shown, screen::end};
use crate::{
    dashboard::{
        guard::Guard,
        scene::Scene,
        server::{self, Shop},
    },
    hopeless::Hopeless,
    listening::Address,
};
use anyhow::{Context, Result};
use gyro_model::guide::{Followed, Goal, State};
use serde::Serialize;
use std::{
    path::PathBuf,
    sync::{Arc, mpsc::channel},
    thread,
    time::Duration,
};

/// An open page is given so long to fetch the end before the process ends.
const FAREWELL: Duration = Duration::from_millis(500);

/// Tells its pages, and whoever else is told.
pub(super) struct Page {
    scene: Scene,
    log: String,
    beside: Box<dyn Show>,
}

/// What a page shows.
#[derive(Default, Serialize)]
struct Shown {
    log: String,
    /// What to do now.
    now: String,
    /// Whether it is done, or what is wrong with it.
    hand: String,
    /// `good`, `warn`, `unknown`.
    tone: &'static str,
    /// Share of the manoeuvre that is made.
    made: f64,
    seconds: f64,
    rows: u64,
    troubles: Vec<String>,
    goals: Vec<Wanted>,
    /// What it came to, a paragraph each; empty while it is recorded.
    end: Vec<String>,
}

/// One parameter.
#[derive(Serialize)]
struct Wanted {
    axis: &'static str,
    name: String,
    known: String,
    needed: String,
    /// Share of the information that is there.
    share: f64,
    /// `gathering`, `enough`, `given up`.
    state: &'static str,
    /// Why it was given up; empty else.
    why: String,
}

impl Wanted {
    fn of(goal: &Goal) -> Self {
        let (name, known, needed) = shown(goal);
        let (state, why) = match &goal.out_of_reach {
            _ if goal.known => ("enough", String::new()),
            Some(why) => ("given up", why.clone()),
            None => ("gathering", String::new()),
        };
        let share = if goal.known { 1.0 } else { goal.gathered() };
        Self { axis: goal.axis.letter(), name, known, needed, share, state, why }
    }
}

impl Page {
    /// Serves pages at this address, and says where on standard error.
    ///
    /// # Errors
    /// An address where nothing can listen.
    pub fn open(address: Address, log: &std::path::Path, beside: Box<dyn Show>) -> Result<Self> {
        let listener = address
            .listen(None)
            .context("the dashboard cannot listen: choose another address with --dashboard")
            .map_err(Hopeless::from_error)?;
        let address = listener.local_addr().context("the page's address")?;
        let guard = Guard::of(address, None).context("a token")?;
        eprintln!("dashboard: {}", guard.url());
        let scene = Scene::without_rows();
        // A recording takes no orders: whoever sends one is told that nobody is there.
        let (errands, _) = channel();
        let shop = Shop {
            home: server::GUIDE,
            scene: scene.clone(),
            guard: Arc::new(guard),
            errands,
            folder: PathBuf::new(),
            export: Arc::new(|_, name| Err(format!("{name}: a recording has its log alone"))),
        };
        thread::Builder::new().name("server".into()).spawn(move || {
            if let Err(error) = server::serve(listener, shop) {
                // The recording goes on: its log is worth more than its page.
                eprintln!("truerate: dashboard {address}: {error}");
            }
        })?;
        Ok(Self { scene, log: log.display().to_string(), beside })
    }

    fn show(&self, shown: Shown) {
        self.scene.now("guide", &Shown { log: self.log.clone(), ..shown });
    }
}

impl Show for Page {
    fn waits(&mut self, says: &str) -> Result<()> {
        self.show(Shown { now: format!("wait {says}"), tone: "unknown", ..Shown::default() });
        self.beside.waits(says)
    }

    fn state(&mut self, state: &State, source: Option<&str>) -> Result<()> {
        let (hand, tone, made) = match (state.correction(), state.hand, &state.order) {
            (Some(correction), ..) => (correction, "warn", 0.0),
            (None, Followed::Well, Some(order)) => {
                let (made, whole) = (state.followed.min(order.seconds()), order.seconds());
                (format!("good: {made:.0} of {whole:.0} s"), "good", made / whole)
            }
            _ => (String::new(), "unknown", 0.0),
        };
        self.show(Shown {
            now: state.says(),
            hand,
            tone,
            made,
            seconds: state.seconds,
            rows: state.rows,
            troubles: state.troubles.iter().map(ToString::to_string).chain(source.map(str::to_owned)).collect(),
            goals: state.goals.iter().map(Wanted::of).collect(),
            ..Shown::default()
        });
        self.beside.state(state, source)
    }

    fn end(&mut self, ending: &Ending) -> Result<()> {
        self.show(Shown {
            now: if ending.complete { "done: the log tells what was asked" } else { "ended: the log lacks something" }
                .into(),
            tone: if ending.complete { "good" } else { "warn" },
            seconds: ending.seconds,
            rows: ending.rows,
            goals: ending.parameters.iter().map(Wanted::of).collect(),
            troubles: ending.troubles.iter().map(ToString::to_string).collect(),
            end: end(ending, usize::MAX),
            ..Shown::default()
        });
        self.beside.end(ending)?;
        if self.scene.is_watched() {
            thread::sleep(FAREWELL);
        }
        Ok(())
    }
}
