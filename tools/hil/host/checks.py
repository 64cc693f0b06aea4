"""What the host checks of what a scenario left: each check gives (complaint or None, figures)."""

import pathlib

from host import can_bus, lcm_log
from host.material import NotMade, run as run_program

FRAME_BYTES = 320 * 240
NOT_COMPARED = ("FARPOINT_TIMING",)  # measured times
# What is said about an image, and does not tell how the run was configured.
OF_IMAGES = ("FARPOINT_ODOMETRY", "FARPOINT_POSE", "FARPOINT_MAP_FROM_ODOM", "FARPOINT_MAP", "FARPOINT_TRAJECTORY",
             "FARPOINT_LANDMARKS", "FARPOINT_SCHEDULE")


def played(path):
    """[(index in the file of frames, stamp in us)], and the clocks (monotonic, real time) in us at the start."""
    clocks, frames = None, []
    for line in pathlib.Path(path).read_text().splitlines():
        words = line.split()
        if words[0] == "clock":
            clocks = int(words[1]), int(words[2])
        else:
            frames.append((int(words[1]), int(words[2])))
    return clocks, frames


def frame_of(image, frames, begin, tolerance_us):
    """Where in `frames`, from `begin` on, the image's time is; None where nowhere."""
    for at in range(begin, len(frames)):
        stamp_us = frames[at][1]
        if stamp_us >= image.utime - tolerance_us:
            return at if stamp_us <= image.utime + tolerance_us else None
    return None


def images(folder, stock, log, of, tolerance_us="0", may_miss="0"):
    """Every frame that was played came once, in order, byte for byte, and with its time."""
    del stock
    _, frames = played(folder / of)
    pixels = (folder / "frames.grey").read_bytes()
    came = [image for _, image in lcm_log.images(folder / log)]
    worst_us, next_frame, missing = 0, 0, []
    for number, image in enumerate(came):
        at = frame_of(image, frames, next_frame, int(tolerance_us))
        if at is None:
            return f"image {number} of time {image.utime} is of no frame, or of one that has come already", []
        index, stamp_us = frames[at]
        if image.pixels != pixels[index * FRAME_BYTES:(index + 1) * FRAME_BYTES]:
            return f"image {number} is not frame {at}", []
        worst_us = max(worst_us, abs(image.utime - stamp_us))
        missing += range(next_frame, at)
        next_frame = at + 1
    missing += range(next_frame, len(frames))
    if len(missing) > int(may_miss):
        return f"frame {missing[0]} never came; {len(missing)} of {len(frames)} did not", []
    return None, [f"{len(came)} of {len(frames)} frames, each once, in order, byte for byte, "
                  f"time off by at most {1e-3 * worst_us:.1f} ms"]


def status(folder, stock, log, *limits):
    """The last status of a run: NAME=LEAST..MOST each."""
    del stock
    last = lcm_log.last_status(folder / log)
    figures = []
    for limit in limits:
        name, least_most = limit.split("=")
        least, most = (float(word) for word in least_most.split(".."))
        if not least <= last[name] <= most:
            return f"{name} {last[name]} at the end, expected {least:.0f} to {most:.0f}", []
        figures.append(f"{name} {last[name]}")
    return None, [", ".join(figures)]


def reference_log(folder, log, of, path):
    """What the recording must be: its calibration, and the frames that were played, with their times."""
    _, frames = played(folder / of)
    pixels = (folder / "frames.grey").read_bytes()
    patterns = [data for data, _ in lcm_log.images(folder / log)]
    events = [("CALIBRATION", lcm_log.first(folder / log, "CALIBRATION"))]
    for (index, stamp_us), pattern in zip(frames, patterns):
        frame = pixels[index * FRAME_BYTES:(index + 1) * FRAME_BYTES]
        events.append(("CAMERA_0", lcm_log.with_image(pattern, stamp_us, frame)))
    lcm_log.write(path, events)


def replay(folder, stock, log, output, *arguments):
    """Replays natively with the configuration of the guest."""
    run_program(stock.build / "bin/farpointd", "--config", folder / "farpoint.yaml", "--replay", folder / log,
                "--output", folder / output, *arguments)


def difference(first, second):
    """Where two output logs differ; None: nowhere. And how many messages they have."""
    one = [event for event in lcm_log.events(first) if event[0] not in NOT_COMPARED]
    other = [event for event in lcm_log.events(second) if event[0] not in NOT_COMPARED]
    for number, (a, b) in enumerate(zip(one, other)):
        if a != b:
            return f"message {number} differs ({a[0]}, {b[0]})", len(one)
    return (f"{len(one)} and {len(other)} messages" if len(one) != len(other) else None), len(one)


def poses(path):
    return sum(1 for line in pathlib.Path(path).read_text().splitlines() if line and line[0] != "#")


def lockstep(folder, stock, log, of, least):
    """The recording replays in lockstep to the same messages as the frames it is of, and tracks."""
    reference_log(folder, log, of, folder / "reference.lcm")
    replay(folder, stock, log, "lockstep.lcm", "--lockstep", "--live-trajectory", folder / "lockstep.tum")
    replay(folder, stock, "reference.lcm", "expected.lcm", "--lockstep")
    complaint, messages = difference(folder / "lockstep.lcm", folder / "expected.lcm")
    if complaint:
        return "lockstep replay of the recording: " + complaint, []
    count = poses(folder / "lockstep.tum")
    if count < int(least):
        return f"lockstep replay of the recording: {count} poses, expected {least}", []
    return None, [f"lockstep: {count} poses, {messages} messages the same"]


def messages_of_images(log, path):
    """(channel, utime) -> data of what `path` says about the images of `log`; not of silences between them."""
    utimes = {image.utime for _, image in lcm_log.images(log)}
    found = {(channel, lcm_log.utime(data)): data for channel, data in lcm_log.events(path) if channel in OF_IMAGES}
    return {key: data for key, data in found.items() if key[1] in utimes}


def schedule(folder, stock, log, output, least):
    """What was published live in the guest comes again, byte for byte, from the recording and its schedule."""
    replay(folder, stock, log, "again.lcm", "--schedule", "recorded", "--schedule-log", folder / output,
           "--live-trajectory", folder / "again.tum")
    live, again = (messages_of_images(folder / log, folder / name) for name in (output, "again.lcm"))
    for key in [*live, *again]:
        if live.get(key) != again.get(key):
            return f"the recorded schedule: {key[0]} of image {key[1]} is another", []
    count = poses(folder / "again.tum")
    if count < int(least):
        return f"the recorded schedule: {count} poses, expected {least}", []
    return None, [f"live = its schedule repeated natively: {count} poses, {len(live)} messages the same"]


def bus(folder, stock, log, of, rate_hz, *expectations):
    """What a receiver that knows only the DBC makes of a bus."""
    text = (stock.here.parents[1] / "config/farpoint.dbc").read_text()
    clocks, frames = played(folder / of)
    receiver = can_bus.Receiver(can_bus.layout(text))
    return receiver.check(folder / log, [stamp for _, stamp in frames], clocks, float(rate_hz), expectations)


CHECKS = {"images": images, "lockstep": lockstep, "schedule": schedule, "bus": bus, "status": status}


def run(check, folder, stock):
    name, *arguments = check
    try:
        return CHECKS[name](folder, stock, *arguments)
    except NotMade as error:
        return str(error), []
