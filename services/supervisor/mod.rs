//! The supervisor: holds every topic, starts the processes and starts again what dies, sweeps, and leaves nothing behind.
//!
//! It never waits for those it supervises. When it dies itself they go on, and the next supervisor of the instance
//! adopts them.

pub mod board;
mod ending;
mod janitor;
mod manager;
mod ports;
pub mod process;
pub mod room;
pub mod summary;
pub mod vitals;
pub mod watchdog;

use crate::clock::now_ns;
use crate::{
    domain::Claim,
    profile::Profiler,
    rate_out::ring::Ring,
    run_folder::{Run, RunFolder, this_program},
    settings::Settings,
    stop::Stop,
};
use anyhow::{Context, bail};
use board::Board;
use ending::end;
use ipc_types::{ServiceId, State, health::Link};
use janitor::Janitor;
use manager::Manager;
use ports::Ports;
use process::{Fate, Process};
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::Errno,
};
use std::{fs, process::ExitCode, time::Duration};
use watchdog::Watchdog;
use workbench::{model_file, story};

/// Between two looks at the processes and two sweeps for what dead ones left; a death is seen at once.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 25_000_000 };
const STATUS_NS: u64 = 200_000_000;
/// Early deaths of a process by itself, in a row, after which the domain itself is taken to be broken. It is made anew once: where that
/// does not help, it is the process, and the others are left alone.
const BROKEN: u32 = 6;

/// One pipeline under supervision.
struct Pipeline {
    _janitor: Janitor,
    claim: Claim,
    folder: RunFolder,
    run: Run,
    ports: Option<Ports>,
    profiler: Option<Profiler>,
    processes: Vec<Process>,
    board: Board,
    watchdog: Watchdog,
    status_ns: u64,
    manager: Manager,
    /// A vehicle's recording broke off, and it goes on without.
    unrecorded: bool,
}

/// What an ended run comes to.
#[derive(Debug)]
pub struct Ending {
    /// The exit code of `truerate run`.
    pub code: ExitCode,
    /// Whether the source came to its end (and was not interrupted).
    pub complete: bool,
    /// The summary, as text.
    pub summary: String,
    /// What was hidden in the source, from the start and later, in order, as it was asked for.
    pub hidden: Vec<String>,
    /// Of each that the model has in the end: its size as it was hidden, and as it was found.
    pub found: Vec<String>,
}

/// Runs a pipeline until its source ends or it is asked to stop.
///
/// # Errors
/// Where the instance's folder cannot be used, or a process cannot be started.
pub fn supervise(claim: Claim, settings: Settings, stop: &Stop) -> anyhow::Result<Ending> {
    let mut pipeline = Pipeline::prepare(claim, settings)?;
    let ended = pipeline.profile(false).and_then(|()| pipeline.watch(stop));
    pipeline.manager.end();
    pipeline.publish(ended.is_ok());
    pipeline.end_processes();
    let summary = summary::text(&pipeline.run, &pipeline.folder, &pipeline.board);
    let source = pipeline.folder.source().unwrap_or_default();
    let later = source.switched.iter().map(|(_, text)| text);
    let hidden: Vec<String> = pipeline.run.settings.hide.iter().chain(later).cloned().collect();
    let model = model_file::load(&pipeline.folder.model(), &source.free_names);
    let found = model.map_or_else(|_| Vec::new(), |file| story::found(&hidden, &file.model));
    let lost = pipeline.board.lost();
    if let Some(Err(error)) = pipeline.profiler.take().map(Profiler::end) {
        tracing::error!("the trace is not whole: {error:#}");
    }
    pipeline.ports = None;
    if let Some(path) = pipeline.run.settings.ring(pipeline.claim.domain().name()) {
        Ring::end(&path, pipeline.run.number);
    }
    pipeline.claim.remove()?;
    let complete = ended?;
    let failed = matches!(complete, End::Hopeless) || pipeline.unrecorded || (lost > 0 && complete == End::Complete);
    Ok(Ending {
        code: if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS },
        complete: complete == End::Complete,
        summary: if complete == End::Hopeless { String::new() } else { summary },
        hidden,
        found,
    })
}

/// How the watch ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Complete,
    Interrupted,
    Hopeless,
}

