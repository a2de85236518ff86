//! A map for a file of topics: what the kinds of messages that people log hold.

use super::{AXES, Dependent, PARTS, Pick, Proposal, Second, of_names};
use crate::{
    can,
    format::ROW,
    survey::Surveyed,
    unit::{Quantity, Unit},
};

/// What a group of fields is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Base {
    Rate,
    Acceleration,
    Orientation,
    Temperature,
}

/// Whose it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The sensor's own reading.
    Sensor,
    /// Measured by something else.
    Reference,
    /// By something else, where the topic's name says so.
    Asked,
    /// Computed from the gyro of this file.
    Computed(&'static str),
}

/// Fields of a kind of message; `#` counts from 0, `@` is a letter of an axis, `^` the same in capitals.
struct Rule {
    kind: &'static str,
    fields: &'static str,
    base: Base,
    role: Role,
}

const fn rule(kind: &'static str, fields: &'static str, base: Base, role: Role) -> Rule {
    Rule { kind, fields, base, role }
}

/// PX4's message with the readings of whichever sensor it selects.
const COMBINED: &str = "sensor_combined";

const PX4: Role = Role::Computed("the autopilot's estimator");
const ARDUPILOT: Role = Role::Computed("the autopilot's filter");
const IMU: Role = Role::Computed("the filter that fills this message");

/// The best of a base and role first.
const RULES: &[Rule] = &[
    rule(COMBINED, "gyro_rad[#]", Base::Rate, Role::Sensor),
    rule("sensor_gyro", "@", Base::Rate, Role::Sensor),
    rule(COMBINED, "accelerometer_m_s2[#]", Base::Acceleration, Role::Sensor),
    rule("sensor_accel", "@", Base::Acceleration, Role::Sensor),
    rule("sensor_gyro", "temperature", Base::Temperature, Role::Sensor),
    rule("vehicle_attitude_groundtruth", "q[#]", Base::Orientation, Role::Reference),
    rule("vehicle_mocap_odometry", "q[#]", Base::Orientation, Role::Reference),
    rule("vehicle_visual_odometry", "q[#]", Base::Orientation, Role::Reference),
    rule("vehicle_vision_attitude", "q[#]", Base::Orientation, Role::Reference),
    rule("vehicle_angular_velocity_groundtruth", "xyz[#]", Base::Rate, Role::Reference),
    rule("vehicle_attitude", "q[#]", Base::Orientation, PX4),
    rule("estimator_attitude", "q[#]", Base::Orientation, PX4),
    rule("vehicle_odometry", "q[#]", Base::Orientation, PX4),
    rule("vehicle_angular_velocity", "xyz[#]", Base::Rate, PX4),
    rule("IMU", "Gyr^", Base::Rate, Role::Sensor),
    rule("IMU2", "Gyr^", Base::Rate, Role::Sensor),
    rule("IMU3", "Gyr^", Base::Rate, Role::Sensor),
    rule("IMU", "Acc^", Base::Acceleration, Role::Sensor),
    rule("IMU", "T", Base::Temperature, Role::Sensor),
    rule("IMU", "Temp", Base::Temperature, Role::Sensor),
    rule("SIM", "Q", Base::Orientation, Role::Reference),
    rule("XKQ", "Q", Base::Orientation, ARDUPILOT),
    rule("NKQ", "Q", Base::Orientation, ARDUPILOT),
    rule("NKQ1", "Q", Base::Orientation, ARDUPILOT),
    rule("AHR2", "Q", Base::Orientation, ARDUPILOT),
    rule("sensor_msgs/Imu", "angular_velocity.@", Base::Rate, Role::Sensor),
    rule("sensor_msgs/Imu", "linear_acceleration.@", Base::Acceleration, Role::Sensor),
    rule("sensor_msgs/Temperature", "temperature", Base::Temperature, Role::Sensor),
    rule("geometry_msgs/PoseStamped", "pose.orientation.@", Base::Orientation, Role::Asked),
    rule("geometry_msgs/PoseWithCovarianceStamped", "pose.pose.orientation.@", Base::Orientation, Role::Asked),
    rule("geometry_msgs/TransformStamped", "transform.rotation.@", Base::Orientation, Role::Asked),
    rule("tf2_msgs/TFMessage", "transform.rotation.@", Base::Orientation, Role::Asked),
    rule("geometry_msgs/QuaternionStamped", "quaternion.@", Base::Orientation, Role::Asked),
    rule("nav_msgs/Odometry", "pose.pose.orientation.@", Base::Orientation, Role::Asked),
    rule("geometry_msgs/Vector3Stamped", "vector.@", Base::Rate, Role::Asked),
    rule("geometry_msgs/TwistStamped", "twist.angular.@", Base::Rate, Role::Asked),
    rule("sensor_msgs/Imu", "orientation.@", Base::Orientation, IMU),
];

