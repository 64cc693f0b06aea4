# SPDX-License-Identifier: Apache-2.0
"""LCM logs, read and written anew here: the bench shares no code with what it tests."""

import dataclasses
import pathlib
import struct

SYNC = 0xEDA1DA01
EVENT = struct.Struct(">IqqII")
FINGERPRINT_BYTES = 8
# image_t behind its fingerprint: utime, sequence, camera, exposure, gain, width, height, stride, format, size.
IMAGE = struct.Struct(">qqiifiiiii")
# camera_calibration_t behind its two strings.
CAMERA = struct.Struct(">ii4d5d3d4ddd")

# status_t behind its fingerprint, as far as it is read here: before and behind its two strings of the camera.
STATUS_HEAD, STATUS_REST = struct.Struct(">qbbdbbbii"), struct.Struct(">did24qb")
STATUS_NAMES = ("utime", "state", "scale_state", "assumed_scale", "metre_source", "wheels", "quality", "map_id",
                "reset_counter",
                "camera_rate_hz", "camera_exposure_us", "camera_gain",
                "frames_received", "frames_tracked", "frames_valid", "frames_dropped", "keyframes_dropped",
                "deadlines_missed",
                "images_wrong_size", "images_undecodable", "images_missing", "images_flagged", "camera_losses",
                "stereo_pairs", "stereo_left_alone", "stereo_right_alone", "stereo_skew_us", "images_unknown_camera",
                "times_backwards", "times_unknown", "messages_undecodable", "log_damages", "imu_invalid",
                "can_send_errors", "can_bus_offs", "can_received", "can_state")
# wheels_t behind its fingerprint, before the wheels: utime, speed, its sigma, yaw rate, steering angle, how many.
WHEELS = struct.Struct(">qddddi")


@dataclasses.dataclass
class Image:
    utime: int
    sequence: int
    width: int
    height: int
    pixels: bytes


def events(path):
    """(channel, data) of every event."""
    data = pathlib.Path(path).read_bytes()
    at = 0
    while at + EVENT.size <= len(data):
        sync, _, _, channel_bytes, data_bytes = EVENT.unpack_from(data, at)
        if sync != SYNC:
            raise ValueError(f"{path}: no event at byte {at}")
        at += EVENT.size
        end = at + channel_bytes + data_bytes
        if end > len(data):
            raise ValueError(f"{path}: cut off at byte {at}")
        yield data[at:at + channel_bytes].decode(), data[at + channel_bytes:end]
        at = end


def first(path, wanted):
    return next(data for channel, data in events(path) if channel == wanted)


def utime(data):
    """Of any of the project's messages."""
    return struct.unpack_from(">q", data, FINGERPRINT_BYTES)[0]


def images(path, wanted="CAMERA_0"):
    """(data, image) of each grey image."""
    for channel, data in events(path):
        if channel != wanted:
            continue
        utime, sequence, _, _, _, width, height, _, _, size = IMAGE.unpack_from(data, FINGERPRINT_BYTES)
        at = FINGERPRINT_BYTES + IMAGE.size
        yield data, Image(utime, sequence, width, height, data[at:at + size])


def last_status(path):
    """name -> value of the last FARPOINT_STATUS."""
    last = [data for channel, data in events(path) if channel == "FARPOINT_STATUS"][-1]
    rest = FINGERPRINT_BYTES + STATUS_HEAD.size
    for _ in range(2):
        rest += 4 + int.from_bytes(last[rest:rest + 4], "big")
    return dict(zip(STATUS_NAMES, STATUS_HEAD.unpack_from(last, FINGERPRINT_BYTES) + STATUS_REST.unpack_from(last, rest)))


def wheels(path):
    """(utime, speed of the vehicle, speeds of its wheels) of every WHEELS."""
    for channel, data in events(path):
        if channel != "WHEELS":
            continue
        utime, speed, _, _, _, count = WHEELS.unpack_from(data, FINGERPRINT_BYTES)
        yield utime, speed, struct.unpack_from(f">{count}d", data, FINGERPRINT_BYTES + WHEELS.size)


def with_image(data, utime, pixels):
    """The image message `data` with another time and other pixels."""
    body = bytearray(data)
    struct.pack_into(">q", body, FINGERPRINT_BYTES, utime)
    at = FINGERPRINT_BYTES + IMAGE.size
    body[at:at + len(pixels)] = pixels
    return bytes(body)


def write(path, channels_and_data):
    with open(path, "wb") as log:
        for number, (channel, data) in enumerate(channels_and_data):
            log.write(EVENT.pack(SYNC, number, number, len(channel), len(data)) + channel.encode() + data)


def _string(data, at):
    size = struct.unpack_from(">i", data, at)[0]
    return data[at + 4:at + 4 + size - 1].decode(), at + 4 + size


def first_camera(calibration):
    """Of a calibration_t: the first camera, by the names of a camera file."""
    at = FINGERPRINT_BYTES + 8
    _, at = _string(calibration, at)
    at += 4
    _, at = _string(calibration, at)
    model, at = _string(calibration, at)
    width, height, fx, fy, cx, cy, *rest = CAMERA.unpack_from(calibration, at)
    distortion = rest[:4] if model == "kannala-brandt" else rest[:5]
    return {"model": model, "width_px": width, "height_px": height, "fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy,
            "distortion": distortion}


def camera_file(camera):
    return "".join(f"{key}: {value}\n" for key, value in camera.items())
