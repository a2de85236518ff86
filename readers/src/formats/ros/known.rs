//! Definitions of the messages that a gyro's recordings are made of, for files that leave them out, as `.db3` did before ROS 2 Iron.

const HEADER: &str = "std_msgs/Header header\n";

/// A kind of message, whether a header begins it, and its fields.
const KNOWN: &[(&str, bool, &str)] = &[
    ("builtin_interfaces/Time", false, "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/Duration", false, "int32 sec\nuint32 nanosec"),
    ("std_msgs/Header", false, "builtin_interfaces/Time stamp\nstring frame_id"),
    ("geometry_msgs/Vector3", false, "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Point", false, "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Quaternion", false, "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"),
    ("geometry_msgs/Pose", false, "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"),
    ("geometry_msgs/Twist", false, "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular"),
    ("geometry_msgs/Transform", false, "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"),
    ("geometry_msgs/PoseWithCovariance", false, "geometry_msgs/Pose pose\nfloat64[36] covariance"),
    ("geometry_msgs/TwistWithCovariance", false, "geometry_msgs/Twist twist\nfloat64[36] covariance"),
    (
        "sensor_msgs/Imu",
        true,
        "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
         geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
         geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
    ),
    ("sensor_msgs/JointState", true, "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"),
    ("sensor_msgs/MagneticField", true, "geometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance"),
    ("sensor_msgs/Temperature", true, "float64 temperature\nfloat64 variance"),
    (
        "nav_msgs/Odometry",
        true,
        "string child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist",
    ),
    ("geometry_msgs/PoseStamped", true, "geometry_msgs/Pose pose"),
    ("geometry_msgs/PoseWithCovarianceStamped", true, "geometry_msgs/PoseWithCovariance pose"),
    ("geometry_msgs/QuaternionStamped", true, "geometry_msgs/Quaternion quaternion"),
    ("geometry_msgs/TransformStamped", true, "string child_frame_id\ngeometry_msgs/Transform transform"),
    ("geometry_msgs/TwistStamped", true, "geometry_msgs/Twist twist"),
    ("geometry_msgs/TwistWithCovarianceStamped", true, "geometry_msgs/TwistWithCovariance twist"),
    ("geometry_msgs/Vector3Stamped", true, "geometry_msgs/Vector3 vector"),
    ("tf2_msgs/TFMessage", false, "geometry_msgs/TransformStamped[] transforms"),
    ("std_msgs/Float64", false, "float64 data"),
    ("std_msgs/Float32", false, "float32 data"),
];

/// The definition of a kind of message that needs none beside it.
#[must_use]
pub fn definition(kind: &str) -> Option<String> {
    let (_, headed, fields) = KNOWN.iter().find(|(known, ..)| *known == kind)?;
    Some(if *headed { format!("{HEADER}{fields}") } else { (*fields).to_owned() })
}
