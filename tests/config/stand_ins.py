# SPDX-License-Identifier: Apache-2.0
"""Recordings that stand in for a reader's own: folders of pictures, calibrations, bags, videos of a chessboard."""

import pathlib
import struct
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/tools/import"), str(ROOT / "tools/hil")]
import write_bag  # noqa: E402
import write_db3  # noqa: E402
import write_mcap  # noqa: E402

KITTI = "kitti/sequences/03"
KARLSRUHE = "karlsruhe/sequences/2010_03_09_0019"
EUROC = "euroc/MH_01_part/mav0/cam0"


def link_pictures(source, folder, count):
    """The first pictures of a recording, as links in a folder of their own."""
    folder.mkdir(parents=True)
    pictures = sorted(path for path in source.iterdir() if path.suffix in (".jpg", ".png"))[:count]
    for picture in pictures:
        (folder / picture.name).symlink_to(picture)
    return pictures


def kitti_lens(recording, size):
    """Focal lengths and centre of a rectified recording, from its calib.txt."""
    line = next(line for line in (recording / "calib.txt").read_text().splitlines() if line.startswith("P0:"))
    p = [float(word) for word in line.split()[1:]]
    return {"size": size, "fx": p[0], "fy": p[5], "cx": p[2], "cy": p[6], "d": [0.0] * 5, "rate_hz": 10}


def euroc_lens(recording):
    """The same from EuRoC's sensor.yaml, which is read by its lines."""
    def numbers(key):
        text = (recording / "sensor.yaml").read_text().split(key + ": [", 1)[1]
        return [float(word) for word in text.split("]")[0].split(",")]

    width, height = map(int, numbers("resolution"))
    fx, fy, cx, cy = numbers("intrinsics")
    return {"size": (width, height), "fx": fx, "fy": fy, "cx": cx, "cy": cy, "d": [*numbers("distortion_coefficients"), 0.0],
            "rate_hz": 20}


def replace_lens(camera_file, lens):
    """An example's camera file with another camera's numbers, as its head asks for."""
    new = {"width_px": lens["size"][0], "height_px": lens["size"][1], "fx_px": lens["fx"], "fy_px": lens["fy"],
           "cx_px": lens["cx"], "cy_px": lens["cy"], "distortion": lens["d"], "rate_hz": lens["rate_hz"]}
    lines = camera_file.read_text().splitlines()
    for number, line in enumerate(lines):
        key = line.split(":")[0]
        if key in new:
            lines[number] = f"{key}: {new.pop(key)}"
    assert not new, f"{camera_file} lacks {new}"
    camera_file.write_text("\n".join(lines) + "\n")


def ros_calibration(lens):
    """The YAML that ROS' calibrator writes."""
    k = [lens["fx"], 0.0, lens["cx"], 0.0, lens["fy"], lens["cy"], 0.0, 0.0, 1.0]
    p = [lens["fx"], 0.0, lens["cx"], 0.0, 0.0, lens["fy"], lens["cy"], 0.0, 0.0, 0.0, 1.0, 0.0]
    matrices = (("camera_matrix", 3, 3, k), ("distortion_coefficients", 1, 5, lens["d"]),
                ("rectification_matrix", 3, 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]), ("projection_matrix", 3, 4, p))
    text = f"image_width: {lens['size'][0]}\nimage_height: {lens['size'][1]}\ncamera_name: front\n"
    for name, rows, columns, data in matrices:
        text += f"{name}:\n  rows: {rows}\n  cols: {columns}\n  data: {data}\n"
        if name == "camera_matrix":
            text += "distortion_model: plumb_bob\n"
    return text


def kalibr_chain(lens):
    """The camchain that Kalibr writes."""
    return (f"cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: {lens['d'][:4]}\n"
            f"  distortion_model: radtan\n  intrinsics: {[lens['fx'], lens['fy'], lens['cx'], lens['cy']]}\n"
            f"  resolution: {list(lens['size'])}\n  rostopic: /cam0/image_raw\n")


