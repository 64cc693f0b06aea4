#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a small ROS 1 bag (format 2.0, one chunk, with index) by the format's description, standard library only.

usage: write_bag.py OUT.bag [--compression NAME] [--unindexed] [--no-info] [--encoding NAME] [--second-camera] ...

Images /cam0/image_raw (64x48, 3 of them, 50 ms apart), /cam0/image_raw/compressed where --jpeg FILE is given, camera_info,
/imu (10), /odom (4) and a topic of another type. Compression by Python's bz2 and the program lz4.
"""

import argparse
import bz2
import struct
import subprocess

SECONDS = 1_600_000_000


def record(header, data):
    packed = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in header.items())
    return struct.pack("<I", len(packed)) + packed + struct.pack("<I", len(data)) + data


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def stamp(nanoseconds):
    return struct.pack("<II", SECONDS + nanoseconds // 10**9, nanoseconds % 10**9)


def header(sequence, nanoseconds, frame="cam0"):
    return struct.pack("<I", sequence) + stamp(nanoseconds) + text(frame)


def pixel(x, y, shade):
    return (x + y + shade) % 256


def image(sequence, nanoseconds, encoding):
    rows = []
    for y in range(48):
        grey = [pixel(x, y, sequence) for x in range(64)]
        row = {"mono8": bytes(grey),
               "rgb8": bytes(v for g in grey for v in (g, 0, 0)),
               "bgr8": bytes(v for g in grey for v in (g, 0, 0)),
               "yuv422": bytes(v for g in grey for v in (128, g))}.get(encoding, bytes(grey))
        rows.append(row + b"\xee" * 4)  # rows are padded
    data = b"".join(rows)
    return (header(sequence, nanoseconds) + struct.pack("<II", 48, 64) + text(encoding) + b"\0" +
            struct.pack("<I", len(rows[0])) + struct.pack("<I", len(data)) + data)


def camera_info(model="plumb_bob", r=(1, 0, 0, 0, 1, 0, 0, 0, 1), baseline=0.0):
    numbers = [50.0, 0, 31, 0, 51, 23, 0, 0, 1]
    return (header(0, 0) + struct.pack("<II", 48, 64) + text(model) + struct.pack("<I", 5) +
            struct.pack("<5d", -0.1, 0.01, 0.002, -0.003, 0.0004) + struct.pack("<9d", *numbers) +
            struct.pack("<9d", *r) + struct.pack("<12d", 70, 0, 32, -70 * baseline, 0, 71, 24, 0, 0, 0, 1, 0) +
            struct.pack("<II", 0, 0) + struct.pack("<IIIIB", 0, 0, 0, 0, 0))


def imu(sequence, nanoseconds):
    return (header(sequence, nanoseconds, "imu") + struct.pack("<4d", 0, 0, 0, 1) + struct.pack("<9d", *[0] * 9) +
            struct.pack("<3d", 0.1, 0.2, sequence) + struct.pack("<9d", *[0] * 9) + struct.pack("<3d", 0, 0, 9.81) +
            struct.pack("<9d", *[0] * 9))


def odometry(sequence, nanoseconds):
    return (header(sequence, nanoseconds, "odom") + text("base_link") + struct.pack("<7d", 1, 2, 3, 0, 0, 0, 1) +
            struct.pack("<36d", *[0] * 36) + struct.pack("<6d", 1.5 + sequence, 0, 0, 0, 0, 0.25) +
            struct.pack("<36d", *[0] * 36))


def pose(sequence, nanoseconds):
    """geometry_msgs/PoseStamped: half a turn about z."""
    return header(sequence, nanoseconds, "map") + struct.pack("<7d", 1 + sequence, 2, 3, 0, 0, 1, 0)


def transform(sequence, nanoseconds):
    return header(sequence, nanoseconds, "map") + text("body") + struct.pack("<7d", 1 + sequence, 2, 3, 0, 0, 1, 0)


def point(sequence, nanoseconds):
    return header(sequence, nanoseconds, "map") + struct.pack("<3d", 1 + sequence, 2, 3)


def twist(sequence, nanoseconds):
    return header(sequence, nanoseconds, "base") + struct.pack("<6d", 1.5 + sequence, 0, 0, 0, 0, 0.25)


def compressed(name, data):
    if name == "bz2":
        return bz2.compress(data)
    if name == "lz4":
        return subprocess.run(["lz4", "-q", "-c"], input=data, stdout=subprocess.PIPE, check=True).stdout
    return data


def chunk_record(options, data):
    size = len(data) if options.size is None else options.size
    return record({"op": b"\x05", "compression": options.compression.encode(), "size": struct.pack("<I", size)},
                  compressed(options.compression, data))


def connection(number, topic, kind):
    data = b"".join(struct.pack("<I", len(f)) + f for f in (
        b"topic=" + topic.encode(), b"type=" + kind.encode(), b"md5sum=" + b"0" * 32,
        b"message_definition=uint32 x\n"))
    return record({"op": b"\x07", "conn": struct.pack("<I", number), "topic": topic.encode()}, data)


def message(number, nanoseconds, data):
    return record({"op": b"\x02", "conn": struct.pack("<I", number), "time": stamp(nanoseconds)}, data)


def fields_of(piece):
    """Fields of a record's header."""
    size, at, fields = struct.unpack_from("<I", piece)[0], 4, {}
    while at < 4 + size:
        length = struct.unpack_from("<I", piece, at)[0]
        name, _, value = piece[at + 4:at + 4 + length].partition(b"=")
        fields[name], at = value, at + 4 + length
    return fields


