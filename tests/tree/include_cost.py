#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: include_cost.py [N]      Prints the N (10) headers that most translation units include, directly or not."""

import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOPS = ("slam", "ipc", "drivers", "daemon", "tools", "tests")
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def direct_includes(root: pathlib.Path, name: str):
    return [found for found in INCLUDE.findall((root / name).read_text()) if (root / found).is_file()]


def users_by_header(root: pathlib.Path):
    """(number of units, Counter of the units that each header reaches)."""
    units = [path.relative_to(root).as_posix() for top in TOPS for path in (root / top).rglob("*.cc")]
    direct, users = {}, collections.Counter()
    for unit in units:
        seen, todo = set(), [unit]
        while todo:
            name = todo.pop()
            if name not in direct:
                direct[name] = direct_includes(root, name)
            for other in direct[name]:
                if other not in seen:
                    seen.add(other)
                    todo.append(other)
        users.update(seen)
    return len(units), users


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    units, users = users_by_header(ROOT)
    print(f"{units} units")
    for header, number in users.most_common(count):
        print(f"{number:>4}  {header}")


if __name__ == "__main__":
    main()
