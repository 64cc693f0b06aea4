#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: patient_timeout.py --preserve-status SECONDS COMMAND...

Stands in for 'timeout' on a loaded machine: SECONDS count from the first line of COMMAND's output that holds the text of
$FARPOINT_UNTIL (waited for at most two minutes). Then SIGTERM; the status is COMMAND's. Other options go to the true one.
"""

import os
import subprocess
import sys
import threading

MOST_S = 120


def main():
    if sys.argv[1] != "--preserve-status":  # another program's use of it
        os.execv("/usr/bin/timeout", ["timeout", *sys.argv[1:]])
    seconds, command = float(sys.argv[2]), sys.argv[3:]
    seen = threading.Event()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def copy():
        for line in child.stdout:
            print(line, end="", flush=True)
            if os.environ["FARPOINT_UNTIL"] in line:
                seen.set()
        seen.set()  # it ended by itself

    copying = threading.Thread(target=copy)
    copying.start()
    seen.wait(MOST_S)
    try:
        child.wait(seconds)
    except subprocess.TimeoutExpired:
        child.terminate()
    copying.join()
    return child.wait()


if __name__ == "__main__":
    sys.exit(main())