/// Words in the name of a topic that something else than a gyro's filter fills.
const MEASURED: &[&str] = &[
    "mocap",
    "vicon",
    "optitrack",
    "qualisys",
    "natnet",
    "vrpn",
    "truth",
    "ground",
    "groundtruth",
    "gt",
    "ref",
    "reference",
    "turntable",
    "encoder",
    "leica",
    "vive",
    "lighthouse",
    "apriltag",
    "aruco",
];

/// A group of fields that is there.
struct Found {
    base: Base,
    role: Role,
    topic: usize,
    channels: Vec<String>,
}

/// What the topics of a file say. `taken` tells the names of our logs that are mapped already, and `mapped` to what.
#[must_use]
pub fn of_topics(topics: &[Surveyed], taken: &dyn Fn(&str) -> bool, mapped: &[Pick]) -> Proposal {
    if topics.iter().all(|of| [can::KIND, ROW].contains(&of.topic.kind.as_str())) {
        // Who made the DBC file gave the names: they are understood as a table's are.
        let fields =
            topics.iter().flat_map(|of| of.topic.fields.iter().map(|field| (of.topic.channel(field), field.unit)));
        let mut proposal = of_names(&fields.collect::<Vec<_>>(), taken);
        let has_gyro = |pick: &Pick| pick.name.starts_with("gyro_");
        if !AXES.iter().any(|axis| taken(&format!("gyro_{axis}"))) && !proposal.chosen.iter().any(has_gyro) {
            proposal.offered.extend(rates_of_turn(topics));
        }
        return proposal;
    }
    let found: Vec<Found> =
        RULES.iter().flat_map(|rule| topics.iter().enumerate().filter_map(move |(i, of)| find(rule, i, of))).collect();
    let mut proposal = Proposal::default();
    for of in &found {
        if let Role::Computed(by) = of.role {
            proposal.dependent.extend(of.channels.iter().map(|channel| Dependent { channel: channel.clone(), by }));
        }
    }
    let all =
        |base, is: &dyn Fn(&Found) -> bool| found.iter().filter(|of| of.base == base && is(of)).collect::<Vec<_>>();
    let is_sensor = |of: &Found| of.role == Role::Sensor;
    let measured = |of: &Found| of.role == Role::Reference || of.role == Role::Asked && is_measured(&topics[of.topic]);
    let mut reference: Vec<Vec<Pick>> = Vec::new();
    reference.extend(all(Base::Orientation, &measured).into_iter().map(orientation));
    reference.extend(all(Base::Rate, &measured).into_iter().map(|of| axes("ref_rate", of)));
    let sensors = all(Base::Rate, &is_sensor);
    // Some logs keep a sensor's own topic at a rate that tells nothing.
    let messages = |of: &Found| topics[of.topic].messages;
    let most = sensors.iter().map(|of| messages(of)).max().unwrap_or(0);
    let fast: Vec<&Found> = sensors.iter().copied().filter(|of| 2 * messages(of) >= most).collect();
    let is_own = |of: &&&Found| topics[of.topic].topic.kind != COMBINED;
    let own: Vec<&Found> = fast.iter().filter(is_own).copied().collect();
    let best = if reference.is_empty() && own.len() > 1 { own.first() } else { fast.first() };
    let is_mapped = |of: &&Found| {
        let is_gyro = |pick: &Pick| pick.name.starts_with("gyro_") && of.channels.contains(&pick.channel);
        mapped.iter().any(is_gyro)
    };
    let has_gyro = AXES.iter().any(|axis| taken(&format!("gyro_{axis}")));
    let meant = sensors.iter().copied().find(is_mapped);
    let gyro = best.copied().filter(|_| !has_gyro);
    proposal.chosen.extend(gyro.map(|of| axes("gyro", of)).unwrap_or_default());
    if reference.is_empty() {
        let gyro = meant.or(gyro);
        let mut seconds: Vec<Second> = (sensors.iter().filter(is_own))
            .filter(|of| gyro.is_none_or(|gyro| !is_one_sensor(topics, gyro.topic, of.topic)))
            .map(|of| {
                let (topic, rate_hz) = (topics[of.topic].topic.name.clone(), topics[of.topic].rate_hz());
                Second { topic, rate_hz: rate_hz.unwrap_or(f64::NAN), picks: axes("ref_rate", of) }
            })
            .collect();
        if let Some(first) = seconds.iter().position(Second::serves) {
            reference.push(seconds.remove(first).picks);
        }
        proposal.seconds = seconds;
    }
    if reference.is_empty() {
        let computed = all(Base::Orientation, &|of| matches!(of.role, Role::Computed(_)));
        // Of the gyro's own message, of which one may be empty, before others.
        reference.extend(computed.into_iter().filter(|of| !is_empty(&topics[of.topic], of)).map(orientation));
    }
    let near = |base| {
        let of = all(base, &is_sensor);
        let own = of.iter().position(|of| gyro.is_some_and(|gyro| gyro.topic == of.topic)).unwrap_or(0);
        of.get(own).copied()
    };
    if !taken("accel_x") {
        proposal.chosen.extend(near(Base::Acceleration).map(|of| axes("accel", of)).unwrap_or_default());
    }
    if let Some(of) = near(Base::Temperature).filter(|_| !taken("temp")) {
        proposal.chosen.push(Pick::new("temp", &of.channels[0], None));
    }
    let has_reference = taken("ref_qw")
        || AXES.iter().any(|axis| taken(&format!("ref_angle_{axis}")) || taken(&format!("ref_rate_{axis}")));
    if let Some(best) = reference.into_iter().next().filter(|_| !has_reference) {
        proposal.chosen.extend(best);
    }
    for of in all(Base::Orientation, &|of| of.role == Role::Asked && !is_measured(&topics[of.topic])) {
        proposal.offered.extend(orientation(of));
    }
    for of in all(Base::Rate, &|of| of.role == Role::Asked && !is_measured(&topics[of.topic])) {
        proposal.offered.extend(axes("ref_rate", of));
    }
    proposal
}

