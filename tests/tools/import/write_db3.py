#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a small bag of ROS 2 as rosbag2 stores it in SQLite (CDR messages), by Python's sqlite3.

usage: write_db3.py OUT.db3 [--sql TEXT] [--from N] [--to N] [--packed]

The topics of write_mcap.py. --sql is run at the end; --from and --to choose images, for a bag in several files.
--packed: each message by zstd, as compression_mode message makes them.
"""

import argparse
import os
import sqlite3
import subprocess

from write_mcap import SECONDS, camera_info, image, imu, odometry


def packed(data):
    """One zstd frame that names its size."""
    return subprocess.run(["zstd", "-q", "-c", f"--stream-size={len(data)}"], input=data, capture_output=True,
                          check=True).stdout


def new_bag(path, topics):
    """An open database of rosbag2's tables with the topics (name, type, encoding), numbered from 1."""
    if os.path.exists(path):
        os.remove(path)
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                     "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
    database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
                     "data BLOB NOT NULL)")
    database.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    for number, (name, kind, encoding) in enumerate(topics, 1):
        database.execute("INSERT INTO topics VALUES (?, ?, ?, ?, '')", (number, name, kind, encoding))
    return database


def put(database, topic, nanoseconds, data):
    database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", (topic, nanoseconds, data))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("--sql", default="")
    parser.add_argument("--from", dest="first", type=int, default=0)
    parser.add_argument("--to", type=int, default=3)
    parser.add_argument("--packed", action="store_true")
    options = parser.parse_args()

    topics = [("/cam0/image_raw", "sensor_msgs/msg/Image", "cdr"), ("/imu", "sensor_msgs/msg/Imu", "cdr"),
              ("/odom", "nav_msgs/msg/Odometry", "cdr"), ("/cam0/camera_info", "sensor_msgs/msg/CameraInfo", "cdr"),
              ("/notes", "sensor_msgs/msg/Image", "json")]
    database = new_bag(options.out, topics)

    def add(topic, nanoseconds, data):
        put(database, topic, SECONDS * 10**9 + nanoseconds, packed(data) if options.packed else data)

    add(4, 0, camera_info())
    add(5, 0, b"{}")
    for i in range(10):
        add(2, 10_000_000 * i + 5, imu(i, 10_000_000 * i))
    for i in range(4):
        add(3, 30_000_000 * i + 5, odometry(i, 30_000_000 * i))
    for i in range(options.first, options.to):
        add(1, 50_000_000 * i + 1_000_000, image(i, 50_000_000 * i))
    database.executescript(options.sql)
    database.commit()
    database.close()


if __name__ == "__main__":
    main()
