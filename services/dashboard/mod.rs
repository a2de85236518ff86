//! dashboard: watches the pipeline and shows it in a browser; sends what is ordered there.
//!
//! ```text
//! topics ─▶ feed ─▶ scene ─▶ server ─▶ pages (SSE)        one thread watches, one serves, one asks
//!                              └─▶ order ─▶ errands ─▶ compensator, acquisition (request–response)
//! ```
//!
//! It only reads, and asks as `truerate control` does: when it dies or hangs nobody notices.

pub mod errands;
mod export;
mod feed;
pub mod guard;
pub mod judgement;
pub mod model;
pub mod order;
mod peer;
pub mod scene;
pub mod server;

use crate::{
    hopeless::Hopeless,
    listening::Address,
    pulse::Pulse,
    run_folder::{Run, RunFolder},
    stop::Stop,
};
use anyhow::Context;
use feed::Feed;
use guard::Guard;
use ipc_types::{ServiceId, State, domain::Domain, port::Hub};
use scene::Scene;
use server::Shop;
use std::{net::TcpListener, sync::Arc, thread, time::Duration};
use workbench::output::{For, write_for};

/// Between two looks at the topics: a page gets 20 steps a second.
const LOOK: Duration = Duration::from_millis(25);
/// Looks between two attempts at an address that is in use.
const LOOKS_PER_ATTEMPT: u32 = 80;

/// The process.
///
/// # Errors
/// An address that is none, or broken plumbing.
pub fn run(hub: &Hub, domain: &Domain, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let address = Address::parse(&run.settings.dashboard).map_err(Hopeless::from_error)?;
    let Some(address) = address else { return Ok(()) };
    let mut pulse = Pulse::begin(hub, run.number, ServiceId::Dashboard, ["kalman-to-dashboard", "", ""])?;
    let scene = Scene::default();
    let mut feed = Feed::open(hub, run, folder, domain.name(), scene.clone())?;
    let errands = errands::start(domain.clone());
    let place = std::env::current_dir().context("the current folder")?;
    let names = folder.clone();
    let shop = |guard: Guard| Shop {
        home: server::DASHBOARD,
        scene: scene.clone(),
        guard: Arc::new(guard),
        errands: errands.clone(),
        folder: place.clone(),
        export: Arc::new({
            let names = names.clone();
            move |scene: &Scene, name: &str| export::export(scene, &names, name)
        }),
    };
    pulse.become_state(State::Running)?;
    let mut looks = 0;
    let mut serving = false;
    while !stop.asked() {
        if !serving && looks % LOOKS_PER_ATTEMPT == 0 {
            match address.listen(earlier_port(folder)) {
                Ok(listener) => {
                    serving = true;
                    serve(listener, folder, shop)?;
                }
                // Nobody else suffers from it; the place may become free.
                Err(error) if looks == 0 => {
                    eprintln!("truerate: dashboard {error}: choose another with --dashboard, or off");
                }
                Err(_) => {}
            }
        }
        looks += 1;
        feed.turn(&mut pulse)?;
        pulse.beat(u64::MAX)?;
        thread::sleep(LOOK);
    }
    Ok(())
}

/// The port of this run's earlier dashboard, so that open pages find the new one.
fn earlier_port(folder: &RunFolder) -> Option<u16> {
    let url = std::fs::read_to_string(folder.mark("dashboard.url")).ok()?;
    let authority = url.strip_prefix("http://")?.split('/').next()?;
    authority.rsplit(':').next()?.parse().ok()
}

fn serve(listener: TcpListener, folder: &RunFolder, shop: impl FnOnce(Guard) -> Shop) -> anyhow::Result<()> {
    let address = listener.local_addr().context("the dashboard's address")?;
    let kept = folder.mark("dashboard.token");
    // A dashboard that is started again keeps its token, so that open pages go on.
    let guard = Guard::of(address, std::fs::read_to_string(&kept).ok()).context("a token")?;
    write_for(For::Run, &kept, guard.token().as_bytes())?;
    write_for(For::Run, &folder.mark("dashboard.url"), guard.url().as_bytes())?;
    let elsewhere = if guard.is_everywhere() { " (from another machine: at this one's name)" } else { "" };
    eprintln!("dashboard: {}{elsewhere}", guard.url());
    let shop = shop(guard);
    thread::Builder::new()
        .name("server".into())
        .spawn(move || {
            if let Err(error) = server::serve(listener, shop) {
                // A process that watches and serves nobody is of no use: the supervisor starts a new one.
                eprintln!("truerate: dashboard {address}: {error}");
                std::process::exit(1);
            }
        })
        .context("the server's thread")?;
    Ok(())
}
