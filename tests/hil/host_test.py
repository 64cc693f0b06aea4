#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: host_test.py ROOT

The bench's checks on the host find what they are there to find: each on good data and on data with one fault. No
machine is started. And every scenario can be read.
"""

import collections
import importlib.machinery
import importlib.util
import io
import json
import math
import pathlib
import struct
import sys
import tempfile
import types
import unittest

ROOT = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(ROOT / "tools/hil"))
from host import can_bus, checks, consumer, lcm_log, scenario  # noqa: E402

RATE_HZ, PERIOD_US = 50.0, 100_000
CLOCKS_US = (1_000_000, 5_000_000)  # monotonic and real time at the same moment
LAYOUT = can_bus.layout((ROOT / "config/farpoint.dbc").read_text())
STATUS = next(i for i, message in LAYOUT.items() if message.name == "FARPOINT_STATUS")
ATTITUDE = next(i for i, message in LAYOUT.items() if message.name == "FARPOINT_ATTITUDE")
VELOCITY = next(i for i, message in LAYOUT.items() if message.name == "FARPOINT_VELOCITY")


def put(data, message, name, number):
    start, bits, _, _ = message.signals[name]
    whole = int.from_bytes(data, "little") & ~((1 << bits) - 1 << start) | number << start
    return bytearray(whole.to_bytes(len(data), "little"))


def due(epoch):
    """(identifier, counter) of the frames of an epoch; those of every fifth take turns."""
    for place, identifier in enumerate(sorted(LAYOUT)):
        every = LAYOUT[identifier].cycle_ms // LAYOUT[STATUS].cycle_ms
        if (epoch + place) % every == 0:
            yield identifier, (epoch + place) // every % 15 if every > 1 else epoch % 15


def frame(identifier, counter, age_s, valid):
    message = LAYOUT[identifier]
    data = put(bytearray(message.size), message, "Counter", counter)
    if identifier == STATUS:
        data = put(data, message, "Age", round(age_s * 1e4))
        data = put(data, message, "State", 3 if valid else 1)
        data = put(data, message, "PoseValid", valid)
    if "Heading" in message.signals and not valid:
        data = put(data, message, "Heading", 0x8000)
    return can_bus.seal(message, data)


def bus_log(path, stamps_us, spoil=lambda epoch, frames: frames, mark=lambda number: "#"):
    """Epochs every 20 ms, of the newest image that is at least 30 ms old; `mark` between a frame's identifier and data."""
    number = 0
    with open(path, "w") as log:
        for epoch in range(100):
            now_us = stamps_us[0] + 30_000 + 20_000 * epoch
            age_s = 1e-6 * (now_us - max(s for s in stamps_us if s <= now_us - 30_000))
            frames = {i: frame(i, counter, age_s, epoch > 10) for i, counter in due(epoch)}
            for identifier, data in spoil(epoch, frames).items():
                time_s = 1e-6 * (now_us - CLOCKS_US[0] + CLOCKS_US[1])
                log.write(f"({time_s:.6f}) vcan0 {identifier:X}{mark(number)}{bytes(data).hex().upper()}\n")
                number += 1


