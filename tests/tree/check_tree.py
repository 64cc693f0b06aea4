#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tree is the architecture: checks which folder may include which, the length of files, and READMEs.

usage: check_tree.py [--warnings] [FOLDER]      Prints one line a finding; status 1 where there is one.

--warnings also prints, without a change of the status, what is hard to hold in the head: files over 500 lines, classes
that hold invariants over 20 members, folders over 20 units.
"""

import argparse
import pathlib
import re
import sys

import check_readmes

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
# The measurements that come in: the facade takes them, fusion turns them into factors.
MEASUREMENTS = "slam/measurement.h"
SHARED_MAY_INCLUDE = {OPTIONS: {"slam/geometry", "slam/image"}, STAGES: set(), MEASUREMENTS: {"slam/geometry"}}
# The tools read camera files and configurations and refuse input as the daemon does, and speak with it.
SHARED_WITH_TOOLS = {"daemon/config/config.h", "daemon/config/errors.h", "daemon/config/yaml_file.h",
                     "daemon/config/camera_file.h", "daemon/config/build_info.h", "daemon/config/calibration_message.h",
                     "daemon/system/control_socket.h"}
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

# Limits of warnings, each with the comment that lifts it.
LINES_TO_WARN, MEMBERS_TO_WARN, UNITS_TO_WARN = 500, 20, 20
CLASS_WAIVER = re.compile(r"Large class: \S+")
FOLDER_WAIVER = re.compile(r"Large folder: \S+")  # in the folder's README
TOPS = ("slam", "ipc", "drivers", "daemon", "tools", "tests")

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
        return f"{target}: {folder} may include {', '.join(sorted(allowed)) or 'only itself'}"
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
    for top in TOPS:
        for file in sorted((root / top).rglob("*.h")):
            if not re.search(r"^#pragma once$", file.read_text(), re.MULTILINE):
                yield f"{file.relative_to(root).as_posix()}: no '#pragma once'"


def unexplained_lengths(root: pathlib.Path):
    """(path, number of lines) of every file that does not say why it is long."""
    for top in TOPS:
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in CHECKED_LENGTHS or not file.is_file() or "node_modules" in file.parts:
                continue
            text = file.read_text()
            if not LENGTH_WAIVER.search(text):
                yield file.relative_to(root).as_posix(), text.count("\n")


def check_lengths(root: pathlib.Path):
    for path, lines in unexplained_lengths(root):
        if lines > MAX_LINES:
            yield (f"{path}: {lines} lines, more than {MAX_LINES}: split it, or say why not in a comment "
                   "'Long file: ...'")


COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
CLASS = re.compile(r"^[ \t]*class (?:\[\[\w+\]\] )?(\w+)[^;{()]*\{", re.MULTILINE)
# One declaration of data members: `type name_ = ..., other_;`. Members of a class end in '_'.
MEMBER = re.compile(r"\b\w+_(?=\s*(?:[=;,{\[]|$))")
NO_MEMBER = re.compile(r"\b(?:static|using|typedef|friend|return)\b")


def body_of(text: str, begin: int) -> str:
    """What stands between the brace at `begin` and its partner."""
    depth = 0
    for place in range(begin, len(text)):
        depth += {"{": 1, "}": -1}.get(text[place], 0)
        if depth == 0:
            return text[begin + 1:place]
    return text[begin + 1:]


def without_braces(text: str) -> str:
    """The text without what stands in braces and parentheses: initialisers, bodies, arguments."""
    kept, depth = [], 0
    for letter in text:
        if letter in "{(":
            depth += 1
        elif letter in "})":
            depth -= 1
            kept.append(";" if letter == "}" and depth == 0 else " ")
        elif depth == 0:
            kept.append(letter)
    return "".join(kept)


def data_members(text: str, class_start: "re.Match[str]"):
    """Names of the data members of one class, in order."""
    statements = without_braces(body_of(text, class_start.end() - 1)).split(";")
    names = [name for statement in statements if not NO_MEMBER.search(statement)
             for name in MEMBER.findall(statement.split("=")[0] if "," not in statement else statement)]
    return list(dict.fromkeys(names))


def warn_of_classes(root: pathlib.Path):
    for top in TOPS:
        for file in sorted((root / top).rglob("*.h")):
            text = file.read_text()
            if CLASS_WAIVER.search(text):
                continue
            code = COMMENT.sub("", text)
            for start in CLASS.finditer(code):
                count = len(data_members(code, start))
                if count > MEMBERS_TO_WARN:
                    yield (f"{file.relative_to(root).as_posix()}: class {start.group(1)} has {count} members, more than "
                           f"{MEMBERS_TO_WARN}: split it, or say why not in a comment 'Large class: ...'")


def warn_of_lengths(root: pathlib.Path):
    for path, lines in unexplained_lengths(root):
        if LINES_TO_WARN < lines <= MAX_LINES:
            yield f"{path}: {lines} lines, more than {LINES_TO_WARN}"


def warn_of_folders(root: pathlib.Path):
    """A unit is x.h with x.cc, or one of them alone."""
    for top in TOPS:
        folders = [root / top, *sorted(path for path in (root / top).rglob("*") if path.is_dir())]
        for folder in (path for path in folders if path.is_dir()):
            units = {file.stem for file in folder.iterdir() if file.suffix in (".cc", ".h")}
            readme = folder / "README.md"
            if len(units) <= UNITS_TO_WARN or readme.is_file() and FOLDER_WAIVER.search(readme.read_text()):
                continue
            yield (f"{folder.relative_to(root).as_posix()}: {len(units)} units, more than {UNITS_TO_WARN}: split it, or "
                   "say why not in its README 'Large folder: ...'")


def warnings(root: pathlib.Path):
    return [*warn_of_classes(root), *warn_of_lengths(root), *warn_of_folders(root)]


SPDX = "SPDX-License-Identifier: Apache-2.0"
LICENSED = {".h", ".cc", ".c", ".inl", ".cjs", ".py", ".sh", ".cmake"}


def check_spdx(root: pathlib.Path):
    """Every source names its licence in its first line, or in the second below '#!'."""
    for top in (*TOPS, "systemd"):
        for file in sorted((root / top).rglob("*")):
            is_source = file.suffix in LICENSED or file.name == "CMakeLists.txt"
            if not is_source or not file.is_file() or "node_modules" in file.parts:
                continue
            lines = file.read_text().splitlines()[:2] + ["", ""]
            if SPDX not in lines[1 if lines[0].startswith("#!") else 0]:
                yield f"{file.relative_to(root).as_posix()}: does not begin with '{SPDX}'"


def check(root: pathlib.Path):
    return [*check_includes(root), *check_headers(root), *check_lengths(root)]


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1], add_help=False)
    parser.add_argument("--warnings", action="store_true")
    parser.add_argument("root", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).parents[2])
    options = parser.parse_args()
    root = options.root
    if not (root / "slam").is_dir():
        sys.exit(f"check_tree.py: {root}: no folder slam, expected the root of the repository")
    if options.warnings:
        for warning in warnings(root):
            print(f"warning: {warning}")
    findings = check(root) + check_readmes.check(root) + list(check_spdx(root))
    for finding in findings:
        print(finding)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