def indexed_chunk(options, position, pieces):
    """A chunk of these records with its index behind it, and the record of it for the bag's end. position: in the bag."""
    entries, offset = {}, 0
    for piece in pieces:
        fields = fields_of(piece)
        if fields[b"op"] == b"\x02":
            entries.setdefault(fields[b"conn"], []).append((fields[b"time"], struct.pack("<I", offset)))
        offset += len(piece)
    times = sorted((struct.unpack("<II", time), time) for list_ in entries.values() for time, _ in list_) or [((0, 0), stamp(0))]
    body = chunk_record(options, b"".join(pieces))
    for conn, list_ in entries.items():
        body += record({"op": b"\x04", "ver": struct.pack("<I", 1), "conn": conn, "count": struct.pack("<I", len(list_))},
                       b"".join(time + offset for time, offset in list_))
    info = record({"op": b"\x06", "ver": struct.pack("<I", 1), "chunk_pos": struct.pack("<Q", position),
                   "start_time": times[0][1], "end_time": times[-1][1], "count": struct.pack("<I", len(entries))},
                  b"".join(conn + struct.pack("<I", len(list_)) for conn, list_ in entries.items()))
    return body, info


def bag_of(options, connections, messages):
    """All of a bag: connections and messages as records, in one chunk or one a message."""
    def head(index_pos, chunks):
        """4096 bytes, as ROS pads it."""
        fields = {"op": b"\x03", "index_pos": struct.pack("<Q", index_pos), "conn_count": struct.pack("<I", len(connections)),
                  "chunk_count": struct.pack("<I", chunks)}
        return b"#ROSBAG V2.0\n" + record(fields, b" " * (4096 - len(record(fields, b""))))

    chunks = [connections, *([m] for m in messages)] if options.split else [connections + messages]
    if options.unindexed:
        return head(0, len(chunks)) + b"".join(chunk_record(options, b"".join(pieces)) for pieces in chunks)
    body, infos = b"", b""
    for pieces in chunks:
        chunk, info = indexed_chunk(options, len(head(0, 0)) + len(body), pieces)
        body, infos = body + chunk, infos + info
    return head(len(head(0, 0)) + len(body), len(chunks)) + body + b"".join(connections) + infos


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("--compression", default="none")
    parser.add_argument("--encoding", default="mono8")
    parser.add_argument("--unindexed", action="store_true")
    parser.add_argument("--no-info", action="store_true")
    parser.add_argument("--second-camera", action="store_true")
    parser.add_argument("--jpeg")
    parser.add_argument("--image-name", default="/cam0/image_raw")
    parser.add_argument("--size", type=int, help="size that the chunks declare instead of their own")
    parser.add_argument("--split", action="store_true", help="a chunk for each message")
    parser.add_argument("--model", default="plumb_bob", help="distortion_model of camera_info")
    parser.add_argument("--two-types", help="a second type of the image topic, as text")
    parser.add_argument("--stereo", action="store_true", help="a pair with the right camera 0.12 m beside the left")
    parser.add_argument("--no-baseline", action="store_true", help="with --stereo: calibrated one by one")
    parser.add_argument("--late", type=int, default=2_000_000, help="with --stereo: ns after the left image")
    options = parser.parse_args()

    topics = [(options.image_name, "sensor_msgs/Image"), ("/imu", "sensor_msgs/Imu"), ("/odom", "nav_msgs/Odometry"),
              ("/chatter", "std_msgs/String")]
    if not options.no_info:
        topics.append(("/cam0/camera_info", "sensor_msgs/CameraInfo"))
    if options.jpeg:
        topics[0] = ("/cam0/image_raw/compressed", "sensor_msgs/CompressedImage")
    if options.second_camera or options.stereo:
        topics.append(("/cam1/image_raw", "sensor_msgs/Image"))
    if options.stereo:
        topics += [("/cam1/camera_info", "sensor_msgs/CameraInfo"), ("/pose", "geometry_msgs/PoseStamped"),
                   ("/transform", "geometry_msgs/TransformStamped"), ("/point", "geometry_msgs/PointStamped"),
                   ("/twist", "geometry_msgs/TwistWithCovarianceStamped")]
    if options.two_types:
        topics.append((options.image_name, options.two_types))
    number = {topic: i for i, (topic, _) in reversed(list(enumerate(topics)))}
    connections = [connection(i, topic, kind) for i, (topic, kind) in enumerate(topics)]

    messages = []
    if not options.no_info:
        messages.append(message(number["/cam0/camera_info"], 0, camera_info(options.model)))
    messages.append(message(number["/chatter"], 0, text("hello")))
    if options.two_types:
        messages.append(message(len(topics) - 1, 0, text("is no image")))
    for i in range(10):
        messages.append(message(number["/imu"], 10_000_000 * i + 5, imu(i, 10_000_000 * i)))
    for i in range(4):
        messages.append(message(number["/odom"], 30_000_000 * i + 5, odometry(i, 30_000_000 * i)))
    for i in range(3):
        when = 50_000_000 * i
        if options.jpeg:
            with open(options.jpeg, "rb") as file:
                content = file.read()
            data = header(i, when) + text("jpeg") + struct.pack("<I", len(content)) + content
        else:
            data = image(i, when, options.encoding)
        messages.append(message(0, when + 1_000_000, data))
    if options.second_camera:
        messages.append(message(number["/cam1/image_raw"], 0, image(0, 0, "mono8")))
    if options.stereo:
        # Turned by 90 degrees about the optical axis, so that order and direction of the turns count.
        info = camera_info(r=(0, -1, 0, 1, 0, 0, 0, 0, 1), baseline=0.0 if options.no_baseline else 0.12)
        messages.append(message(number["/cam1/camera_info"], 0, info))
        for i in range(3):
            when = 50_000_000 * i + options.late
            messages.append(message(number["/cam1/image_raw"], when, image(40 + i, when, "mono8")))
            for name, pack in (("/pose", pose), ("/transform", transform), ("/point", point), ("/twist", twist)):
                messages.append(message(number[name], when, pack(i, when)))

    with open(options.out, "wb") as file:
        file.write(bag_of(options, connections, messages))


if __name__ == "__main__":
    main()
