//! Names as rmw_zenoh lays them out: where a topic's messages are, and what tells the ROS graph that somebody sends or takes them.
//!
//! Source: rmw_zenoh, docs/design.md.

/// A kind of message that is sent.
pub struct Kind {
    /// As in `ros2 topic list -t`, with `msg` left out.
    pub name: &'static str,
    /// Its type's hash, REP 2011.
    pub hash: &'static str,
}

/// `sensor_msgs/msg/Imu`, the same in every ROS 2 since Iron.
pub const IMU: Kind =
    Kind { name: "sensor_msgs/Imu", hash: "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b" };

/// Best effort, nothing kept, the last five: what ROS calls sensor data.
const SENSOR_DATA: &str = "2:2:1,5:,:,:,,";

/// `sensor_msgs/Imu` as `sensor_msgs::msg::dds_::Imu_`.
fn wire_name(kind: &str) -> String {
    kind.replacen('/', "::msg::dds_::", 1) + "_"
}

/// `sensor_msgs::msg::dds_::Imu_` as `sensor_msgs/Imu`.
pub fn kind_of(wire: &str) -> Option<String> {
    let (package, name) = wire.split_once("::msg::dds_::")?;
    Some(format!("{package}/{}", name.strip_suffix('_')?))
}

/// Where every message of a topic is, whatever its kind.
pub fn any_kind(domain: u32, topic: &str) -> String {
    format!("{domain}/{}/*/*", topic.trim_matches('/'))
}

/// Where messages of this kind are put.
pub fn topic(domain: u32, topic: &str, kind: &Kind) -> String {
    format!("{domain}/{}/{}/{}", topic.trim_matches('/'), wire_name(kind.name), kind.hash)
}

/// The kind of a message that came by this key: the part before the last.
pub fn kind_in(key: &str) -> Option<String> {
    kind_of(key.rsplit('/').nth(1)?)
}

/// The token that tells the graph of our node.
pub fn node_token(domain: u32, session: &str) -> String {
    format!("@ros2_lv/{domain}/{session}/0/0/NN/%/%/{NODE}")
}

/// The token that tells the graph that our node sends to a topic.
pub fn publisher_token(domain: u32, session: &str, topic: &str, kind: &Kind) -> String {
    let topic = format!("/{}", topic.trim_matches('/')).replace('/', "%");
    let (kind, hash) = (wire_name(kind.name), kind.hash);
    format!("@ros2_lv/{domain}/{session}/0/1/MP/%/%/{NODE}/{topic}/{kind}/{hash}/{SENSOR_DATA}")
}

const NODE: &str = "truerate";

/// What rmw_zenoh wants beside each message: its number, when it was sent, and by whom; in Zenoh's serialization, where a text and bytes
/// have their length before them.
pub fn attachment(number: i64, sent_ns: i64, sender: [u8; 16]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(80);
    let text = |bytes: &mut Vec<u8>, text: &str| {
        bytes.push(text.len() as u8);
        bytes.extend(text.as_bytes());
    };
    text(&mut bytes, "sequence_number");
    bytes.extend(number.to_le_bytes());
    text(&mut bytes, "source_timestamp");
    bytes.extend(sent_ns.to_le_bytes());
    text(&mut bytes, "source_gid");
    bytes.push(16);
    bytes.extend(sender);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_lies_where_ros_looks_for_it() {
        let key = topic(0, "/vehicle/imu", &IMU);
        assert_eq!(key, format!("0/vehicle/imu/sensor_msgs::msg::dds_::Imu_/{}", IMU.hash));
        assert_eq!(kind_in(&key).as_deref(), Some("sensor_msgs/Imu"));
        assert_eq!(kind_in("0/imu/nonsense/x"), None);
        assert_eq!(any_kind(3, "/vehicle/imu"), "3/vehicle/imu/*/*");
    }
}