impl Pipeline {
    fn prepare(claim: Claim, settings: Settings) -> anyhow::Result<Self> {
        let janitor = Janitor::start(claim.domain())?;
        let folder = RunFolder::of(claim.domain());
        let mut wanted = vec![ServiceId::Acquisition, ServiceId::Kalman, ServiceId::Compensator];
        if settings.record.is_some() {
            wanted.push(ServiceId::Recorder);
        }
        if settings.has_sender() {
            wanted.push(ServiceId::Sender);
        }
        if settings.dashboard != "off" {
            wanted.push(ServiceId::Dashboard);
        }
        let all = || wanted.iter().map(|&id| Process::new(id, folder.clone())).collect::<Vec<_>>();
        let mut processes = all();
        let before = processes.iter().any(Process::is_adopted).then(|| folder.run().ok()).flatten();
        let program = this_program()?;
        let run = match before {
            Some(run) if run.settings == settings && run.program == program => {
                tracing::warn!(instance = claim.domain().name(), "adopting the processes of a supervisor that died");
                run
            }
            _ => {
                if processes.iter().any(Process::is_adopted) {
                    tracing::warn!(
                        instance = claim.domain().name(),
                        "ending the processes of another run or build whose supervisor died"
                    );
                    end(&mut processes, || ());
                    processes = all();
                }
                claim.wipe()?;
                clear(&claim)?;
                room::check(claim.domain())?;
                claim.domain().begin_generation()?;
                let began_ns = now_ns();
                let number = began_ns ^ (u64::from(std::process::id()) << 44);
                let run = Run { number, began_ns, program, settings };
                folder.set_run(&run)?;
                run
            }
        };
        if let Some(path) = run.settings.ring(claim.domain().name()) {
            Ring::create(&path, run.number)?;
        }
        let mut pipeline = Self {
            _janitor: janitor,
            claim,
            folder,
            run,
            ports: None,
            profiler: None,
            processes,
            board: Board::default(),
            watchdog: Watchdog::default(),
            status_ns: 0,
            manager: Manager::of_this_process(),
            unrecorded: false,
        };
        pipeline.open()?;
        Ok(pipeline)
    }

    /// Opens the topics; where they are broken, everything ends, is wiped and begins again.
    fn open(&mut self) -> anyhow::Result<()> {
        match Ports::open(&self.claim) {
            Ok(ports) => self.ports = Some(ports),
            Err(error) => {
                tracing::warn!("the domain is broken and is made again: {error:#}");
                self.begin_again()?;
            }
        }
        Ok(())
    }

    /// Begins to write the trace, where one is wanted; or goes on with it.
    fn profile(&mut self, goes_on: bool) -> anyhow::Result<()> {
        if let Some(path) = &self.run.settings.profile
            && self.profiler.is_none()
        {
            self.profiler = Some(Profiler::start(self.claim.domain(), self.run.number, path, goes_on)?);
        }
        Ok(())
    }

    fn begin_again(&mut self) -> anyhow::Result<()> {
        self.ports = None;
        let profiled = self.profiler.take().is_some();
        self.end_processes();
        self.claim.wipe()?;
        self.claim.domain().begin_generation()?;
        self.ports = Some(Ports::open(&self.claim).context("a fresh domain")?);
        for process in &mut self.processes {
            *process = process.anew();
        }
        self.profile(profiled)
    }

    fn watch(&mut self, stop: &Stop) -> anyhow::Result<End> {
        loop {
            if stop.asked() {
                return Ok(End::Interrupted);
            }
            // What came meanwhile is heard before anybody is called silent.
            self.hear()?;
            self.manager.beat();
            self.watchdog.look();
            if let Some(end) = self.look_at_processes()? {
                return Ok(end);
            }
            self.listen()?;
            if self.is_complete() {
                return Ok(End::Complete);
            }
            self.wait()?;
        }
    }

    /// Waits for the next look, which a death brings forward.
    fn wait(&self) -> anyhow::Result<()> {
        let mut deaths: Vec<PollFd<'_>> =
            self.processes.iter().filter_map(|process| Some(PollFd::new(process.death()?, PollFlags::IN))).collect();
        match poll(&mut deaths, Some(&LOOK)) {
            // A signal ends the wait early, too: it may be the wish to end.
            Ok(_) | Err(Errno::INTR) => Ok(()),
            Err(error) => Err(error).context("waiting for the processes"),
        }
    }

    fn look_at_processes(&mut self) -> anyhow::Result<Option<End>> {
        for i in 0..self.processes.len() {
            let service = self.processes[i].service;
            let (goes_on, name) = (self.goes_on_without(service), service.name());
            let process = &mut self.processes[i];
            match process.look() {
                Fate::Alive => {}
                // Nobody but its onlookers needs the dashboard.
                Fate::Hopeless if service == ServiceId::Dashboard => {
                    tracing::warn!("there is no dashboard: give another --dashboard ADDR, or off");
                }
                Fate::Hopeless if goes_on => {
                    tracing::error!("the recording has broken off; the vehicle goes on without");
                    self.unrecorded = true;
                }
                Fate::Hopeless => return Ok(Some(End::Hopeless)),
                Fate::Died(words) => {
                    process.restarts += 1;
                    if let Some(shortage) = room::shortage(self.claim.domain()) {
                        tracing::error!("{shortage}, which {name} may have died of: free some");
                    }
                    match process.delay() {
                        Duration::ZERO => tracing::warn!("{name} {words}; it is started again"),
                        delay => tracing::warn!(
                            "{name} {words}, {} times in a row soon after its start; it is started again in {delay:.2?}",
                            process.early_deaths()
                        ),
                    }
                    if service == ServiceId::Acquisition && self.run.settings.source.comes_once() {
                        bail!("acquisition {words}, and what it read cannot be read again: run it on a file");
                    }
                    if process.early_failures() == BROKEN && service != ServiceId::Dashboard {
                        tracing::warn!("{name} dies again and again; everything is ended and begun again");
                        self.begin_again()?;
                        return Ok(None);
                    }
                }
            }
            let process = &mut self.processes[i];
            if process.is_due() {
                process.start(self.claim.domain().name(), &self.run.settings)?;
            } else {
                self.end_if_it_hangs(i);
            }
        }
        Ok(None)
    }

