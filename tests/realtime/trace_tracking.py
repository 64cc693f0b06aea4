#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: trace_tracking.py FARPOINTD LOG [SPEED]

Runs a threaded replay under strace and lists the system calls of the tracking thread from the frame on that first
tracked a settled map. Status 0 where there is none but futex, its one wait; 1 otherwise; 2 where it cannot be told.
"""

import collections
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# "PID TIME name(arguments" of strace -f -ttt; resumed calls were listed when they began.
CALL = re.compile(r"^(\d+) +([\d.]+) (\w+)\((.*)$")


def trace(farpointd, log, speed, folder):
    listing = pathlib.Path(folder) / "trace"
    run = subprocess.run(
        ["strace", "-f", "-ttt", "-s", "200", "-o", str(listing), farpointd, "--replay", log, "--speed", speed,
         "--output", str(pathlib.Path(folder) / "out.lcm"), "--set", "log.level=debug"],
        capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"trace_tracking.py: {farpointd} ended with {run.returncode}: {run.stderr.strip()[-500:]}")
    return listing.read_text(errors="replace").splitlines()


def main():
    if len(sys.argv) not in (3, 4):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    if shutil.which("strace") is None:
        print("trace_tracking.py: strace is not installed", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        lines = trace(sys.argv[1], sys.argv[2], sys.argv[3] if len(sys.argv) == 4 else "1", folder)
    calls = [match.groups() for match in map(CALL.match, lines) if match]
    # The thread that starts the others writes their names.
    thread = None
    settled = ended = None
    for _, time, name, arguments in calls:
        if name in ("openat", "open") and (found := re.search(r'/proc/self/task/(\d+)/comm', arguments)):
            task = found.group(1)
        elif name == "write" and '"fp-tracking"' in arguments:
            thread = task
        elif name == "write" and "-> tracking (" in arguments and settled is None:
            settled = float(time)
    if thread is None or settled is None:
        print("trace_tracking.py: no tracking thread, or it never tracked a settled map", file=sys.stderr)
        return 2
    own = [(float(time), name, arguments) for pid, time, name, arguments in calls if pid == thread]
    # Its last calls are the end of the thread: it tells the others, and gives back its stack.
    waits = [time for time, name, arguments in own if name == "futex" and "FUTEX_WAIT" in arguments]
    ended = waits[-1]
    counts = collections.Counter(name + (" wait" if "FUTEX_WAIT" in arguments else "")
                                 for time, name, arguments in own if settled < time <= ended)
    for name, count in counts.most_common():
        print(f"{count:8d} {name}")
    return 0 if set(counts) == {"futex wait"} else 1


if __name__ == "__main__":
    sys.exit(main())
