#!/usr/bin/env python3
"""The tree is the architecture: checks which folder may include which, and the length of files.

usage: check_tree.py [FOLDER]      Prints one line a finding; status 1 where there is one.
"""

import pathlib
import re
import sys

# What each folder may include besides itself. Arrows run one way:
# geometry <- image <- map <- solver <- {tracking, mapping, loops, fusion} <- the facade <- daemon.
# "slam" is the facade: the files directly in slam/. "types" is what lcm-gen made.
ALLOWED = {
    "slam/geometry": set(),
    "slam/image": {"slam/geometry"},
    "slam/map": {"slam/geometry", "slam/image"},
    "slam/solver": {"slam/geometry", "slam/image", "slam/map"},
    "slam/tracking": {"slam/geometry", "slam/image", "slam/map", "slam/solver"},
    "slam/mapping": {"slam/geometry", "slam/image", "slam/map", "slam/solver"},
    "slam/loops": {"slam/geometry", "slam/image", "slam/map", "slam/solver"},
    "slam/fusion": {"slam/geometry", "slam/image", "slam/map", "slam/solver"},
    "slam": {"slam/geometry", "slam/image", "slam/map", "slam/solver", "slam/tracking", "slam/mapping", "slam/loops",
             "slam/fusion"},
    "ipc": {"types"},
    "drivers": {"ipc", "types"},
    "daemon": {"slam", "ipc", "drivers", "types", "build"},
    "tools": {"slam", "slam/geometry", "slam/image", "ipc", "drivers", "types", "tools/bench"},
    # Measures what the daemon runs, configured as the daemon is.
    "tools/bench": {"slam", "ipc", "types", "daemon", "tools"},
}
# The options of all parts of the estimator: above image in the order, below map, so that the arrows stay one way.
OPTIONS = "slam/config.h"
# The names of the stages that the parts announce to a listener.
STAGES = "slam/stages.h"
SHARED_MAY_INCLUDE = {OPTIONS: {"slam/geometry", "slam/image"}, STAGES: set()}
# The tools read camera files and configurations and refuse input as the daemon does, and speak with it.
SHARED_WITH_TOOLS = {"daemon/config/config.h", "daemon/config/errors.h", "daemon/config/yaml_file.h",
                     "daemon/config/camera_file.h", "daemon/config/calibration_message.h", "daemon/system/control_socket.h"}
SHARED_READERS = {"slam", "slam/map", "slam/solver", "slam/tracking", "slam/mapping", "slam/loops", "slam/fusion"}
# The estimator does no I/O, has no threads, no clock and no log.
FORBIDDEN_IN_SLAM = re.compile(
    r"<(iostream|fstream|filesystem|cstdio|stdio\.h|thread|mutex|shared_mutex|condition_variable|future|"
    r"chrono|ctime|time\.h|unistd\.h|spdlog/.*|fmt/.*|yaml-cpp/.*|lcm/.*|opencv2/(imgcodecs|highgui|videoio).*)>")
# The hot path: what runs for every frame decodes no files and solves with its own fixed-size solver.
FORBIDDEN_IN_HOT_FOLDERS = re.compile(r"<ceres/.*>")
HOT_FOLDERS = {"slam/geometry", "slam/image", "slam/map", "slam/tracking"}

MAX_LINES = 650
# A longer file says why: "Long file: <reason>".
LENGTH_WAIVER = re.compile(r"Long file: \S+")
CHECKED_LENGTHS = {".cc", ".h", ".py", ".lcm", ".txt", ".cmake"}

INCLUDE = re.compile(r'^\s*#\s*include\s+("[^"]+"|<[^>]+>)')


def folder_of(path: str) -> str:
    """The folder whose rules hold for a path from the root: slam/x/y.h -> slam/x, slam/y.h -> slam."""
    parts = path.split("/")
    if parts[0] == "slam":
        return "/".join(parts[:2]) if len(parts) > 2 else "slam"
    if parts[:2] == ["tools", "bench"]:
        return "tools/bench"
    if parts[0] in ("farpoint", "bot_core"):
        return "types"
    if path == "farpoint_build.h":
        return "build"
    return parts[0]


def include_problem(path: str, target: str):
    """Why the file `path` may not include `target`, in words; None where it may."""
    folder = folder_of(path)
    if target.startswith("<"):
        if folder.split("/")[0] == "slam" and FORBIDDEN_IN_SLAM.fullmatch(target):
            return f"{target}: slam/ has no I/O, no threads, no clock and no log"
        if folder in HOT_FOLDERS and FORBIDDEN_IN_HOT_FOLDERS.fullmatch(target):
            return f"{target}: {folder} runs for every frame, Ceres belongs to mapping"
        return None
    target = target.strip('"')
    if "/" not in target and target != "farpoint_build.h":
        return f"{target}: includes start at the root of the repository"
    other = folder_of(target)
    if path in SHARED_MAY_INCLUDE:
        folder, allowed = path, SHARED_MAY_INCLUDE[path]
    else:
        allowed = ALLOWED[folder]
    shared = target in SHARED_MAY_INCLUDE and folder in SHARED_READERS
    shared = shared or (target in SHARED_WITH_TOOLS and folder == "tools")
    if other != folder and other not in allowed and not shared:
        return f"{target}: {folder} may include {', '.join(sorted(allowed)) or 'nothing but itself'}"
    return None


def check_includes(root: pathlib.Path):
    for top in ("slam", "ipc", "drivers", "daemon", "tools"):
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in (".cc", ".h"):
                continue
            path = file.relative_to(root).as_posix()
            if folder_of(path) not in ALLOWED:
                yield f"{path}: the folder {folder_of(path)} has no rule in check_tree.py"
                continue
            for number, line in enumerate(file.read_text().splitlines(), 1):
                match = INCLUDE.match(line)
                problem = match and include_problem(path, match.group(1))
                if problem:
                    yield f"{path}:{number}: {problem}"


def check_headers(root: pathlib.Path):
    for top in ("slam", "ipc", "drivers", "daemon", "tools", "tests"):
        for file in sorted((root / top).rglob("*.h")):
            if not re.search(r"^#pragma once$", file.read_text(), re.MULTILINE):
                yield f"{file.relative_to(root).as_posix()}: no '#pragma once'"


def check_lengths(root: pathlib.Path):
    for top in ("slam", "ipc", "drivers", "daemon", "tools", "tests"):
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in CHECKED_LENGTHS or not file.is_file() or "node_modules" in file.parts:
                continue
            text = file.read_text()
            lines = text.count("\n")
            if lines > MAX_LINES and not LENGTH_WAIVER.search(text):
                yield (f"{file.relative_to(root).as_posix()}: {lines} lines, more than {MAX_LINES}: split it, or "
                       "say why not in a comment 'Long file: ...'")


def check(root: pathlib.Path):
    return [*check_includes(root), *check_headers(root), *check_lengths(root)]


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2])
    if not (root / "slam").is_dir():
        sys.exit(f"check_tree.py: {root}: no folder slam, expected the root of the repository")
    findings = check(root)
    for finding in findings:
        print(finding)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
