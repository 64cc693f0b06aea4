# SPDX-License-Identifier: Apache-2.0
"""What the host checks of what a scenario left: each check gives (complaint or None, figures)."""

import itertools
import math
import pathlib
import re
import struct
import typing

from host import can_bus, consumer, lcm_log
from host.material import NotMade, run as run_program

FRAME_BYTES = 320 * 240
OUTPUT_BUFFERS = 4  # of tools/hil/programs/play.c
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


def images(folder, stock, log, of, tolerance_us="0", may_miss="0", channel="CAMERA_0"):
    """Every frame that was played came once, in order, byte for byte, and with its time."""
    del stock
    _, frames = played(folder / of)
    pixels = (folder / "frames.grey").read_bytes()
    came = [image for _, image in lcm_log.images(folder / log, channel)]
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


class Way(typing.NamedTuple):
    """A way to read images as frames: how many came twice or never, how long after they were sent."""
    off: int = 0
    twice: int = 0
    never: int = 0
    least_us: int = 1 << 62
    most_us: int = 0


def go_on(ways, at, late_us):
    """The best of the ways, by their last frame, that frame `at` carries on; where frames run forwards and backwards two
    of them look the same around the turn."""
    before = {at - 1: Way()} if ways is None else ways
    found = []
    for last, way in before.items():
        if last <= at <= last + 2:
            twice, never = at == last, max(0, at - last - 1)
            found.append(Way(way.off + twice + never, way.twice + twice, way.never + never,
                             min(way.least_us, late_us), max(way.most_us, late_us)))
    return min(found, default=None)


def wired(folder, stock, log, of, period_us, least, most_off):
    """Every image is a frame that was played, in order, byte for byte, taken after it was sent and before it can have
    gone: the output's buffers and two periods later. They are a period apart, give or take half of one. The clocks of
    output and input are two: at most so many frames come twice or never, and no two never one after the other."""
    del stock
    _, frames = played(folder / of)
    pixels = (folder / "frames.grey").read_bytes()
    places = {}
    for at, (index, _) in enumerate(frames):
        places.setdefault(pixels[index * FRAME_BYTES:(index + 1) * FRAME_BYTES], []).append(at)
    period_us, before_us, ways = int(period_us), None, None
    came = [image for _, image in lcm_log.images(folder / log)]
    for number, image in enumerate(came):
        same = places.get(image.pixels, [])
        if not same:
            return f"image {number} is none of the frames", []
        in_time = [at for at in same if 0 <= image.utime - frames[at][1] <= (OUTPUT_BUFFERS + 2) * period_us]
        if not in_time:
            return f"image {number} of time {image.utime} is frame {same[0]}, which was not sent just before", []
        onward = {}
        for at in in_time:
            way = go_on(ways, at, image.utime - frames[at][1])
            if way is not None:
                onward[at] = way
        if not onward:
            word = "after frame" if in_time[-1] < min(ways) else "the one before was frame"
            return f"image {number} is frame {in_time[0]}, {word} {min(ways)}", []
        if before_us is not None and abs(image.utime - before_us - period_us) > period_us / 2:
            return f"image {number} came {1e-3 * (image.utime - before_us):.1f} ms after the one before", []
        ways, before_us = onward, image.utime
    if len(came) < int(least):
        return f"{len(came)} images, expected {least}", []
    way = min(ways.values())
    text = f"{way.twice} twice and {way.never} never"
    if way.off > int(most_off):
        return f"{text} of {len(came)} frames, expected at most {most_off}", []
    return None, [f"{len(came)} images, each a frame, in order, byte for byte, {1e-3 * way.least_us:.0f} to "
                  f"{1e-3 * way.most_us:.0f} ms after it was sent; {text}"]


# The luma of the eight colour bars at 75 %: white, yellow, cyan, green, magenta, red, blue, black.
BARS = tuple(0.75 * 255 * luma for luma in (1.0, 0.886, 0.701, 0.587, 0.413, 0.299, 0.114, 0.0))


