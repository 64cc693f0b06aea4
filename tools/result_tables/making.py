# SPDX-License-Identifier: Apache-2.0
"""Runs the commands of a table and keeps what they print."""

import concurrent.futures
import json
import os
import pathlib
import subprocess
import tempfile
import threading
import time

from . import figures, store
from .progress import Progress


PARTIAL = store.ROOT / "build" / "results"


def run(command, folder, keep_stderr, may_fail=False):
    """Standard output of the command. `may_fail`: status 1 with output is accepted."""
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=folder, text=True, check=False,
                          stdout=subprocess.PIPE, stderr=None if keep_stderr else subprocess.PIPE)
    if done.returncode == 0 or (may_fail and done.returncode == 1 and done.stdout.strip()):
        return done.stdout
    said = (done.stderr or "").strip().splitlines()[-1:] or ["no message"]
    raise store.ResultsError(f"status {done.returncode} of '{command}': {said[0]}")


def filled(command, places):
    for name, text in places.items():
        command = command.replace(f"{{{name}}}", str(text))
    return command


# Scripts that run programs of the build; they draw progress on standard error.
TAKING_BIN = ("tools/compare_modes", "tools/count_instructions", "tools/live_runs", "tools/lost_runs")
TALKING = (*TAKING_BIN, "tools/hil/bench")


def make_row(table, row, places):
    """What the last command of the row prints."""
    with tempfile.TemporaryDirectory(prefix="farpoint_results_") as name:
        for command in row.commands:
            script = command.split()[0]
            command = filled(command, places)
            if script in TAKING_BIN:
                command = f"{command} --bin {places['bin']}"
            if script.startswith("tools/"):
                command = f"{places['root']}/{command}"
            printed = run(command, pathlib.Path(name), script in TALKING, table.shows_failures)
    return KEEP[table.kind](json.loads(printed))


def as_printed(printed):
    return printed


KEEP = {
    "accuracy": lambda printed: figures.repeatable(printed["runs"][0]),
    "scenes": lambda printed: {key: printed["scenes"][0][key] for key in ("abs_z_p95", "pairs")},
    "pairs": lambda printed: {"pairs": printed["pairs"]},
    "bench": as_printed, "work": as_printed, "gaps": as_printed, "odometry_gaps": as_printed, "searching": as_printed,
    "threads": figures.live, "memory": figures.live, "endless": as_printed, "beside_load": figures.live, "hil": as_printed,
    "instructions": as_printed,
}


def make_rows(table, programs, data, jobs, known=None):
    """Figures of each row; those in `known` are not made again."""
    places = {"bin": programs, "build": pathlib.Path(programs).parent, "data": data, "root": store.ROOT,
              "jobs": f" --jobs {jobs}"}
    known = known or Finished(None, table)
    progress = Progress(len(table.rows), table.name)

    def one(row):
        if row.label not in known.rows:
            begun = time.monotonic()
            known.add(row, make_row(table, row, places), time.monotonic() - begun)
        progress.step()
        return known.rows[row.label]["values"]

    with concurrent.futures.ThreadPoolExecutor(1 if table.timed or table.kind == "pairs" else jobs) as pool:
        rows = dict(zip([row.label for row in table.rows], pool.map(one, table.rows)))
    progress.close()
    return rows


def make(table, programs, data, jobs, partial=PARTIAL):
    """The result of a table, ready to be saved. Rows that an interrupted run of the same build finished are not run
    again; delete the folder build/results to forget them."""
    commit = store.built_commit(programs)
    refuse_unnamed_build(table, commit)
    known = Finished(partial / f"{table.name}.{commit}.json", table)
    rows = make_rows(table, programs, data, jobs, known)
    known.forget()
    return {"table": table.name, "made": store.made(table, commit, known.seconds()), "rows": rows}


class Finished:
    """Rows of a table that is being made, kept in a file beside the build; without a path in memory only."""

    def __init__(self, path, table):
        self.path, self.lock = path, threading.Lock()
        saved = json.loads(path.read_text()) if path and path.is_file() else {}
        self.commands = table.commands
        self.rows = saved["rows"] if saved.get("commands") == self.commands else {}

    def add(self, row, values, seconds):
        with self.lock:
            self.rows[row.label] = {"values": values, "seconds": seconds}
            if self.path is None:
                return
            self.path.parent.mkdir(parents=True, exist_ok=True)
            scratch = self.path.with_suffix(".new")
            scratch.write_text(json.dumps({"commands": self.commands, "rows": self.rows}))
            os.replace(scratch, self.path)

    def seconds(self):
        return sum(row["seconds"] for row in self.rows.values())

    def forget(self):
        self.path.unlink(missing_ok=True)


def refuse_unnamed_build(table, commit):
    """A result names the commit it was made at: the build's inputs must be those of a commit."""
    if commit.endswith("-dirty") or commit == "unknown":
        raise store.ResultsError(f"{table.name}: the build is of {commit}; commit first, then build again")


def differences(before, after, path=""):
    """Dotted paths of what differs, exactly."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted(set(before) | set(after)):
            yield from differences(before.get(key), after.get(key), f"{path}.{key}" if path else key)
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (old, new) in enumerate(zip(before, after)):
            yield from differences(old, new, f"{path}[{number}]")
    elif before != after:
        yield f"{path}: {before} in the file, {after} now"
