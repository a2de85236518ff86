"""Sends rows "time_us gyro_x gyro_y gyro_z ref_w ref_z" of standard input as MAVLink to HOST:PORT, as an autopilot does:
among other messages, every tenth message of the sensor garbled. Its own attitude, which is wrong, is no reference."""

import os
import socket
import sys
import time

place, version = sys.argv[1:3]
if version == "2.0":
    os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

host, port = place.rsplit(":", 1)
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
dialect = mavutil.mavlink
sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)


def packed(message):
    return message.pack(sender)


def give(data):
    link.sendto(data, (host, int(port)))


start = time.monotonic()
for k, line in enumerate(sys.stdin):
    t, x, y, z, qw, qz = (float(word) for word in line.split())
    sender.seq = (sender.seq + 1) % 256
    give(packed(dialect.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)))
    give(packed(dialect.MAVLink_attitude_quaternion_message(int(t / 1000), 0.7, 0.7, 0.0, 0.0, 0.0, 0.0, 0.0)))
    if version == "2.0":
        cov = [float("nan")] * 21
        reference = dialect.MAVLink_odometry_message(
            int(t), 20, 12, 0, 0, 0, [qw, 0.0, 0.0, qz], 0, 0, 0, 0, 0, 0, cov, cov, 0, 6, 100
        )
        wrong = dialect.MAVLink_odometry_message(
            int(t), 1, 12, 0, 0, 0, [0.7, 0.7, 0.0, 0.0], 0, 0, 0, 0, 0, 0, cov, cov, 0, 8, 100
        )
        give(packed(reference) + packed(wrong))
    imu = dialect.MAVLink_highres_imu_message(int(t), 0, 0, -9.8, x, y, z, 0, 0, 0, 0, 0, 0, 24.0, 0x103F)
    data = bytearray(packed(imu))
    if k % 10 == 5:
        data[20] ^= 0xFF
    give(bytes(data))
    rest = start + k * 0.001 - time.monotonic()
    if rest > 0:
        time.sleep(rest)
