//! `truerate top`: the essentials of the dashboard in a terminal.

mod screen;

use crate::{
    dashboard::{errands::ask, order::Order},
    domain,
    found::{Finder, Found},
    watch::Watch,
    wire,
};
use anyhow::bail;
use ipc_types::{Estimate, MARK_DATA, Sample, Status, port::Reader, topic, wait::Wait};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use std::{collections::VecDeque, io::IsTerminal, path::Path, sync::mpsc, thread, time::Duration};
use workbench::motion::Motion;

/// Between two pictures.
const FRAME: Duration = Duration::from_millis(100);
/// Steps of motion that are drawn.
const STEPS: usize = 400;

/// What is drawn.
#[derive(Debug, Default)]
pub struct Scene {
    /// The pipeline's name.
    pub instance: String,
    /// What runs.
    pub status: Option<Status>,
    /// The running model, and the newest diagnosis.
    pub found: Found,
    /// The axis that is shown: 0, 1, 2.
    pub axis: usize,
    /// Residuals of that axis, °/s, newest last.
    pub residuals: [VecDeque<f64>; 3],
    /// What the last order came to.
    pub notice: String,
}

/// The ports of a watcher.
struct Ports {
    watch: Watch,
    samples: Reader<Sample>,
    estimates: Reader<Estimate>,
    finder: Finder,
    motion: Motion,
}

impl Ports {
    fn open(instance: &str) -> anyhow::Result<Self> {
        let watch = Watch::join(&domain::existing(instance)?, "top")?;
        let hub = &watch.hub;
        Ok(Self {
            samples: hub.reader(&topic::SAMPLE, None, Wait::Spin)?,
            estimates: hub.reader(&topic::ESTIMATE, None, Wait::Spin)?,
            finder: Finder::open(hub)?,
            watch,
            motion: Motion::default(),
        })
    }

    fn look(&mut self, scene: &mut Scene) -> anyhow::Result<()> {
        while let Some(sample) = self.samples.take()? {
            if sample.mark == MARK_DATA {
                self.motion.row(&wire::row_of(&sample));
            }
        }
        while let Some(estimate) = self.estimates.take()? {
            if estimate.mark == MARK_DATA {
                self.motion.estimate(&wire::estimate_of(&estimate));
            }
        }
        for step in self.motion.steps() {
            for (line, axis) in scene.residuals.iter_mut().zip(step.axes) {
                line.extend(axis.residual);
                let surplus = line.len().saturating_sub(STEPS);
                line.drain(..surplus);
            }
        }
        self.finder.look(&mut scene.found)?;
        if let Some(status) = self.watch.newest_status()? {
            scene.status = Some(status);
        }
        Ok(())
    }
}

/// Shows a running pipeline until `q` is pressed.
///
/// # Errors
/// Where no such pipeline runs, or there is no terminal.
pub fn run(instance: &str) -> anyhow::Result<()> {
    if !std::io::stdout().is_terminal() {
        bail!("`top` wants a terminal: use `truerate status`, or `truerate status --format json`");
    }
    let mut ports = Ports::open(instance)?;
    let mut scene = Scene { instance: instance.to_owned(), ..Scene::default() };
    let orders = Orders::start(instance)?;
    let mut terminal = ratatui::init();
    let result = loop {
        if ports.watch.is_outdated() {
            match Ports::open(instance) {
                Ok(anew) => ports = anew,
                Err(error) => scene.notice = format!("the pipeline is made again: {error:#}"),
            }
        } else if let Err(error) = ports.look(&mut scene) {
            break Err(error);
        }
        scene.pick_an_axis();
        if let Ok(says) = orders.answers.try_recv() {
            scene.notice = says;
        }
        if let Err(error) = terminal.draw(|frame| screen::draw(frame, &scene)) {
            break Err(error.into());
        }
        match key() {
            Ok(Some(KeyCode::Char('q') | KeyCode::Esc)) => break Ok(()),
            Ok(Some(code)) => scene.press(code, &orders),
            Ok(None) => {}
            Err(error) => break Err(error.into()),
        }
    };
    ratatui::restore();
    result
}

/// A key that was pressed before the next picture is due; Ctrl-C counts as `q`.
fn key() -> std::io::Result<Option<KeyCode>> {
    if !event::poll(FRAME)? {
        return Ok(None);
    }
    Ok(match event::read()? {
        Event::Key(key) if key.kind == KeyEventKind::Press => {
            let interrupt = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            Some(if interrupt { KeyCode::Esc } else { key.code })
        }
        _ => None,
    })
}

impl Scene {
    /// The axes that are modelled.
    fn axes(&self) -> Vec<usize> {
        let model = self.found.model.iter().flat_map(|m| &m.axes).filter_map(|a| "xyz".find(a.axis));
        model.collect()
    }

    fn pick_an_axis(&mut self) {
        let axes = self.axes();
        if !axes.contains(&self.axis) {
            self.axis = axes.first().copied().unwrap_or(self.axis);
        }
    }

    fn press(&mut self, code: KeyCode, orders: &Orders) {
        let axis = ["x", "y", "z"][self.axis];
        let order = |what: &str| Order { what: what.into(), axis: axis.into(), ..Order::default() };
        match code {
            KeyCode::Tab => {
                let axes = self.axes();
                let next = axes.iter().position(|&a| a == self.axis).map_or(0, |i| (i + 1) % axes.len().max(1));
                self.axis = axes.get(next).copied().unwrap_or(self.axis);
            }
            KeyCode::Char('a') => {
                let axes = self.found.diagnosis.iter().flat_map(|d| &d.axes);
                let best = axes.filter(|a| a.axis.index() == self.axis).flat_map(|a| &a.suspects).next();
                if let Some(best) = best {
                    let effect = best.effect.clone();
                    self.notice = format!("adding {effect} …");
                    orders.send(Order { effect, ..order("add") });
                }
            }
            KeyCode::Char('u') => orders.send(Order { axis: String::new(), ..order("undo") }),
            KeyCode::Char('p') => {
                let paused = self.found.model.as_ref().is_some_and(|m| m.paused);
                let what = if paused { "resume" } else { "pause" };
                orders.send(Order { axis: String::new(), ..order(what) });
            }
            _ => {}
        }
    }
}

/// A thread that asks, so that the picture goes on while an answer is awaited.
struct Orders {
    orders: mpsc::Sender<Order>,
    answers: mpsc::Receiver<String>,
}

impl Orders {
    fn start(instance: &str) -> anyhow::Result<Self> {
        let domain = domain::existing(instance)?;
        let (orders, taken) = mpsc::channel::<Order>();
        let (given, answers) = mpsc::channel();
        thread::spawn(move || {
            let mut hub = None;
            for order in taken {
                let answer = order.command(Path::new(".")).map_err(Into::into).and_then(|c| ask(&domain, &mut hub, c));
                let says = match answer {
                    Ok(reply) => reply.says.as_str().to_owned(),
                    Err(error) => format!("{error:#}"),
                };
                if given.send(says).is_err() {
                    return;
                }
            }
        });
        Ok(Self { orders, answers })
    }

    fn send(&self, order: Order) {
        // The thread lives as long as we hold its answers.
        let _ = self.orders.send(order);
    }
}