class Bus(unittest.TestCase):
    def complaint(self, spoil=lambda epoch, frames: frames, rate_hz=RATE_HZ, expectations=("valid",),
                  mark=lambda number: "#"):
        stamps_us = [2_000_000 + PERIOD_US * i for i in range(21)]
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bus.log"
            bus_log(path, stamps_us, spoil, mark)
            return can_bus.Receiver(LAYOUT).check(path, stamps_us, CLOCKS_US, rate_hz, expectations)[0]

    def at_50(self, change):
        return lambda epoch, frames: change(dict(frames)) if epoch == 50 else frames

    def test_good(self):
        self.assertIsNone(self.complaint())

    def test_crc(self):
        def flip(frames):
            frames[ATTITUDE][3] ^= 4
            return frames
        self.assertRegex(self.complaint(self.at_50(flip)), "wrong CRC of FARPOINT_ATTITUDE")

    def test_missing_frame(self):
        self.assertRegex(self.complaint(self.at_50(lambda f: {i: d for i, d in f.items() if i != VELOCITY})), "4 frames")

    def test_missing_epoch(self):
        self.assertRegex(self.complaint(self.at_50(lambda f: {})), "counter 6 after 4")

    def test_unknown_frame(self):
        self.assertRegex(self.complaint(self.at_50(lambda f: {0x123: bytearray(8)})), "not in the DBC")

    def test_rate(self):
        self.assertRegex(self.complaint(rate_hz=60.0), "50.0 Hz.*expected 60 Hz")

    def test_gap(self):
        # Two of 100 epochs do not come, and the counter goes on as if they had never been due.
        late = lambda epoch, frames: {} if epoch in (50, 51) else (  # noqa: E731
            frames if epoch < 50 else {i: frame(i, c, 0.03 + 0.02 * (epoch % 5), True) for i, c in due(epoch - 2)})
        self.assertIsNone(self.complaint(late))
        self.assertRegex(self.complaint(late, expectations=("valid", "steady")), "gap at most 60 ms, expected .* 40 ms")

    def test_age(self):
        late = lambda epoch, frames: {i: frame(i, c, 0.05, epoch > 10) for i, c in due(epoch)}  # noqa: E731
        self.assertRegex(self.complaint(late), "the age is wrong")

    def test_heading_without_a_pose(self):
        def heading(frames):
            frames[STATUS] = frame(STATUS, 50 % 15, 0.05, False)
            return frames
        self.assertRegex(self.complaint(self.at_50(heading)), "a heading without a valid pose")

    def test_fd(self):
        wanted = ("valid", "fd")
        self.assertIsNone(self.complaint(expectations=wanted, mark=lambda number: "##1"))
        self.assertRegex(self.complaint(expectations=wanted, mark=lambda number: "#" if number == 70 else "##1"),
                         "a classic frame at")

    def test_no_pose(self):
        def never(epoch, frames):
            return {i: frame(i, c, 0.03 + 0.02 * (epoch % 5), False) for i, c in due(epoch)}
        self.assertRegex(self.complaint(never), "only 0 epochs with a valid pose")


def with_signals(frames, **signals):
    """The frames with other raw numbers in these signals."""
    changed = {}
    for identifier, data in frames.items():
        for name, number in signals.items():
            if name in LAYOUT[identifier].signals:
                data = put(data, LAYOUT[identifier], name, number)
        changed[identifier] = can_bus.seal(LAYOUT[identifier], bytearray(data))
    return changed


