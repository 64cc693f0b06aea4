#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks READMEs: every folder has one, and every path that one names exists.

usage: check_readmes.py [FOLDER]      Prints one line a finding; status 1 where there is one.

A path is a relative link, or what stands in backticks and begins with a top-level folder, ends in a slash, or is the
name of a source file. A path without a suffix may also name a unit (x.h, x.cc); a source file without folders may lie
anywhere in the tree.
"""

import pathlib
import re
import sys

TOPS = ("slam", "ipc", "drivers", "daemon", "systemd", "config", "tools", "tests")
# Folders below these have a README of their own; a deeper folder, and one of another place, is named by one above it.
OWN_README = ("slam", "drivers", "daemon")
LINK = re.compile(r"\]\(([^)#:\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
SUFFIXES = {".h", ".cc", ".py", ".sh", ".inl"}
# In backticks and no path: options, placeholders, patterns, several words.
NO_PATH = re.compile(r"[<>*$~=,:{}()\s]|\.\.\.|^-")


def readmes(root: pathlib.Path):
    """READMEs, and the texts beside them."""
    found = [root / "README.md"]
    for top in TOPS:
        found += sorted(path for path in (root / top).rglob("*.md") if "node_modules" not in path.parts)
    return [path for path in found if path.is_file()]


def is_there(root: pathlib.Path, folder: pathlib.Path, name: str) -> bool:
    for base in (root, folder):
        place = base / name
        if place.exists() or any(place.parent.glob(place.name + ".*")):
            return True
    return False


def names_a_path(name: str) -> bool:
    if NO_PATH.search(name):
        return False
    first = name.split("/")[0]
    return "/" in name.rstrip("/") and first in TOPS or name.endswith("/") or pathlib.PurePath(name).suffix in SUFFIXES


def check_paths(root: pathlib.Path):
    sources = {path.name for top in TOPS for path in (root / top).rglob("*") if path.suffix in SUFFIXES}
    for readme in readmes(root):
        text, folder = FENCE.sub("", readme.read_text()), readme.parent
        where = readme.relative_to(root).as_posix()
        for link in LINK.findall(text):
            if not (folder / link).exists():
                yield f"{where}: link to {link}, which is not there"
        for name in CODE.findall(text):
            if not names_a_path(name) or is_there(root, folder, name):
                continue
            if "/" not in name and name in sources:
                continue
            yield f"{where}: `{name}` is not there"


def named_above(root: pathlib.Path, folder: pathlib.Path) -> bool:
    """True where a README of a folder above names this one, as `name/` or as a link."""
    for above in folder.parents:
        readme = above / "README.md"
        if readme.is_file():
            path = folder.relative_to(above).as_posix()
            text = readme.read_text()
            if f"`{path}/`" in text or f"`{folder.name}/`" in text or f"]({path}/" in text:
                return True
            if re.search(f"`{re.escape(folder.relative_to(root).as_posix())}/?`", text):
                return True
        if above == root:
            return False
    return False


def holds_files(folder: pathlib.Path) -> bool:
    return any(path.is_file() for path in folder.iterdir())


def check_folders(root: pathlib.Path):
    if not (root / "README.md").is_file():
        yield "README.md: the root has none"
    for top in TOPS:
        if not (root / top).is_dir():
            continue
        for folder in [root / top, *sorted(path for path in (root / top).rglob("*") if path.is_dir())]:
            path = folder.relative_to(root)
            if {"node_modules", "__pycache__"} & set(path.parts) or not holds_files(folder):
                continue
            own = len(path.parts) == 1 or len(path.parts) == 2 and top in OWN_README
            if (folder / "README.md").is_file() or not own and named_above(root, folder):
                continue
            yield f"{path.as_posix()}: no README.md" + ("" if own else ", and none above names it")


def check(root: pathlib.Path):
    return [*check_paths(root), *check_folders(root)]


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2])
    findings = check(root)
    for finding in findings:
        print(finding)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
