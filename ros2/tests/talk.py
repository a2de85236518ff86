"""The other end of the topics, by programs that know nothing of truerate: eclipse-zenoh for Zenoh, rosbags for the messages.

    talk.py send LOG.csv LISTEN SPEED     an IMU and a pose, as rmw_zenoh puts them
    talk.py take CONNECT COUNT            what comes of /imu/compensated, a line of JSON a message, and then the graph's tokens
"""

import csv
import json
import sys
import time

import numpy
import zenoh
from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_JAZZY)
Time = types.types["builtin_interfaces/msg/Time"]
Header = types.types["std_msgs/msg/Header"]
Vector3 = types.types["geometry_msgs/msg/Vector3"]
Quaternion = types.types["geometry_msgs/msg/Quaternion"]
Imu = types.types["sensor_msgs/msg/Imu"]
Point = types.types["geometry_msgs/msg/Point"]
Pose = types.types["geometry_msgs/msg/Pose"]
PoseStamped = types.types["geometry_msgs/msg/PoseStamped"]
START = 1_790_000_000


def session(listen=None, connect=None):
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("scouting/multicast/enabled", "false")
    if listen:
        config.insert_json5("listen/endpoints", json.dumps([listen]))
    if connect:
        config.insert_json5("connect/endpoints", json.dumps([connect]))
    return zenoh.open(config)


def key(topic, kind):
    package, name = kind.split("/msg/")
    return f"0/{topic}/{package}::msg::dds_::{name}_/{types.hash_rihs01(kind)}"


def header(t):
    whole = int(t)
    return Header(stamp=Time(sec=START + whole, nanosec=round((t - whole) * 1e9)), frame_id="imu_link")


def put(publisher, message, kind):
    publisher.put(bytes(types.serialize_cdr(message, kind)))


def send(path, listen, speed):
    zeros = numpy.zeros(9)
    with session(listen=listen) as own, open(path, newline="") as file:
        imu = own.declare_publisher(key("imu/data_raw", "sensor_msgs/msg/Imu"))
        pose = own.declare_publisher(key("vicon/pose", "geometry_msgs/msg/PoseStamped"))
        while not (imu.matching_status.matching and pose.matching_status.matching):
            time.sleep(0.01)
        time.sleep(0.2)
        begun = time.monotonic()
        for row in csv.DictReader(file):
            t = float(row["t"])
            while time.monotonic() < begun + t / speed:
                time.sleep(0.0005)
            if row["ref_qw"]:
                turned = Quaternion(**{a: float(row["ref_q" + a]) for a in "xyzw"})
                put(pose, PoseStamped(header(t), Pose(Point(0.0, 0.0, 0.0), turned)), "geometry_msgs/msg/PoseStamped")
            rate = Vector3(**{a: float(row["gyro_" + a]) for a in "xyz"})
            force = Vector3(**{a: float(row["accel_" + a]) for a in "xyz"})
            own_guess = Quaternion(0.0, 0.0, 0.0, 1.0)
            put(imu, Imu(header(t), own_guess, zeros, rate, zeros, force, zeros), "sensor_msgs/msg/Imu")
        time.sleep(1.0)


def attached(bytes_):
    """Zenoh's serialization: a text and bytes with their length before them."""
    at, found = 0, {}
    for _ in range(3):
        length = bytes_[at]
        name = bytes_[at + 1 : at + 1 + length].decode()
        at += 1 + length
        if name == "source_gid":
            found[name] = bytes_[at + 1 : at + 1 + bytes_[at]].hex()
        else:
            found[name] = int.from_bytes(bytes_[at : at + 8], "little", signed=True)
            at += 8
    return found


def take(connect, count):
    with session(connect=connect) as own:
        came = own.declare_subscriber(key("imu/compensated", "sensor_msgs/msg/Imu"))
        for _ in range(count):
            sample = came.recv()
            message = types.deserialize_cdr(bytes(sample.payload), "sensor_msgs/msg/Imu")
            line = {
                "stamp": message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec,
                "frame": message.header.frame_id,
                "rate": [getattr(message.angular_velocity, a) for a in "xyz"],
                "variance": [float(message.angular_velocity_covariance[4 * k]) for k in range(3)],
                "orientation": float(message.orientation_covariance[0]),
                "now": time.time(),
                **attached(bytes(sample.attachment)),
            }
            print(json.dumps(line), flush=True)
        tokens = [str(reply.ok.key_expr) for reply in own.liveliness().get("@ros2_lv/**") if reply.ok]
        print(json.dumps(sorted(tokens)), flush=True)


if sys.argv[1] == "send":
    send(sys.argv[2], sys.argv[3], float(sys.argv[4]))
else:
    take(sys.argv[2], int(sys.argv[3]))