    /// Whether nobody needs this process any more, who had done something before: a vehicle does not stop for a full disk.
    fn goes_on_without(&self, service: ServiceId) -> bool {
        let has_begun = self.board.of(service).is_some_and(|health| health.sent > 0);
        service == ServiceId::Recorder && self.run.settings.is_vehicle() && has_begun
    }

    /// Ends a process that has been silent for longer than a slow machine explains.
    fn end_if_it_hangs(&mut self, i: usize) {
        let process = &self.processes[i];
        let (service, Some(pid)) = (process.service, process.pid()) else { return };
        // What standard input gave cannot be read again: the end of its reader would be the run's.
        let replaceable = service != ServiceId::Acquisition || !self.run.settings.source.comes_once();
        let health = self.board.of(service);
        if let Some((silent, doing)) = self.watchdog.hangs(service, pid, health, process.started_ns(), replaceable) {
            tracing::warn!("{} is silent for {:.1} s and {doing}; it is ended", service.name(), silent as f64 * 1e-9);
            self.processes[i].condemn();
        }
    }

    fn listen(&mut self) -> anyhow::Result<()> {
        if let Some(ports) = &self.ports {
            let (_, resisting) = ports.hub.sweep();
            if resisting > 0 {
                tracing::debug!(resisting, "dead nodes that cannot be cleared");
            }
        }
        self.hear()?;
        if now_ns() >= self.status_ns + STATUS_NS {
            self.publish(false);
        }
        // Not that they have anything to do: a sensor may come later.
        if self.all_were_heard() && self.manager.is_ready() {
            tracing::info!("all processes are there");
        }
        Ok(())
    }

    fn hear(&mut self) -> anyhow::Result<()> {
        if let Some(ports) = &self.ports {
            while let Some(health) = ports.health.take()? {
                if health.run == self.run.number {
                    self.board.take(health);
                }
            }
        }
        Ok(())
    }

    fn publish(&mut self, finished: bool) {
        self.status_ns = now_ns();
        let list = self.processes.iter().map(|p| {
            let state = match p.pid() {
                None if p.is_over() => "failed",
                None => "restarting",
                Some(pid) if self.board.is(p.service, Some(pid), State::Failed) => "failed",
                Some(pid) if self.board.is(p.service, Some(pid), State::Finished) => "stopped",
                Some(pid) if self.board.is(p.service, Some(pid), State::Running) => "running",
                Some(_) => "starting",
            };
            (p.service, p.pid(), p.restarts, state)
        });
        let status = self.board.status(self.run.number, finished, &self.run.settings.wait, list);
        if status.source.link != Link::None as u32 {
            self.manager.tell(&format!("source: {}", Link::name(status.source.link)));
        }
        if let Some(Err(error)) = self.ports.as_ref().map(|p| p.status.give(status)) {
            tracing::warn!("status: {error}");
        }
    }

    fn all_were_heard(&self) -> bool {
        let heard = |p: &Process| self.board.of(p.service).is_some_and(|health| Some(health.pid) == p.pid());
        self.processes.iter().all(|p| p.is_over() || heard(p))
    }

    fn is_complete(&self) -> bool {
        self.processes
            .iter()
            .filter(|p| p.service != ServiceId::Dashboard)
            .all(|p| p.pid().is_some() && self.board.is(p.service, p.pid(), State::Finished))
    }

    fn end_processes(&mut self) {
        let mut processes = std::mem::take(&mut self.processes);
        end(&mut processes, || {
            self.manager.beat();
            if let Err(error) = self.hear() {
                tracing::debug!("the last news: {error:#}");
            }
        });
        self.processes = processes;
    }
}

/// Clears the run's files but the claim's lock.
fn clear(claim: &Claim) -> anyhow::Result<()> {
    for entry in fs::read_dir(claim.domain().folder())?.flatten() {
        let path = entry.path();
        if path.is_file() && entry.file_name() != "lock" {
            fs::remove_file(&path).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}
