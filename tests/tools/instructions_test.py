#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: instructions_test.py ROOT BUILD      status 1 where a frame or a keyframe takes more instructions than before

A rendered world's first seconds under callgrind, against the table of tests/results/instructions.json. No part may take
over 5 % more than the table says. `tools/results --only instructions` makes the table anew, where more work is meant.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
MOST = 1.05


def skip(why):
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


def grown(before, now):
    """Lines about each part that takes more than it may."""
    return [f"{unit}, {part}: {now[unit][part]:.0f} thousand instructions, at most {MOST * value:.0f} expected"
            for unit in ("frame", "keyframe") for part, value in before[unit].items() if now[unit][part] > MOST * value]


def main():
    if len(sys.argv) != 3:
        print(__doc__, end="", file=sys.stderr)
        return 2
    root, build = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    if shutil.which("valgrind") is None:
        skip("no valgrind (tools/deps)")
    sys.path.insert(0, str(root / "tools"))
    from result_tables import manifest  # pylint: disable=import-outside-toplevel
    (row,) = manifest.find("instructions").rows
    before = json.loads((root / "tests/results/instructions.json").read_text())["rows"][row.label]
    with tempfile.TemporaryDirectory(prefix="farpoint_instructions_") as folder:
        printed = ""
        for command in row.commands:
            words = command.format(bin=build / "bin").split()
            if words[0].startswith("tools/"):
                words = [str(root / words[0]), *words[1:], "--bin", str(build / "bin")]
            done = subprocess.run(words, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
            printed = done.stdout
        now = json.loads(printed)
    if now["simd"] != before["simd"]:
        skip(f"the kernels of {now['simd']} run here; the table holds those of {before['simd']}")
    print(json.dumps(now))
    complaints = grown(before, now)
    print("\n".join(complaints))
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
