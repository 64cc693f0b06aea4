# SPDX-License-Identifier: Apache-2.0
"""Results as JSON files of tests/results: one a table, with what they were made from."""

import datetime
import hashlib
import json
import os
import pathlib
import platform
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests" / "results"


class ResultsError(Exception):
    """One line for the user."""


def git(*words, root=ROOT):
    """Output of git; None where it fails or is absent."""
    try:
        done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def load(name, folder=FOLDER):
    path = folder / f"{name}.json"
    return json.loads(path.read_text()) if path.is_file() else None


def save(result, folder=FOLDER):
    """Replaces the file through a rename: an interrupted run leaves the old one."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{result['table']}.json"
    scratch = path.with_suffix(".json.new")
    scratch.write_text(dump(result))
    os.replace(scratch, path)


# Lists of figures that a row may hold, one at most.
LISTS = ("pairs", "runs", "tests", "scenarios")


def dump(result):
    """One line a row, or an item of its list, so that a diff shows which changed."""
    lines = [f"{json.dumps(name)}: {dumped_row(values)}" for name, values in result["rows"].items()]
    head = json.dumps({key: value for key, value in result.items() if key != "rows"}, indent=1)
    return head[:-2] + ',\n "rows": {\n' + ",\n".join(lines) + "\n}}\n"


def dumped_row(values):
    name = next((name for name in LISTS if name in values), None)
    if name is None:
        return json.dumps(values)
    rest = json.dumps({key: value for key, value in values.items() if key != name})
    opening = "{" if rest == "{}" else rest[:-1] + ", "
    return opening + f'"{name}": [\n' + ",\n".join(json.dumps(item) for item in values[name]) + "]}"


def machine(cpuinfo=pathlib.Path("/proc/cpuinfo")):
    text = cpuinfo.read_text() if cpuinfo.is_file() else ""
    model = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
    flags = set((re.search(r"^(?:flags|Features)\s*: (.*)$", text, re.MULTILINE) or [0, ""])[1].split())
    wide = "AVX-512" if "avx512bw" in flags else "AVX2" if "avx2" in flags else "SSE" if "sse2" in flags else "NEON"
    return {"cpu": model.group(1) if model else platform.machine(), "cores": os.cpu_count(), "simd": wide}


def input_hashes(inputs, commit="HEAD", root=ROOT):
    """A hash of each input at the commit; None for one that was not there. An input is a file or folder, or sections of a
    YAML file as in config/farpoint.yaml#tracking,mapping, of which comments do not count."""
    return {path: input_hash(path, commit, root) for path in inputs}


def input_hash(path, commit, root=ROOT):
    file, _, names = path.partition("#")
    if not names:
        return git("rev-parse", "--verify", "--quiet", f"{commit}:{path}", root=root)
    text = git("show", f"{commit}:{file}", root=root)
    return None if text is None else sections_hash(text, names.split(","))


def sections_hash(text, names):
    kept, inside = [], False
    for line in text.splitlines():
        line = line.split("#")[0].rstrip()
        if line and not line[0].isspace():
            inside = line.partition(":")[0] in names
        if line and inside:
            kept.append(line)
    return hashlib.sha1("\n".join(kept).encode()).hexdigest()


def built_commit(programs):
    """The commit that the programs of a folder were built from, as farpointd says it."""
    daemon = programs / "farpointd"
    if not daemon.is_file():
        raise ResultsError(f"{daemon}: no such program; expected a build (cmake --build --preset release)")
    words = subprocess.run([str(daemon), "--version"], capture_output=True, text=True, check=True).stdout.split()
    return words[2] if len(words) > 2 else "unknown"


def made(table, commit, seconds):
    return {"commit": git("rev-parse", "--verify", "--quiet", commit) or commit,
            "date": datetime.date.today().isoformat(),
            "configuration": git("rev-parse", "--short=12", f"{commit}:config/farpoint.yaml"),
            "machine": machine(), "seconds": round(seconds), "commands": table.commands,
            "inputs": input_hashes(table.inputs, commit)}


def changed_inputs(table, result, root=ROOT):
    """Inputs of the table that are not those it was made from, uncommitted changes included."""
    before, now = result["made"]["inputs"], input_hashes(table.inputs, root=root)
    return [path for path in table.inputs if now[path] != before.get(path) or is_edited(path, now[path], root)]


def is_edited(path, committed, root):
    """Whether the input differs from the last commit."""
    file, _, names = path.partition("#")
    if not git("status", "--porcelain", "--", file, root=root):
        return False
    return not names or sections_hash((root / file).read_text(), names.split(",")) != committed


def age(table, result, today=None, root=ROOT):
    """One line: why and since when the table is old. None for one that is up to date."""
    if result is None:
        return f"{table.name}: not made yet"
    reasons = []
    if result["made"]["commands"] != table.commands:
        reasons.append("its command changed")
    if git("rev-parse", "HEAD", root=root) is not None:
        changed = changed_inputs(table, result, root)
        if changed:
            files = list(dict.fromkeys(path.partition("#")[0] for path in changed))
            reasons.append(f"{', '.join(files)} changed{commits_since(result['made'], files, root)}")
    if not reasons:
        return None
    head = result["made"]
    days = ((today or datetime.date.today()) - datetime.date.fromisoformat(head["date"])).days
    return (f"{table.name}: made {days} day{'' if days == 1 else 's'} ago at {head['commit'][:7]}, since then "
            + " and ".join(reasons))


def commits_since(head, paths, root=ROOT):
    count = git("rev-list", "--count", f"{head['commit']}..HEAD", "--", *paths, root=root)
    return f" in {count} commit{'' if count == '1' else 's'}" if count not in (None, "0") else ""


def is_of(table, result, commit):
    """Whether the table was made by its present commands, with the build of this commit."""
    return (result is not None and not result["made"].get("carried_over")
            and result["made"]["commands"] == table.commands and result["made"]["commit"].startswith(commit))


def minutes(table, result):
    """What the table takes: as measured, where programs made it by its present commands."""
    measured = result and result["made"]["seconds"] and result["made"]["commands"] == table.commands
    return result["made"]["seconds"] / 60 if measured else table.minutes
