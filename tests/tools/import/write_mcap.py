#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a small MCAP recording as ROS 2 does (CDR messages) by the format's description, standard library only.

usage: write_mcap.py OUT.mcap [--compression NAME] [--chunks] [--open]

Images /cam0/image_raw (64x48, 3 of them, 50 ms apart), camera_info, /imu (10), /odom (4), and a topic of JSON.
"""

import argparse
import struct

SECONDS = 1_600_000_000


class Cdr:
    """Fields of one message, aligned to their size from the end of the encapsulation on."""

    def __init__(self):
        self.data = b""

    def pack(self, kind, *values):
        size = struct.calcsize("<" + kind)
        for value in values:
            self.data += b"\xdd" * (-len(self.data) % size) + struct.pack("<" + kind, value)
        return self

    def text(self, value):
        self.pack("I", len(value) + 1)
        self.data += value.encode() + b"\0"
        return self

    def header(self, nanoseconds, frame):
        return self.pack("i", SECONDS + nanoseconds // 10**9).pack("I", nanoseconds % 10**9).text(frame)

    def bytes(self):
        return b"\0\1\0\0" + self.data


def image(number, nanoseconds):
    pixels = bytes((x + y + number) % 256 for y in range(48) for x in range(64))
    cdr = Cdr().header(nanoseconds, "cam0").pack("I", 48, 64).text("mono8").pack("B", 0).pack("I", 64, len(pixels))
    cdr.data += pixels
    return cdr.bytes()


def camera_info():
    k = [50.0, 0, 31, 0, 51, 23, 0, 0, 1]
    return (Cdr().header(0, "cam0").pack("I", 48, 64).text("plumb_bob").pack("I", 5).pack("d", -0.1, 0.01, 0.002, -0.003, 0.0004)
            .pack("d", *k).pack("d", 1, 0, 0, 0, 1, 0, 0, 0, 1).pack("d", 70, 0, 32, 0, 0, 71, 24, 0, 0, 0, 1, 0).pack("I", 0, 0)
            .pack("I", 0, 0, 0, 0).pack("B", 0).bytes())


def imu(number, nanoseconds):
    return (Cdr().header(nanoseconds, "imu").pack("d", 0, 0, 0, 1, *[0] * 9).pack("d", 0.1, 0.2, number, *[0] * 9)
            .pack("d", 0, 0, 9.81, *[0] * 9).bytes())


def odometry(number, nanoseconds):
    return (Cdr().header(nanoseconds, "odom").text("base_link").pack("d", 1, 2, 3, 0, 0, 0, 1, *[0] * 36)
            .pack("d", 1.5 + number, 0, 0, 0, 0, 0.25, *[0] * 36).bytes())


def record(kind, data):
    return struct.pack("<BQ", kind, len(data)) + data


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def channel(number, topic, kind, encoding="cdr"):
    definition = b"uint32 x"
    schema = struct.pack("<H", number + 1) + text(kind) + text("ros2msg") + struct.pack("<I", len(definition)) + definition
    return (record(3, schema) +
            record(4, struct.pack("<HH", number, number + 1) + text(topic) + text(encoding) + struct.pack("<I", 0)))


def message(number, nanoseconds, data):
    when = SECONDS * 10**9 + nanoseconds
    return record(5, struct.pack("<HIQQ", number, 0, when, when) + data)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("--compression", default="")
    parser.add_argument("--chunks", action="store_true")
    parser.add_argument("--open", action="store_true", help="as a recorder that was killed leaves it")
    options = parser.parse_args()

    topics = [("/cam0/image_raw", "sensor_msgs/msg/Image"), ("/imu", "sensor_msgs/msg/Imu"),
              ("/odom", "nav_msgs/msg/Odometry"), ("/cam0/camera_info", "sensor_msgs/msg/CameraInfo")]
    channels = b"".join(channel(i, topic, kind) for i, (topic, kind) in enumerate(topics))
    channels += channel(9, "/notes", "sensor_msgs/msg/Image", "json")
    records = channels + message(3, 0, camera_info()) + message(9, 0, b"{}")
    records += b"".join(message(1, 10_000_000 * i + 5, imu(i, 10_000_000 * i)) for i in range(10))
    records += b"".join(message(2, 30_000_000 * i + 5, odometry(i, 30_000_000 * i)) for i in range(4))
    records += b"".join(message(0, 50_000_000 * i + 1_000_000, image(i, 50_000_000 * i)) for i in range(3))
    if options.chunks or options.compression:
        records = record(6, struct.pack("<QQQI", 0, 0, len(records), 0) + text(options.compression) +
                         struct.pack("<Q", len(records)) + records)
    body = b"\x89MCAP0\r\n" + record(1, text("ros2") + text("by hand")) + records
    if not options.open:
        body += record(15, struct.pack("<I", 0)) + channels + record(2, struct.pack("<QQI", 0, 0, 0)) + b"\x89MCAP0\r\n"
    with open(options.out, "wb") as file:
        file.write(body)


if __name__ == "__main__":
    main()
