# SPDX-License-Identifier: Apache-2.0
"""A receiver of the daemon's CAN frames that uses the DBC alone, without a line of the sender's code."""

import dataclasses
import pathlib
import re

MESSAGE = re.compile(r"^BO_ (\d+) (\w+): (\d+) \w+$")
SIGNAL = re.compile(r"^ SG_ (\w+) : (\d+)\|(\d+)@1([+-]) \(([^,]+),([^)]+)\)")
ATTRIBUTE = re.compile(r'^BA_ "(E2EDataId|E2EProfile|GenMsgCycleTime)" BO_ (\d+) (\d+);')
EXTENDED = 1 << 31  # of an identifier of 29 bits in a DBC file
STATE_STOPPED = 8
LEAST_EPOCHS = 50
NOT_TRACKING = {0, 1, 2, 5, 6, 7, 8}
AGE_NOT_KNOWN = 65534  # and above: too old, or not available


@dataclasses.dataclass
class Message:
    name: str
    size: int
    data_id: int = 0
    profile: int = 1
    cycle_ms: int = 0
    signals: dict = dataclasses.field(default_factory=dict)


def layout(text):
    """identifier -> Message, of the text of a DBC file (little-endian signals)."""
    messages, current = {}, None
    for line in text.splitlines():
        if found := MESSAGE.match(line):
            current = messages[int(found[1])] = Message(found[2], int(found[3]))
        elif found := SIGNAL.match(line):
            current.signals[found[1]] = (int(found[2]), int(found[3]), found[4] == "-", float(found[5]))
        elif found := ATTRIBUTE.match(line):
            field = {"E2EDataId": "data_id", "E2EProfile": "profile", "GenMsgCycleTime": "cycle_ms"}[found[1]]
            setattr(messages[int(found[2])], field, int(found[3]))
    return messages


def raw(message, name, data):
    start, bits, _, _ = message.signals[name]
    return int.from_bytes(data, "little") >> start & (1 << bits) - 1


def value(message, name, data):
    _, bits, signed, factor = message.signals[name]
    number = raw(message, name, data)
    return (number - (1 << bits) if signed and number >> bits - 1 else number) * factor


def crc8(data_id, data):
    """AUTOSAR E2E profile 1: polynomial 0x1D over the Data ID's low and high byte and the data; start and end 0."""
    crc = 0
    for byte in (data_id & 255, data_id >> 8, *data):
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (0x1D if crc & 0x80 else 0)) & 255
    return crc


assert crc8(0x123, bytes(7)) == 0xCC  # the vector of the design


def crc16(data_id, data):
    """AUTOSAR E2E profile 5: polynomial 0x1021, start 0xFFFF, over the data and the Data ID's low and high byte."""
    crc = 0xFFFF
    for byte in (*data, data_id & 255, data_id >> 8):
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return crc


assert crc16(0x1234, bytes(6)).to_bytes(2, "little") == bytes([0x1C, 0xCA])  # the vector of the profile


def has_right_crc(message, data):
    crc = crc16(message.data_id, data[2:]) if message.profile == 5 else crc8(message.data_id, data[1:])
    return raw(message, "CRC", data) == crc


def seal(message, data):
    """Puts the right CRC into a frame."""
    if message.profile == 5:
        data[:2] = crc16(message.data_id, data[2:]).to_bytes(2, "little")
    else:
        data[0] = crc8(message.data_id, data[1:])
    return data


@dataclasses.dataclass
class Epoch:
    """The status frame and those that followed it."""
    time_s: float
    counter: int
    frames: dict


def lines_of(path):
    """(time, frame) of what candump -L wrote."""
    for line in pathlib.Path(path).read_text().splitlines():
        if line.count(" ") != 2 or "#" not in line:
            continue  # cut off where candump was stopped
        time, _, frame = line.split()
        yield float(time.strip("()")), frame


def frames_of(path):
    """(time, identifier, data) of what candump -L wrote; of CAN FD, ID##FLAGSDATA, as of classic frames, ID#DATA."""
    for time, frame in lines_of(path):
        identifier, data = frame.split("##" if "##" in frame else "#")
        number = int(identifier, 16) | (EXTENDED if len(identifier) == 8 else 0)
        yield time, number, bytes.fromhex(data[1:] if "##" in frame else data)


def classic_frame(path):
    """A complaint of the first frame that is not one of CAN FD; None where all are."""
    return next((f"a classic frame at {time:.3f}" for time, frame in lines_of(path) if "##" not in frame), None)