class Trust(unittest.TestCase):
    """Epochs come from 6.03 s on. A process ends at 7 s, the next starts at 7.2 s."""

    EVENTS = {"stopped": [[7.0]], "silent": [[7.0, 7.2]], "started": [[7.2]]}

    @staticmethod
    def life(frames, now_s):
        """A first process, its stated end, a second process."""
        if now_s > 7.2:
            return with_signals(frames, BootCounter=2, PositionX=5000)
        if now_s > 6.97:
            return with_signals(frames, BootCounter=1, PoseValid=0, State=8) if now_s < 7.0 else {}
        return with_signals(frames, BootCounter=1)

    def complaint(self, change=lambda frames, now_s: frames, **events):
        stamps_us = [2_000_000 + PERIOD_US * i for i in range(21)]

        def spoil(epoch, frames):
            now_s = 6.03 + 0.02 * epoch
            return change(self.life(frames, now_s), now_s)

        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bus.log"
            bus_log(path, stamps_us, spoil)
            happened = collections.defaultdict(list, self.EVENTS | events)
            return consumer.judge(LAYOUT, path, [1e-6 * stamp + 4.0 for stamp in stamps_us], happened)[0]

    @staticmethod
    def between(begin_s, end_s, **signals):
        return lambda frames, now_s: with_signals(frames, **signals) if begin_s < now_s < end_s else frames

    def test_good(self):
        self.assertIsNone(self.complaint())

    def test_older_than_it_says(self):
        self.assertRegex(self.complaint(self.between(6.4, 6.5, Age=20)), "the age is wrong at 6.4")

    def test_another_origin(self):
        self.assertRegex(self.complaint(self.between(7.2, 9.0, BootCounter=1)), "another origin unnoticed at 7.2")
        self.assertRegex(self.complaint(self.between(6.5, 6.97, PositionX=5000)), "another origin unnoticed at 6.5")
        self.assertIsNone(self.complaint(self.between(6.5, 6.97, PositionX=5000, ResetCounter=1)))

    def test_a_pose_without_images(self):
        self.assertRegex(self.complaint(blind=[[6.3, 6.9]]), "a valid pose at 6.6")
        self.assertIsNone(self.complaint(self.between(6.6, 6.97, PoseValid=0), blind=[[6.3, 6.9]]))

    def test_an_end_is_stated(self):
        self.assertRegex(self.complaint(self.between(6.97, 7.0, State=3)), "the last epoch before the end .* has state 3")

    def test_a_start_counts(self):
        self.assertRegex(self.complaint(self.between(7.2, 9.0, BootCounter=3)), "boot counter 3 after the start")

    def test_silence(self):
        self.assertRegex(self.complaint(silent=[[6.5, 7.2]]), "an epoch at 6.6.*where no daemon runs")
        gap = lambda frames, now_s: {} if 6.5 < now_s < 6.7 else frames  # noqa: E731
        self.assertRegex(self.complaint(gap), "no epoch for 0.2")
        self.assertIsNone(self.complaint(gap, held=[[6.5, 6.7]]))


class Images(unittest.TestCase):
    def complaint(self, spoil=lambda events: events, may_miss="0", channel="CAMERA_0"):
        frames = [bytes([number]) * checks.FRAME_BYTES for number in range(10)]
        events = []
        for number, pixels in enumerate(frames):
            head = lcm_log.IMAGE.pack(7_000 + 100 * number, number, 0, -1, -1.0, 320, 240, 320, 0, len(pixels))
            events.append(("CAMERA_0", bytes(8) + head + pixels))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "frames.grey").write_bytes(b"".join(frames))
            (folder / "played").write_text("clock 1 2\n" + "".join(f"{i} {i} {7000 + 100 * i}\n" for i in range(10)))
            lcm_log.write(folder / "run.lcm", spoil(events))
            return checks.images(folder, types.SimpleNamespace(), "run.lcm", "played", "5", may_miss, channel)[0]

    def test_good(self):
        self.assertIsNone(self.complaint())

    def test_missing(self):
        self.assertRegex(self.complaint(lambda e: e[:4] + e[5:]), "frame 4 never came; 1 of 10")
        self.assertIsNone(self.complaint(lambda e: e[:4] + e[5:], may_miss="1"))

    def test_other_camera(self):
        self.assertRegex(self.complaint(channel="CAMERA_1"), "frame 0 never came; 10 of 10")
        both = lambda e: e[:4] + [("CAMERA_1", data) for _, data in e]  # noqa: E731
        self.assertIsNone(self.complaint(both, channel="CAMERA_1"))
        self.assertRegex(self.complaint(both), "frame 4 never came; 6 of 10")

    def test_twice_or_in_another_order(self):
        self.assertRegex(self.complaint(lambda e: e[:4] + e[3:]), "image 4 .* has come already")
        self.assertRegex(self.complaint(lambda e: [e[1], e[0], *e[2:]]), "image 1 .* has come already")

    def test_other_bytes(self):
        self.assertRegex(self.complaint(lambda e: e[:4] + [("CAMERA_0", e[4][1][:-1] + b"\xff")] + e[5:]),
                         "image 4 is not frame 4")

    def test_other_time(self):
        late = lambda e: e[:4] + [("CAMERA_0", lcm_log.with_image(e[4][1], 7_430, b""))] + e[5:]  # noqa: E731
        self.assertRegex(self.complaint(late), "image 4 of time 7430 is of no frame")


