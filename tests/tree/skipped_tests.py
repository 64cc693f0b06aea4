#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: skipped_tests.py RESULTS.xml      RESULTS.xml: written by ctest --output-junit

Where the recordings are there and tools/deps has run, only a missing permission excuses a skipped test. Prints the
others with their reason; status 1 where there is one.
"""

import re
import sys
import xml.etree.ElementTree

EXCUSED = re.compile(r"no permission", re.IGNORECASE)
REASON = re.compile(r"^\S+:\d+: Skipped\n(.*?)^\[  SKIPPED \]", re.MULTILINE | re.DOTALL)


def unexcused(results: str):
    """(name, reason) of every skipped or disabled test that has no excuse."""
    found = []
    for case in xml.etree.ElementTree.fromstring(results).iter("testcase"):
        if case.get("status") == "run" or case.get("status") == "fail":
            continue
        reasons = REASON.findall(case.findtext("system-out") or "")
        reason = " ".join(" ".join(reasons).split()) or f"no reason given, status '{case.get('status')}'"
        if not EXCUSED.search(reason):
            found.append((case.get("name"), reason))
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8", errors="replace") as file:
        found = unexcused(file.read())
    for name, reason in found:
        print(f"skipped without need: {name}: {reason}")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