class Receiver:
    def __init__(self, messages):
        self.messages = messages
        self.status = next(i for i, message in messages.items() if "State" in message.signals)
        self.counters = 256 if messages[self.status].profile == 5 else 15

    def epochs(self, path):
        """(complaint or None, epochs): frames grouped as they came, each of known layout and right CRC."""
        found = []
        for time_s, identifier, data in frames_of(path):
            message = self.messages.get(identifier)
            if message is None or len(data) != message.size:
                return f"a frame {identifier:X} of {len(data)} bytes is not in the DBC", []
            if not has_right_crc(message, data):
                return f"wrong CRC of {message.name} at {time_s:.3f}", []
            if identifier == self.status or not found:
                found.append(Epoch(time_s, raw(message, "Counter", data), {}))
            found[-1].frames[identifier] = data
        # The first and the last may be cut off.
        return None, found[1:-1]

    def check(self, path, stamps_us, clocks_us, rate_hz, expectations):
        """Rate, counter, CRC and age; `expectations`: 'valid' (poses came), 'steady' (no gap), 'fd' (CAN FD's frames)."""
        complaint, epochs = self.epochs(path)
        if "fd" in expectations:
            complaint = complaint or classic_frame(path)
        if complaint:
            return complaint, []
        if len(epochs) < LEAST_EPOCHS:
            return f"only {len(epochs)} epochs came", []
        for step in (self._complete, self._counters):
            if complaint := step(epochs):
                return complaint, []
        complaint, rate = self._rate(epochs, rate_hz, "steady" in expectations)
        if complaint:
            return complaint, []
        complaint, age = self._ages(epochs, stamps_us, clocks_us)
        if complaint:
            return complaint, []
        valid = sum(value(self.messages[self.status], "PoseValid", e.frames[self.status]) for e in epochs)
        if "valid" in expectations and valid < LEAST_EPOCHS:
            return f"only {valid:.0f} epochs with a valid pose", []
        return self._invalid_is_empty(epochs), [f"{len(epochs)} epochs, {valid:.0f} valid, {rate}, {age}"]

    def _every(self, identifier):
        """The frame goes out with every Nth epoch; returns N."""
        return round(self.messages[identifier].cycle_ms / self.messages[self.status].cycle_ms)

    def _complete(self, epochs):
        always = {identifier for identifier in self.messages if self._every(identifier) == 1}
        for epoch in epochs:
            if not always <= set(epoch.frames):
                return f"{len(always & set(epoch.frames))} frames of the epoch at {epoch.time_s:.3f}, expected {len(always)}"
        return None

    def _counters(self, epochs):
        """Each frame counts by itself; those of every epoch with the status frame."""
        last = {}
        for epoch in epochs:
            for identifier, data in epoch.frames.items():
                counter = raw(self.messages[identifier], "Counter", data)
                expected = (last.get(identifier, counter - 1) + 1) % self.counters
                if counter != expected % self.counters:
                    return f"counter {counter} after {last[identifier]} at {epoch.time_s:.3f}"
                if self._every(identifier) == 1 and counter != epoch.counter:
                    return f"counter {counter} in the epoch {epoch.counter} at {epoch.time_s:.3f}"
                last[identifier] = counter
        return None

    @staticmethod
    def _rate(epochs, rate_hz, steady):
        found_hz = (len(epochs) - 1) / (epochs[-1].time_s - epochs[0].time_s)
        gaps = sorted(after.time_s - before.time_s for before, after in zip(epochs, epochs[1:]))
        text = f"{found_hz:.1f} Hz, gap at most {1e3 * gaps[-1]:.0f} ms"
        if found_hz < 0.9 * rate_hz:
            return f"{text}, expected {rate_hz:.0f} Hz", text
        if steady and gaps[-1] > 2.0 / rate_hz:
            return f"{text}, expected at most {2e3 / rate_hz:.0f} ms", text
        return None, text

    def _ages(self, epochs, stamps_us, clocks_us):
        """The time of arrival less the age is the time of an image that was played."""
        monotonic_us, real_us = clocks_us
        stamps_s = [1e-6 * (stamp - monotonic_us + real_us) for stamp in stamps_us]
        errors_s, images = [], set()
        for epoch in epochs:
            data = epoch.frames[self.status]
            if raw(self.messages[self.status], "Age", data) >= AGE_NOT_KNOWN:
                continue
            taken_s = epoch.time_s - value(self.messages[self.status], "Age", data)
            nearest = min(range(len(stamps_s)), key=lambda i: abs(stamps_s[i] - taken_s))
            errors_s.append(abs(stamps_s[nearest] - taken_s))
            images.add(nearest)
        errors_s.sort()
        if len(errors_s) < LEAST_EPOCHS:
            return f"only {len(errors_s)} epochs with an age", ""
        p95_s = errors_s[int(0.95 * len(errors_s))]
        text = f"age off by p95 {1e3 * p95_s:.1f} ms, max {1e3 * errors_s[-1]:.1f} ms over {len(images)} images"
        return (None if p95_s <= 0.01 else f"the age is wrong: {text}"), text

    def _invalid_is_empty(self, epochs):
        """Without a valid pose no position and no angle is sent."""
        attitude = next(i for i, m in self.messages.items() if "Heading" in m.signals)
        for epoch in epochs:
            status = epoch.frames[self.status]
            valid = value(self.messages[self.status], "PoseValid", status)
            not_available = raw(self.messages[attitude], "Heading", epoch.frames[attitude]) == 0x8000
            if not valid and not not_available:
                return f"a heading without a valid pose at {epoch.time_s:.3f}"
            if valid and raw(self.messages[self.status], "State", status) in NOT_TRACKING:
                return f"a valid pose in a state that has none at {epoch.time_s:.3f}"
        return None
