#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: independent_bags_test.py BUILD_FOLDER rosbag | mcap

Bags by other hands than this project's: Debian's python3-rosbag, and npm's @mcap/core with @foxglove's messages. They write
what 'farpoint import bag' reads, each compression, pictures byte for byte; and they read what the writers beside this file
make, which the other tests rest on. Status 77 without those packages.
"""

import hashlib
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[2] / "tools/hil")]
from host import lcm_log  # noqa: E402  of tools/hil: code that shares nothing with what is tested

SECONDS, WIDTH, HEIGHT, STEP_NS = 1_600_000_000, 64, 48, 50_000_000
SKIPPED = 77


class Failed(Exception):
    """What the test complains of."""


def expect(condition, complaint):
    if not condition:
        raise Failed(complaint)


def skip(reason):
    """In the form that tests/tree/skipped_tests.py reads."""
    print(f"independent_bags_test.py:0: Skipped\n{reason}\n[  SKIPPED ]")
    sys.exit(SKIPPED)


def png(number):
    """A grey picture, another for each number."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + bytes((3 * x + 5 * y + 17 * number) % 256 for x in range(WIDTH)) for y in range(HEIGHT))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def run(*command):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode == SKIPPED:
        skip(done.stderr.strip())
    expect(done.returncode == 0, f"status {done.returncode} of {command}: {done.stderr.strip()[-500:]}")
    return done.stdout + done.stderr


def expect_import(build, bag, pictures):
    """The log of the import has the pictures' bytes at their times, and every sample."""
    log = bag.with_suffix(bag.suffix + ".lcm")
    said = run(build / "bin/farpoint", "import", "bag", bag, "--wheels", "/odom", "-o", log)
    expect(f"{len(pictures)} images (0 missing)" in said and f"{len(pictures)} IMU samples" in said, f"{bag.name}: {said}")
    taken = [(image.utime, image.pixels) for _, image in lcm_log.images(log)]
    wanted = [(SECONDS * 10**6 + number * STEP_NS // 1000, picture) for number, picture in enumerate(pictures)]
    expect(taken == wanted, f"{bag.name}: the log does not hold the pictures byte for byte at their times")
    speeds = [data for channel, data in lcm_log.events(log) if channel == "WHEELS"]
    expect(len(speeds) == len(pictures), f"{bag.name}: {len(speeds)} samples of the wheels")
    speed = struct.unpack_from(">qd", speeds[1], 8)[1]
    expect(speed == 2.5, f"{bag.name}: second speed {speed}, expected 2.5")


def written_by_script(script, output, *options):
    run(sys.executable, "-B", HERE / script, output, *options)
    return output


# ---- ROS 1 ----

def stamped(rosbag_time, nanoseconds, message):
    message.header.stamp = rosbag_time(SECONDS + nanoseconds // 10**9, nanoseconds % 10**9)
    return message


def write_ros1(path, pictures, compression):
    import genpy
    import rosbag
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import CameraInfo, CompressedImage, Imu
    with rosbag.Bag(str(path), "w", compression=compression, chunk_threshold=2000) as bag:
        def put(topic, nanoseconds, message):
            stamped(genpy.Time, nanoseconds, message)
            bag.write(topic, message, message.header.stamp)

        info = CameraInfo(width=WIDTH, height=HEIGHT, distortion_model="plumb_bob", D=[-0.1, 0.01, 0.002, -0.003, 0.0],
                          K=[50, 0, 31, 0, 51, 23, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                          P=[50, 0, 31, 0, 0, 51, 23, 0, 0, 0, 1, 0])
        put("/cam0/camera_info", 0, info)
        for number, picture in enumerate(pictures):
            put("/cam0/image_raw/compressed", STEP_NS * number, CompressedImage(format="png", data=picture))
            imu, odometry = Imu(), Odometry()
            imu.linear_acceleration.z = 9.81
            odometry.twist.twist.linear.x = 1.5 + number
            put("/imu", STEP_NS * number, imu)
            put("/odom", STEP_NS * number, odometry)


def expect_ros1_reads(path):
    """The script's messages, whose connections name no true definition, as ROS' own classes read them."""
    import rosbag
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import CameraInfo, Image, Imu
    classes = {kind._type: kind for kind in (CameraInfo, Image, Imu, Odometry)}
    counts = {}
    with rosbag.Bag(str(path)) as bag:
        for topic, (kind, data, *_), _ in bag.read_messages(raw=True):
            counts[topic] = counts.get(topic, 0) + 1
            if kind not in classes:
                continue
            message = classes[kind]().deserialize(data)
            if kind == "sensor_msgs/Image":
                expect(message.height == HEIGHT and message.encoding == "mono8", "size or encoding of an image differs")
                expect(message.data[1] - message.data[0] == 1, "a pixel differs")
            if kind == "sensor_msgs/CameraInfo":
                expect(message.K[0] == 50.0 and message.P[0] == 70.0, "camera_info differs")
            if kind == "nav_msgs/Odometry":
                expect(message.twist.twist.angular.z == 0.25, "a yaw rate differs")
    expect(counts.get("/cam0/image_raw") == 3 and counts.get("/imu") == 10 and counts.get("/odom") == 4, f"messages: {counts}")


def check_rosbag(build, folder, pictures):
    try:
        import rosbag  # noqa: F401
        import nav_msgs.msg  # noqa: F401
        import sensor_msgs.msg  # noqa: F401
    except ImportError as error:
        skip(f"no python3-rosbag: {error}")
    for compression in ("none", "bz2", "lz4"):
        bag = folder / f"{compression}.bag"
        write_ros1(bag, pictures, compression)
        expect_import(build, bag, pictures)
        expect_ros1_reads(written_by_script("write_bag.py", folder / "script.bag", "--compression", compression))


# ---- ROS 2 ----

def expect_mcap_reads(path):
    messages = [json.loads(line) for line in run(HERE / "mcap-core/mcap", "read", path).splitlines()]
    images = [m["message"] for m in messages if m["type"] == "sensor_msgs/msg/Image"]
    pixels = bytes((x + y) % 256 for y in range(HEIGHT) for x in range(WIDTH))
    expect(len(images) == 3 and images[0]["data"] == hashlib.sha256(pixels).hexdigest(), "the pixels differ")
    info = next(m["message"] for m in messages if m["type"] == "sensor_msgs/msg/CameraInfo")
    expect(info["k"][0] == 50 and info["p"][0] == 70 and info["distortion_model"] == "plumb_bob", "camera_info differs")
    rates = [m["message"]["twist"]["twist"]["angular"]["z"] for m in messages if m["type"] == "nav_msgs/msg/Odometry"]
    expect(rates == [0.25] * 4, f"yaw rates {rates}")


def check_mcap(build, folder, pictures):
    files = []
    for number, picture in enumerate(pictures):
        files.append(folder / f"{number}.png")
        files[-1].write_bytes(picture)
    for compression in ("none", "lz4", "zstd"):
        bag = folder / f"{compression}.mcap"
        run(HERE / "mcap-core/mcap", "write", bag, compression, *files)
        expect_import(build, bag, pictures)
        expect_mcap_reads(written_by_script("write_mcap.py", folder / "script.mcap",
                                            *(("--compression", compression) if compression != "none" else ())))


def main():
    build, kind = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
    pictures = [png(number) for number in range(4)]
    try:
        with tempfile.TemporaryDirectory() as folder:
            {"rosbag": check_rosbag, "mcap": check_mcap}[kind](build, pathlib.Path(folder), pictures)
    except Failed as complaint:
        print(f"independent_bags_test.py: {kind}: {complaint}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