class Wired(unittest.TestCase):
    """Forty frames, forwards and backwards; the first twenty are images, 150 ms after they were sent."""

    def complaint(self, order=range(20), late=lambda number: 0, least="10", most_off="2", pixel=None):
        pixels = [bytes([index]) * checks.FRAME_BYTES for index in range(21)]
        indices = [*range(21), *range(19, 0, -1)]
        events = []
        for number, at in enumerate(order):
            utime = 1_000_000 + PERIOD_US * number + late(number)
            data = pixels[indices[at]] if number != pixel else pixels[indices[at]][:-1] + b"\xff"
            head = lcm_log.IMAGE.pack(utime, number, 0, -1, -1.0, 320, 240, 320, 0, len(data))
            events.append(("CAMERA_0", bytes(8) + head + data))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "frames.grey").write_bytes(b"".join(pixels))
            sent = "".join(f"{at} {i} {850_000 + PERIOD_US * at}\n" for at, i in enumerate(indices))
            (folder / "played").write_text("clock 1 2\n" + sent)
            lcm_log.write(folder / "run.lcm", events)
            return checks.wired(folder, types.SimpleNamespace(), "run.lcm", "played", str(PERIOD_US), least, most_off)

    def test_good(self):
        text = "20 images, each a frame, in order, byte for byte, 150 to 150 ms after it was sent; 0 twice and 0 never"
        self.assertEqual(self.complaint(), (None, [text]))

    def test_other_bytes(self):
        self.assertEqual(self.complaint(pixel=7)[0], "image 7 is none of the frames")

    def test_twice_and_never(self):
        off = [0, 1, 1, 3, *range(4, 20)]
        self.assertRegex(self.complaint(off)[1][0], "1 twice and 1 never$")
        self.assertRegex(self.complaint(off, most_off="1")[0], "^1 twice and 1 never of 20 frames, expected at most 1")
        gap = self.complaint([*range(5), *range(7, 20)], late=lambda number: 200_000)
        self.assertRegex(gap[0], "^image 5 is frame 7, the one before was frame 4")

    def test_another_order(self):
        self.assertRegex(self.complaint([0, 1, 2, 4, 3, *range(5, 20)])[0], "^image 4 is frame 3, after frame 4")

    def test_turn(self):
        after_turn = [21, 22, 23, 24, 25]
        late = lambda number: 16 * PERIOD_US  # noqa: E731
        self.assertRegex(self.complaint([*range(15, 21), *after_turn], late)[1][0], "0 twice and 0 never$")
        self.assertRegex(self.complaint([*range(15, 20), *after_turn], late)[1][0], "0 twice and 1 never$")
        self.assertRegex(self.complaint([*range(15, 20), 19, 20, *after_turn], late)[1][0], "1 twice and 0 never$")
        self.assertRegex(self.complaint([*range(15, 20), 22, 23], late, least="5")[0],
                         "^image 5 is frame 18, the one before was frame 19|^image 5 is frame 18, after frame 19")

    def test_time(self):
        self.assertRegex(self.complaint(late=lambda number: -200_000)[0], "^image 0 .* which was not sent just before")
        self.assertRegex(self.complaint(late=lambda number: 600_000)[0], "^image 0 .* which was not sent just before")
        self.assertRegex(self.complaint(late=lambda number: 60_000 * (number > 5))[0], "^image 6 came 160.0 ms after")

    def test_too_few(self):
        self.assertEqual(self.complaint(least="21")[0], "20 images, expected 21")
        self.assertEqual(self.complaint([])[0], "0 images, expected 10")


