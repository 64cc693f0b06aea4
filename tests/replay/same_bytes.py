#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: same_bytes.py record BIN LOGS OUT       replays every log of the folder LOGS in lockstep, results into OUT
       same_bytes.py compare BEFORE AFTER [TYPES]  compares two such folders; status 1 where they differ

The safety net of a change that must not change what the estimator computes. BIN is a build's bin folder, LOGS holds
recorded LCM logs (farpoint import, farpoint simulate). Compared byte for byte: both trajectories, the CAN log and
every channel of the output log except TIMING. STATUS and SUMMARY are compared field by field, except build, hashes,
configuration and sizes of memory; TYPES is the folder ipc/types of BEFORE where that had other fields.
"""

import collections
import hashlib
import pathlib
import re
import struct
import subprocess
import sys

SYNC = 0xEDA1DA01
TYPES = pathlib.Path(__file__).resolve().parents[2] / "ipc" / "types"
# These carry measured times.
LEFT_OUT = {"FARPOINT_TIMING"}
BY_FIELD = {"FARPOINT_STATUS": "status_t", "FARPOINT_SUMMARY": "summary_t"}
# What may differ between two builds that compute the same.
OTHER_BUILD = {"build", "configuration", "configuration_hash", "calibration_hash", "memory_pool_bytes"}
FORMATS = {"int8_t": "b", "byte": "B", "boolean": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q", "float": "f",
           "double": "d"}


class Types:
    """Decodes messages by the text of their .lcm files."""

    def __init__(self, folder):
        self.folder, self.known = folder, {}

    def members(self, name):
        if name not in self.known:
            text = re.sub(r"//[^\n]*", "", (self.folder / f"{name}.lcm").read_text())
            body = text[text.index("{") + 1:text.rindex("}")]
            found = []
            for statement in body.split(";"):
                words = statement.split(None, 1)
                if len(words) < 2 or words[0] == "const":
                    continue
                for member in words[1].split(","):
                    label, *sizes = re.split(r"[\[\]]+", member.strip())
                    found.append((words[0].removeprefix("farpoint."), label, [s for s in sizes if s]))
            self.known[name] = found
        return self.known[name]

    def decode(self, name, data, at):
        fields = {}
        for kind, label, sizes in self.members(name):
            lengths = [int(size) if size.isdigit() else fields[size] for size in sizes]
            count = 1
            for length in lengths:
                count *= length
            values = []
            for _ in range(count):
                value, at = self.value(kind, data, at)
                values.append(value)
            fields[label] = values if sizes else values[0]
        return fields, at

    def value(self, kind, data, at):
        if kind in FORMATS:
            form = ">" + FORMATS[kind]
            return struct.unpack_from(form, data, at)[0], at + struct.calcsize(form)
        if kind == "string":
            size = struct.unpack_from(">i", data, at)[0]
            return data[at + 4:at + 3 + size].decode(), at + 4 + size
        return self.decode(kind, data, at)


def events(path):
    """Channel and payload of every event of an LCM log."""
    data, at = path.read_bytes(), 0
    while at < len(data):
        sync, _, _, channel_size, size = struct.unpack_from(">IqqII", data, at)
        if sync != SYNC:
            sys.exit(f"{path}: no event at byte {at}")
        at += 28 + channel_size + size
        yield data[at - size - channel_size:at - size].decode(), data[at - size:at]


def channels(path, types):
    """What is compared of an LCM log: a hash a channel, a list of values a field."""
    hashes, counts = collections.defaultdict(hashlib.sha256), collections.Counter()
    for channel, message in events(path):
        if channel in LEFT_OUT:
            continue
        counts[channel] += 1
        if channel not in BY_FIELD:
            hashes[channel].update(struct.pack(">I", len(message)) + message)
            continue
        for field, value in types.decode(BY_FIELD[channel], message, 8)[0].items():
            if field not in OTHER_BUILD:
                hashes[f"{channel}.{field}"].update(repr(value).encode())
    found = {f"{name} messages": str(count) for name, count in counts.items()}
    found.update({name: digest.hexdigest() for name, digest in hashes.items()})
    return found


def record(binaries, logs, out):
    out.mkdir(parents=True, exist_ok=True)
    for log in sorted(logs.glob("*.lcm")):
        base = out / log.stem
        subprocess.run([binaries / "farpointd", "--replay", log, "--lockstep", "--output", f"{base}.out.lcm",
                        "--trajectory", f"{base}.final.tum", "--live-trajectory", f"{base}.live.tum", "--can-log",
                        f"{base}.candump", "--set", "log.level=warning"], check=True)
        print(f"recorded {log.stem}", flush=True)


def facts(folder, types):
    found = {}
    for path in sorted(folder.glob("*.*")):
        if path.suffix == ".lcm":
            found.update({f"{path.name} {channel}": text for channel, text in channels(path, types).items()})
        else:
            found[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def compare(before, after, types=TYPES):
    old, new = facts(before, Types(types)), facts(after, Types(TYPES))
    # A field that only one of them has was added or taken away; anything else that is missing is a difference.
    common = {name for name in old | new if name in old and name in new}
    for name in sorted((old.keys() | new.keys()) - common):
        if not any(f" {channel}." in name for channel in BY_FIELD):
            common.add(name)
    differences = [name for name in sorted(common) if old.get(name) != new.get(name)]
    for name in differences:
        print(f"differs: {name}: {old.get(name, 'not there')[:12]} -> {new.get(name, 'not there')[:12]}")
    print(f"{len(common)} compared, {len(differences)} differ")
    return 1 if differences or not common else 0


def main():
    if len(sys.argv) == 5 and sys.argv[1] == "record":
        return record(*map(pathlib.Path, sys.argv[2:]))
    if len(sys.argv) in (4, 5) and sys.argv[1] == "compare":
        return compare(*map(pathlib.Path, sys.argv[2:]))
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