def bag_of(pictures, lens, rate_hz):
    """A ROS 1 bag of compressed images and camera_info."""
    topics = (("/cam0/image_raw/compressed", "sensor_msgs/CompressedImage"), ("/cam0/camera_info", "sensor_msgs/CameraInfo"))
    connections = b"".join(write_bag.connection(i, topic, kind) for i, (topic, kind) in enumerate(topics))
    k = [lens["fx"], 0, lens["cx"], 0, lens["fy"], lens["cy"], 0, 0, 1]
    p = [lens["fx"], 0, lens["cx"], 0, 0, lens["fy"], lens["cy"], 0, 0, 0, 1, 0]
    info = (write_bag.header(0, 0) + struct.pack("<II", lens["size"][1], lens["size"][0]) + write_bag.text("plumb_bob") +
            struct.pack("<I5d9d9d12d", 5, *lens["d"], *k, 1, 0, 0, 0, 1, 0, 0, 0, 1, *p) + struct.pack("<IIIIIIB", *[0] * 7))
    chunks = [connections + write_bag.message(1, 0, info)]
    for number, picture in enumerate(pictures):
        when, content = round(number * 1e9 / rate_hz), picture.read_bytes()
        data = write_bag.header(number, when) + write_bag.text("jpeg") + struct.pack("<I", len(content)) + content
        chunks.append(write_bag.message(0, when, data))
    head = write_bag.record({"op": b"\x03", "index_pos": struct.pack("<Q", 0), "conn_count": struct.pack("<I", 2),
                             "chunk_count": struct.pack("<I", len(chunks))}, b" " * 100)
    body = b"".join(write_bag.record({"op": b"\x05", "compression": b"none", "size": struct.pack("<I", len(chunk))}, chunk)
                    for chunk in chunks)
    return b"#ROSBAG V2.0\n" + head + body


ROS2_TOPICS = (("/cam0/image_raw/compressed", "sensor_msgs/msg/CompressedImage"), ("/cam0/camera_info", "sensor_msgs/msg/CameraInfo"))


def ros2_messages(pictures, lens, rate_hz):
    """(number of the topic, nanoseconds, CDR) of each message: camera_info, then the images."""
    k = [lens["fx"], 0, lens["cx"], 0, lens["fy"], lens["cy"], 0, 0, 1]
    p = [lens["fx"], 0, lens["cx"], 0, 0, lens["fy"], lens["cy"], 0, 0, 0, 1, 0]
    yield 1, 0, (write_mcap.Cdr().header(0, "cam0").pack("I", lens["size"][1], lens["size"][0]).text("plumb_bob")
                 .pack("I", 5).pack("d", *lens["d"]).pack("d", *k).pack("d", 1, 0, 0, 0, 1, 0, 0, 0, 1).pack("d", *p)
                 .pack("I", 0, 0).pack("I", 0, 0, 0, 0).pack("B", 0).bytes())
    for number, picture in enumerate(pictures):
        when, content = round(number * 1e9 / rate_hz), picture.read_bytes()
        cdr = write_mcap.Cdr().header(when, "cam0").text("jpeg").pack("I", len(content))
        cdr.data += content
        yield 0, when, cdr.bytes()


def mcap_of(pictures, lens, rate_hz):
    """An MCAP of ROS 2 with the same."""
    channels = b"".join(write_mcap.channel(i, topic, kind) for i, (topic, kind) in enumerate(ROS2_TOPICS))
    records = channels + b"".join(write_mcap.message(*message) for message in ros2_messages(pictures, lens, rate_hz))
    magic = b"\x89MCAP0\r\n"
    end = write_mcap.record(15, struct.pack("<I", 0)) + channels + write_mcap.record(2, struct.pack("<QQI", 0, 0, 0))
    return magic + write_mcap.record(1, write_mcap.text("ros2") + write_mcap.text("by hand")) + records + end + magic


def write_db3_of(pictures, lens, rate_hz, output):
    """The same as rosbag2's SQLite file."""
    database = write_db3.new_bag(output, [(*topic, "cdr") for topic in ROS2_TOPICS])
    for topic, when, data in ros2_messages(pictures, lens, rate_hz):
        write_db3.put(database, topic + 1, when, data)
    database.commit()
    database.close()


def make_video(pattern, rate_hz, output):
    """An mp4 of numbered pictures, without loss and with all 256 grey levels."""
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-framerate", str(rate_hz), "-i", pattern, "-vf",
                    "scale=in_range=full:out_range=full", "-pix_fmt", "yuvj444p", "-c:v", "libx264", "-preset", "ultrafast",
                    "-qp", "0", str(output)], check=True, stdin=subprocess.DEVNULL)