class Streamed(unittest.TestCase):
    """Ten frames at 20 Hz and as many wheel speeds, streamed at half the pace from 5 s on."""

    def complaint(self, late=lambda number: 0, pixel=None, missing=None, speed=0.0, wheels_late_us=0, wheels=4):
        made, came, turned = [], [], []
        for number in range(10):
            utime = 50_000 * number
            due = 5_000_000 + 2 * utime
            for events, time, last in ((made, utime, 0), (came, due + late(number), number == pixel)):
                pixels = bytes([number]) * (checks.FRAME_BYTES - 1) + bytes([last])
                head = lcm_log.IMAGE.pack(time, number, 0, -1, -1.0, 320, 240, 320, 0, len(pixels))
                events.append(("CAMERA_0", bytes(8) + head + pixels))
            turn = (made, utime, 4 * [1.0]), (turned, due + wheels_late_us, [1.0, 1.0, 1.0, 1.0 + speed])
            for events, time, speeds in turn:
                speeds = speeds[:4 if events is made else wheels]
                head = lcm_log.WHEELS.pack(time, 1.0, -1.0, 0.0, 0.0, len(speeds))
                events.append(("WHEELS", bytes(8) + head + struct.pack(f">{len(speeds)}d", *speeds)))
        if missing is not None:
            del came[missing]
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "said").write_text("yard: frame 0 at 5000000 us of CLOCK_MONOTONIC, 10 frames a second\n")
            for file, events in (("made.lcm", made), ("run.lcm", came), ("out.lcm", turned)):
                lcm_log.write(folder / file, events)
            (folder / "bin").mkdir()
            program = folder / "bin/farpoint"
            program.write_text(f'#!/bin/sh\nfor last; do :; done\ncp {folder}/made.lcm "$last"\n')
            program.chmod(0o755)
            stock = types.SimpleNamespace(build=folder)
            return checks.streamed(folder, stock, "run.lcm", "out.lcm", "said", "320x240", "0.5")[0]

    def test_good(self):
        self.assertIsNone(self.complaint(wheels_late_us=9_000, speed=0.0013))

    def test_other_bytes(self):
        self.assertEqual(self.complaint(pixel=4), "image 4 is not frame 4 of the simulation")

    def test_missing(self):
        self.assertEqual(self.complaint(missing=6), "image 6 is not frame 6 of the simulation")
        self.assertEqual(self.complaint(missing=9), "9 images and 10 wheel speeds came, expected 10 and 10")

    def test_time(self):
        late = self.complaint(late=lambda number: 2 * (number == 3))
        self.assertRegex(late, "^image 3 has time 5300002, was due at 5300000")
        self.assertRegex(self.complaint(wheels_late_us=11_000), "^wheels: time off by 11.0 ms")

    def test_other_speed(self):
        self.assertRegex(self.complaint(speed=0.0015), "^wheels 0: ")
        self.assertRegex(self.complaint(speed=math.nan), "^wheels 0: ")
        self.assertRegex(self.complaint(wheels=3), "^wheels 0: ")


