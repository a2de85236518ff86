//! A session of Zenoh, configured as rmw_zenoh's are.

use anyhow::{Result, anyhow};
use zenoh::{Config, Session, Wait};

/// How to reach ROS.
#[derive(clap::Args, Debug, Clone)]
pub struct Reach {
    /// ROS_DOMAIN_ID
    #[arg(long, env = "ROS_DOMAIN_ID", default_value_t = 0)]
    pub domain: u32,
    /// The Zenoh router of ROS (`ros2 run rmw_zenoh_cpp rmw_zenohd`), or another peer
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/localhost:7447")]
    pub connect: Vec<String>,
    /// Take connections here, too: no router is needed then
    #[arg(long, value_name = "ENDPOINT")]
    pub listen: Vec<String>,
}

/// Opens it. What `ZENOH_SESSION_CONFIG_URI` names is read first, as rmw_zenoh does.
pub fn open(reach: &Reach) -> Result<Session> {
    let failed = |error: zenoh::Error| anyhow!("{error}");
    let mut config = if let Some(path) = std::env::var_os("ZENOH_SESSION_CONFIG_URI") {
        Config::from_file(path).map_err(failed)?
    } else {
        let mut config = Config::default();
        config.insert_json5("mode", "\"peer\"").map_err(failed)?;
        config.insert_json5("scouting/multicast/enabled", "false").map_err(failed)?;
        config
    };
    let list =
        |ends: &[String]| format!("[{}]", ends.iter().map(|end| format!("{end:?}")).collect::<Vec<_>>().join(","));
    config.insert_json5("connect/endpoints", &list(&reach.connect)).map_err(failed)?;
    // A router that is not there yet is waited for.
    config.insert_json5("connect/exit_on_failure", "false").map_err(failed)?;
    if !reach.listen.is_empty() {
        config.insert_json5("listen/endpoints", &list(&reach.listen)).map_err(failed)?;
    }
    zenoh::open(config).wait().map_err(failed)
}
