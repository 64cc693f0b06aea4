# SPDX-License-Identifier: Apache-2.0
"""How the resident memory of a process divides, by /proc/PID/smaps."""

import re

HEAD = re.compile(r"^[0-9a-f]+-[0-9a-f]+ \S+ \S+ \S+ \d+\s*(?P<file>.*)$")
SIZE = re.compile(r"^(?P<key>Rss|Locked): +(?P<kb>\d+) kB$")


def divided(smaps):
    """MB (10^6 bytes): libraries and program, other files such as a log that is mapped, all else (heap, pools, stacks),
    and what of the whole is locked. Locked counts a shared page in part, as the kernel does."""
    bytes_of, part = {"libraries": 0, "files": 0, "pools_and_stacks": 0, "locked": 0}, None
    for line in smaps.read_text().splitlines():
        head, size = HEAD.match(line), SIZE.match(line)
        if head:
            part = part_of(head["file"])
        elif size:
            bytes_of["locked" if size["key"] == "Locked" else part] += 1024 * int(size["kb"])
    return {f"{name}_mb": 1e-6 * count for name, count in bytes_of.items()}


def part_of(file):
    if not file.startswith("/") or file.startswith("/dev/zero"):
        return "pools_and_stacks"
    return "libraries" if re.search(r"\.so(\.|$)", file) or file.endswith("/farpointd") else "files"
