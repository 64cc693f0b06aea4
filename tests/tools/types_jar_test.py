#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: types_jar_test.py JAR TYPES_FOLDER

The jar holds the class of every LCM type and nothing else, for Java 11 and later.
"""

import pathlib
import re
import sys
import zipfile

JAVA_11 = 55  # version number of its class files


def expected_classes(folder):
    for file in sorted(pathlib.Path(folder).glob("*.lcm")):
        text = re.sub(r"//.*", "", file.read_text())
        package = re.search(r"^\s*package\s+(\w+)\s*;", text, re.MULTILINE).group(1)
        for name in re.findall(r"^\s*struct\s+(\w+)", text, re.MULTILINE):
            yield f"{package}/{name}.class"


def problems(jar, folder):
    expected = set(expected_classes(folder))
    if len(expected) < 10:
        yield f"{folder}: only {len(expected)} types"
    with zipfile.ZipFile(jar) as archive:
        present = {name for name in archive.namelist() if name.endswith(".class")}
        yield from (f"{jar}: no {name}" for name in sorted(expected - present))
        yield from (f"{jar}: {name} is no type" for name in sorted(present - expected))
        for name in sorted(expected & present):
            head = archive.read(name)[:8]
            version = int.from_bytes(head[6:8], "big")
            if head[:4] != b"\xca\xfe\xba\xbe" or version > JAVA_11:
                yield f"{jar}: {name}: no class for Java 11 (version {version})"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    found = list(problems(sys.argv[1], sys.argv[2]))
    for problem in found:
        print("types_jar_test.py: " + problem)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