class Bars(unittest.TestCase):
    def complaint(self, spoil=lambda events: events, least="5", size="318x240"):
        row = bytes(round(checks.BARS[8 * x // 318]) for x in range(318))
        events = []
        for number in range(6):
            head = lcm_log.IMAGE.pack(7_000 + 100 * number, number, 0, -1, -1.0, 318, 240, 318, 0, 240 * 318)
            events.append(("CAMERA_0", bytes(8) + head + 240 * row))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            lcm_log.write(folder / "run.lcm", spoil(events))
            return checks.bars(folder, types.SimpleNamespace(), "run.lcm", size, least)[0]

    def test_good(self):
        self.assertIsNone(self.complaint())

    def test_other_pattern_size_order_or_number(self):
        grey = lambda e: e[:4] + [("CAMERA_0", e[4][1][:-240 * 318] + bytes([128]) * 240 * 318)]  # noqa: E731
        self.assertRegex(self.complaint(grey), "^image 4: bar 1 is 128, expected 191")
        self.assertRegex(self.complaint(size="320x240"), "^image 0 has 318x240 pixels, expected 320x240")
        self.assertRegex(self.complaint(lambda e: [e[1], e[0], *e[2:]]), "^image 1 is not later")
        self.assertRegex(self.complaint(least="7"), "^6 images, expected 7")
        self.assertRegex(self.complaint(lambda e: []), "^0 images, expected 5")


class Wheels(unittest.TestCase):
    def complaint(self, spoil=lambda events: events, late_us=2_000, count="10"):
        events, bus = [], []
        for number in range(10):
            raw, time_us = [100 * number - 500 + wheel for wheel in range(4)], 6_000_000 + 50_000 * number
            frames = ("123#" + struct.pack(">hh", *raw[:2]).hex(), "124#" + struct.pack("<hh", *raw[2:]).hex())
            bus += [f"({1e-6 * time_us:.6f}) vcan0 {frame}\n" for frame in frames]
            speeds = [0.01 / 3.6 * one for one in raw]
            utime = time_us - CLOCKS_US[1] + CLOCKS_US[0] + late_us
            head = lcm_log.WHEELS.pack(utime, sum(speeds) / 4, -1.0, 0.0, 0.0, 4)
            events.append(("WHEELS", bytes(8) + head + struct.pack(">4d", *speeds)))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "bus.log").write_text("".join(bus))
            (folder / "played").write_text(f"clock {CLOCKS_US[0]} {CLOCKS_US[1]}\n")
            lcm_log.write(folder / "out.lcm", spoil(events))
            return checks.wheels(folder, types.SimpleNamespace(), "out.lcm", "bus.log", count)[0]

    def test_good(self):
        self.assertIsNone(self.complaint())

    def test_missing_or_too_many(self):
        self.assertRegex(self.complaint(lambda e: e[:4] + e[5:]), "9 WHEELS of 10 pairs")
        self.assertRegex(self.complaint(lambda e: e + e[-1:]), "11 WHEELS of 10 pairs")
        self.assertRegex(self.complaint(count="11"), "10 WHEELS of 10 pairs on the bus, expected 11")

    def test_other_speed_or_order(self):
        other = lambda e: e[:4] + [("WHEELS", e[4][1][:-8] + struct.pack(">d", 1.0))] + e[5:]  # noqa: E731
        self.assertRegex(self.complaint(other), "wheels 4: 1.0000 m/s, expected")
        self.assertRegex(self.complaint(lambda e: [e[1], e[0], *e[2:]]), "wheels 0: .* m/s, expected")

    def test_other_time(self):
        self.assertRegex(self.complaint(late_us=30_000), "time off by 30.0 ms")


class Quiet(unittest.TestCase):
    """Histograms as the kernel writes them."""

    def complaint(self, heap="{ common_pid:          9 } hitcount:         77", function="do_sys_poll", times=300,
                  only=""):
        waits = (f"# event histogram\n#\n\n{{ prev_pid:         11, stacktrace:\n         __schedule+0x2d5/0x9e0\n"
                 f"         {function}+0x1e/0x40\n}} hitcount:        {times}\n")
        calls = "{ common_pid:         11, id:          7 } hitcount:        300\n"
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "threads").write_text("9 fp-mapping\n11 fp-capture\n")
            for event in checks.HEAP:
                text = heap if event == "malloc" else ""
                (folder / f"trace.{event}").write_text(f"# event histogram\n\n{text}\n\nTotals:\n    Dropped: 0\n")
            (folder / "trace.sched_switch").write_text(waits)
            (folder / "trace.sys_enter").write_text(calls)
            return checks.quiet(folder, types.SimpleNamespace(), "trace", "200", "fp-capture=do_sys_poll" + only)

    def test_good(self):
        self.assertEqual(self.complaint(),
                         (None, ["fp-capture: no heap call, 300 waits, all in do_sys_poll; its calls: poll 300"]))

    def test_heap(self):
        self.assertRegex(self.complaint(heap="{ common_pid:         11 } hitcount:          3")[0],
                         "^fp-capture made 3 heap calls")

    def test_other_wait(self):
        self.assertRegex(self.complaint(function="futex_wait")[0],
                         "^fp-capture slept 300 times elsewhere than in do_sys_poll: __schedule < futex_wait")

    def test_other_call(self):
        self.assertIsNone(self.complaint(only="=poll")[0])
        self.assertRegex(self.complaint(only="=futex")[0], "^fp-capture made other calls than futex: poll 300")

    def test_no_evidence(self):
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "trace.malloc"
            self.assertRaisesRegex(checks.NotMade, "no trace.malloc", checks.histogram, path)
            path.write_text("Totals:\n    Hits: 9\n    Entries: 1\n    Dropped: 3\n")
            self.assertRaisesRegex(checks.NotMade, "trace.malloc: 3 events were dropped", checks.histogram, path)

    def test_seldom_or_not_there(self):
        self.assertRegex(self.complaint(times=199)[0], "^fp-capture slept 199 times, expected 200")


class Scenarios(unittest.TestCase):
    def test_can_be_read(self):
        known = scenario.read_all(ROOT / "tools/hil/scenarios")
        self.assertGreater(len(known), 5)
        for one in known:
            self.assertIn(one.form, ("short", "long"), one.name)
            self.assertIn("BROKEN", one.script, one.name)
            for name, *_ in one.checks:
                self.assertIn(name, checks.CHECKS, one.name)

    def test_fails_as_it_says(self):
        one = scenario.Scenario("a", "", "", broken_says="^frame 5 never")
        self.assertTrue(one.fails_as_it_says("frame 5 never came"))
        self.assertFalse(one.fails_as_it_says("the scenario did not end in time"))
        self.assertFalse(one.fails_as_it_says(None))


class Results(unittest.TestCase):
    """What the bench prints of a scenario: as a row, and as JSON."""

    def setUp(self):
        loader = importlib.machinery.SourceFileLoader("bench", str(ROOT / "tools/hil/bench"))
        self.bench = importlib.util.module_from_spec(importlib.util.spec_from_loader("bench", loader))
        loader.exec_module(self.bench)
        self.one = scenario.Scenario("can", "Odometry.", "", broken="an epoch is cut", broken_says="^counter")

    def result(self, complaint, self_test):
        found = self.bench.result_of(self.one, complaint, ["50 Hz", "age right"], "12", self_test)
        stream = io.StringIO()
        self.bench.print_row(self.one, found, stream)
        self.assertEqual(json.loads(json.dumps(found)), found)
        self.assertEqual((found["name"], found["title"], found["broken"]), ("can", "Odometry.", "an epoch is cut"))
        return found["well"], found["text"], " ".join(stream.getvalue().split())

    def test_a_good_run_has_its_figures(self):
        self.assertEqual(self.result(None, False), (True, "50 Hz; age right", "can ok 12 50 Hz; age right"))

    def test_a_bad_run_has_its_complaint(self):
        self.assertEqual(self.result("counter 6 after 4", False)[:2], (False, "counter 6 after 4"))

    def test_a_broken_run_has_the_complaint_that_it_names(self):
        self.assertEqual(self.result("counter 6 after 4", True)[:2], (True, "counter 6 after 4"))
        well, text, row = self.result("the machine did not come to it", True)
        self.assertEqual((well, text), (False, "the machine did not come to it"))
        self.assertIn("FAILED 12 the machine did not come to it expected: ^counter", row)
        self.assertEqual(self.result(None, True)[:2], (False, "did not fail"))


if __name__ == "__main__":
    unittest.main()
