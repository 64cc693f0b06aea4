#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: unit_test.py UNIT FARPOINTD

The service unit: systemd-analyze verify has nothing to say (it returns 0 even for unknown keys, so its standard error
counts), and the exposure is at most 2.0. Status 77 where there is no systemd-analyze.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

MAX_EXPOSURE = 20  # tenths
HIGHEST_PRIORITY = 50  # of capture: daemon/system/core_plan.cc


def main():
    unit, program = pathlib.Path(sys.argv[1]), sys.argv[2]
    if shutil.which("systemd-analyze") is None:
        print("unit_test.py: no systemd-analyze (package systemd)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        # Verified as installed, but with the program where it is now.
        copy = pathlib.Path(folder) / unit.name
        text = unit.read_text()
        if "ExecStart=/usr/bin/farpointd --set realtime.profile=vehicle\n" not in text:
            print("unit_test.py: the unit does not start /usr/bin/farpointd with a vehicle's priorities and cores")
            return 1
        limit = re.search(r"^LimitRTPRIO=(\d+)$", text, re.MULTILINE)
        if limit is None or int(limit.group(1)) < HIGHEST_PRIORITY:
            print(f"unit_test.py: LimitRTPRIO is below {HIGHEST_PRIORITY}, which the profile 'vehicle' asks for")
            return 1
        copy.write_text(text.replace("/usr/bin/farpointd", program))
        verify = subprocess.run(["systemd-analyze", "verify", str(copy)], capture_output=True, text=True)
        security = subprocess.run(["systemd-analyze", "security", "--offline=true", f"--threshold={MAX_EXPOSURE}",
                                   "--no-pager", str(copy)], capture_output=True, text=True)
        # The checks see a mistake where there is one.
        copy.write_text(text.replace("[Service]\n", "[Service]\nWatchdogSecs=2\n").replace("/usr/bin/farpointd", program))
        wrong = subprocess.run(["systemd-analyze", "verify", str(copy)], capture_output=True, text=True)
    print(security.stdout.strip().splitlines()[-1] if security.stdout.strip() else security.stderr)
    problems = []
    if verify.returncode != 0 or verify.stderr.strip():
        problems.append("verify: " + verify.stderr.strip())
    if security.returncode != 0:
        problems.append(f"the exposure is above {MAX_EXPOSURE / 10}")
    if "WatchdogSecs" not in wrong.stderr:
        problems.append("verify does not notice an unknown key: " + wrong.stderr.strip())
    for problem in problems:
        print("unit_test.py: " + problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