/// Signals whose names say nothing, but whose unit is that of a rate of turn, and that change: a vehicle's is its yaw rate.
fn rates_of_turn(topics: &[Surveyed]) -> Vec<Pick> {
    let fields = topics.iter().flat_map(|of| of.topic.fields.iter().zip(&of.fields).map(move |pair| (of, pair)));
    let is_rate = |unit: &Unit| unit.quantity == Quantity::Rate;
    fields
        .filter(|(_, (field, range))| field.unit.as_ref().is_some_and(is_rate) && range.low < range.high)
        .map(|(of, (field, _))| Pick::new("gyro_z", &of.topic.channel(field), None))
        .collect()
}

/// Whether two topics hold readings of one sensor: the same one, or that from which PX4 fills the other.
fn is_one_sensor(topics: &[Surveyed], gyro: usize, other: usize) -> bool {
    if gyro == other {
        return true;
    }
    if topics[gyro].topic.kind != COMBINED {
        return false;
    }
    let field = |of: &Surveyed, name: &str| {
        let of = of.topic.fields.iter().zip(&of.fields).find(|(field, _)| field.name == name);
        of.map(|(_, range)| *range).filter(|range| range.values > 0)
    };
    let mut selection = topics.iter().filter(|of| of.topic.kind == "sensor_selection");
    let selected = selection.find_map(|of| field(of, "gyro_device_id"));
    match (selected, field(&topics[other], "device_id")) {
        // One or two were selected in the course of the log.
        (Some(selected), Some(own)) => [selected.low, selected.high].contains(&own.low),
        // The first one, unless something says otherwise.
        _ => topics.iter().position(|of| of.topic.kind == topics[other].topic.kind) == Some(other),
    }
}

/// The fields of a rule in a topic that has messages.
fn find(rule: &Rule, topic: usize, of: &Surveyed) -> Option<Found> {
    if bare(&of.topic.kind) != rule.kind || of.messages == 0 {
        return None;
    }
    let names: Vec<String> = match rule.base {
        Base::Temperature => vec![rule.fields.to_owned()],
        Base::Orientation if rule.fields == "Q" => (1..5).map(|i| format!("Q{i}")).collect(),
        Base::Orientation => PARTS.iter().enumerate().map(|(i, part)| filled(rule.fields, i, part)).collect(),
        _ => AXES.iter().enumerate().map(|(i, axis)| filled(rule.fields, i, axis)).collect(),
    };
    let channels: Option<Vec<String>> = names
        .iter()
        .map(|name| of.topic.fields.iter().find(|field| field.name == *name).map(|field| of.topic.channel(field)))
        .collect();
    channels.map(|channels| Found { base: rule.base, role: rule.role, topic, channels })
}

/// ROS 2 says `sensor_msgs/msg/Imu` for what was `sensor_msgs/Imu`.
fn bare(kind: &str) -> String {
    kind.replacen("/msg/", "/", 1)
}

fn filled(fields: &str, number: usize, letter: &str) -> String {
    fields.replace('#', &number.to_string()).replace('@', letter).replace('^', &letter.to_uppercase())
}

fn is_measured(of: &Surveyed) -> bool {
    of.topic.name.to_lowercase().split(|c: char| !c.is_alphanumeric()).any(|word| MEASURED.contains(&word))
}

/// Whether an orientation is all zero: a message that has no filter behind it.
fn is_empty(of: &Surveyed, found: &Found) -> bool {
    let fields = of.topic.fields.iter().zip(&of.fields);
    let own = fields.filter(|(field, _)| found.channels.contains(&of.topic.channel(field)));
    own.into_iter().all(|(_, range)| range.values == 0 || range.low == range.high)
}

fn axes(base: &str, of: &Found) -> Vec<Pick> {
    AXES.iter().zip(&of.channels).map(|(axis, channel)| Pick::new(&format!("{base}_{axis}"), channel, None)).collect()
}

fn orientation(of: &Found) -> Vec<Pick> {
    PARTS.iter().zip(&of.channels).map(|(part, channel)| Pick::new(&format!("ref_q{part}"), channel, None)).collect()
}