def bars(folder, stock, log, size, least):
    """At least so many images of just this size, one after the other in time, each with the eight colour bars (looked at
    near its lower edge: the sensor writes on its middle)."""
    del stock
    before_us, came = None, 0
    for number, (_, image) in enumerate(lcm_log.images(folder / log)):
        if f"{image.width}x{image.height}" != size:
            return f"image {number} has {image.width}x{image.height} pixels, expected {size}", []
        if before_us is not None and image.utime <= before_us:
            return f"image {number} is not later than the one before", []
        before_us, came = image.utime, number + 1
        for bar, expected in enumerate(BARS):
            grey = image.pixels[image.height * 15 // 16 * image.width + (2 * bar + 1) * image.width // 16]
            if abs(grey - expected) > 12:
                return f"image {number}: bar {bar + 1} is {grey}, expected {expected:.0f}", []
    if came < int(least):
        return f"{came} images, expected {least}", []
    return None, [f"{came} images of {size}, in order, with the bars of the sensor's pattern"]


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
    """Decodes a bus by the DBC alone: that of the scenario's configuration, where it has one of its own."""
    own = folder / "mine.dbc"
    text = (own if own.exists() else stock.here.parents[1] / "config/farpoint.dbc").read_text()
    clocks, frames = played(folder / of)
    receiver = can_bus.Receiver(can_bus.layout(text))
    return receiver.check(folder / log, [stamp for _, stamp in frames], clocks, float(rate_hz), expectations)


def trust(folder, stock, log, of, happened):
    """A consumer that keeps to the DBC takes no pose that is older than it says, or of another origin unnoticed."""
    text = (stock.here.parents[1] / "config/farpoint.dbc").read_text()
    (monotonic_us, real_us), frames = played(folder / of)
    stamps_s = [1e-6 * (stamp - monotonic_us + real_us) for _, stamp in frames]
    return consumer.judge(can_bus.layout(text), folder / log, stamps_s, consumer.events(folder / happened))


def axles(path):
    """[(time in s, speeds of the four wheels in m/s)] of what a bus carried: how tools/hil/scenarios/wheels.sh lays it."""
    front, found = (), []
    for time_s, identifier, data in can_bus.frames_of(path):
        if identifier == 0x123:
            front = struct.unpack_from(">hh", data)
        elif identifier == 0x124:
            found.append((time_s, [0.01 / 3.6 * raw for raw in (*front, *struct.unpack_from("<hh", data))]))
    return found


def differing(found, expected, most):
    """The pairs that differ by more, or are missing (NaN), or no numbers."""
    pairs = itertools.zip_longest(found, expected, fillvalue=math.nan)
    return [(one, other) for one, other in pairs if not abs(one - other) <= most]


def wheels(folder, stock, log, bus_log, count):
    """Each pair of axle frames came out once, in order, with its speeds and within 10 ms of its time on the bus."""
    del stock
    (monotonic_us, real_us), _ = played(folder / "played")
    sent, came = axles(folder / bus_log), list(lcm_log.wheels(folder / log))
    if len(sent) != int(count) or len(came) != len(sent):
        return f"{len(came)} WHEELS of {len(sent)} pairs on the bus, expected {count}", []
    worst_s = 0.0
    for number, ((time_s, speeds), (utime, speed, wheel_speeds)) in enumerate(zip(sent, came)):
        for is_m_s, must_m_s in differing((*wheel_speeds, speed), (*speeds, sum(speeds) / 4), 1e-9):
            return f"wheels {number}: {is_m_s:.4f} m/s, expected {must_m_s:.4f}", []
        worst_s = max(worst_s, abs(1e-6 * (utime - monotonic_us + real_us) - time_s))
    if worst_s > 0.01:
        return f"wheels: time off by {1e3 * worst_s:.1f} ms, expected at most 10", []
    return None, [f"{len(came)} of {len(sent)} pairs of frames, {sent[0][1][0]:.2f} to {sent[-1][1][0]:.2f} m/s, "
                  f"time off by at most {1e3 * worst_s:.1f} ms"]


# Half of what a bit of the wheel signals of support.sh's DBC stands for, and what rounding may add.
WHEEL_M_S = 0.5 * 0.01 / 3.6 + 1e-9


def streamed(folder, stock, log, output, said, size, seconds):
    """Every image of the simulation came once, in order, byte for byte, with the time at which it was due; so did its
    wheel speeds, as fine as their signals are, within 10 ms."""
    start = re.search(r"frame 0 at (\d+) us of CLOCK_MONOTONIC, ([\d.]+) frames a second", (folder / said).read_text())
    if start is None:
        return "the simulator did not say when it began", []
    run_program(stock.build / "bin/farpoint", "simulate", "yard", "--size", size, "--duration", seconds,
                "-o", folder / "simulated.lcm")
    must = [image for _, image in lcm_log.images(folder / "simulated.lcm")]
    period_us = (must[-1].utime - must[0].utime) / (len(must) - 1)
    slower = 1e6 / float(start[2]) / period_us

    def due_us(utime):
        return int(start[1]) + slower * utime

    came = [image for _, image in lcm_log.images(folder / log)]
    for number, (image, frame) in enumerate(zip(came, must)):
        if image.pixels != frame.pixels:
            return f"image {number} is not frame {number} of the simulation", []
        if abs(image.utime - due_us(frame.utime)) > 1:
            return f"image {number} has time {image.utime}, was due at {due_us(frame.utime):.0f}", []
    must_turn, turned = (list(lcm_log.wheels(folder / name)) for name in ("simulated.lcm", output))
    if (len(came), len(turned)) != (len(must), len(must_turn)):
        return (f"{len(came)} images and {len(turned)} wheel speeds came, "
                f"expected {len(must)} and {len(must_turn)}"), []
    worst_us = 0.0
    for number, ((utime, _, speeds), (must_utime, _, must_speeds)) in enumerate(zip(turned, must_turn)):
        if differing(speeds, must_speeds, WHEEL_M_S):
            return f"wheels {number}: {speeds}, expected {must_speeds}", []
        worst_us = max(worst_us, abs(utime - due_us(must_utime)))
    if worst_us > 10_000:
        return f"wheels: time off by {1e-3 * worst_us:.1f} ms, expected at most 10", []
    return None, [f"{len(came)} images and {len(turned)} wheel speeds, each once, in order, as simulated; images byte for "
                  f"byte with the time at which they were due, wheels off by at most {1e-3 * worst_us:.1f} ms"]


# Of x86-64, as far as they are seen.
SYSTEM_CALLS = {0: "read", 1: "write", 3: "close", 7: "poll", 11: "munmap", 16: "ioctl", 35: "nanosleep", 44: "sendto",
                46: "sendmsg", 47: "recvmsg", 98: "getrusage", 202: "futex", 228: "clock_gettime",
                230: "clock_nanosleep", 257: "openat", 271: "ppoll"}
HEAP = ("malloc", "calloc", "realloc", "memalign", "aligned_alloc", "posix_memalign")


def histogram(path):
    """[(keys, number)] of one of the kernel's histograms: keys by name, a stacktrace as its functions."""
    if not path.exists():
        raise NotMade(f"no {path.name}, expected one of the kernel's histograms")
    text = path.read_text()
    if (dropped := re.search(r"Dropped: ([1-9]\d*)", text)):
        raise NotMade(f"{path.name}: {dropped[1]} events were dropped, expected none")
    found = []
    for keys, number in re.findall(r"^\{ (.*?)\} hitcount: +(\d+)", text, re.MULTILINE | re.DOTALL):
        scalars, _, stack = keys.partition("stacktrace:")
        one = {key: int(value) for key, value in re.findall(r"(\w+): +(\d+)", scalars)}
        one["stacktrace"] = re.findall(r"^\s+(\w[\w.]*)\+0x", stack, re.MULTILINE)
        found.append((one, int(number)))
    return found


def waits_of(task, trace):
    """[(functions of the kernel, innermost first, times)] in which a thread was not runnable."""
    sleeps = histogram(trace("sched_switch"))
    return [(keys["stacktrace"], number) for keys, number in sleeps if keys["prev_pid"] == task]


def quiet(folder, stock, prefix, least, *threads):
    """By the kernel's histograms, each thread (NAME=FUNCTION) made no heap call, and slept in FUNCTION alone; as
    NAME=FUNCTION=CALL it made no other system call either."""
    del stock
    tasks = {name: int(number) for number, name in (line.split() for line in
                                                     (folder / "threads").read_text().splitlines())}
    figures = []

    def trace(event):
        return folder / f"{prefix}.{event}"

    for name, function, *only in (thread.split("=") for thread in threads):
        task = tasks.get(name, -1)
        heap = sum(number for event in HEAP for keys, number in histogram(trace(event)) if keys["common_pid"] == task)
        if heap > 0:
            return f"{name} made {heap} heap calls", []
        waits = waits_of(task, trace)
        for functions, number in waits:
            if function not in functions:
                return f"{name} slept {number} times elsewhere than in {function}: {' < '.join(functions)}", []
        number = sum(times for _, times in waits)
        if number < int(least):
            return f"{name} slept {number} times, expected {least}", []
        calls = {SYSTEM_CALLS.get(keys["id"], keys["id"]): times for keys, times in histogram(trace("sys_enter"))
                 if keys["common_pid"] == task}
        told = ", ".join(f"{call} {times}" for call, times in calls.items())
        if only and set(calls) != set(only):
            return f"{name} made other calls than {only[0]}: {told}", []
        figures.append(f"{name}: no heap call, {number} waits, all in {function}; its calls: {told}")
    return None, figures


CHECKS = {"images": images, "bars": bars, "lockstep": lockstep, "schedule": schedule, "bus": bus, "status": status,
          "wheels": wheels, "quiet": quiet, "wired": wired, "streamed": streamed, "trust": trust}


def run(check, folder, stock):
    name, *arguments = check
    try:
        return CHECKS[name](folder, stock, *arguments)
    except NotMade as error:
        return str(error), []
