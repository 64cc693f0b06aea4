# SPDX-License-Identifier: Apache-2.0
"""What the tests of tools/results share: the repository, its scripts as modules, made-up results.

The first argument of a test is the repository's folder.
"""

import importlib.machinery
import importlib.util
import pathlib
import sys

ROOT = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(ROOT / "tools"))


def script(name):
    """A script of tools/ as a module."""
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "tools" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


def result_of(table, rows, commit="0123456789", inputs=None):
    return {"table": table.name, "rows": rows,
            "made": {"commit": commit, "date": "2026-11-20", "seconds": 3, "commands": table.commands,
                     "machine": {"cpu": "a processor", "cores": 2, "simd": "AVX2"}, "inputs": inputs or {}}}


def live_run(ate_m=0.2, times_lost=0, dropped=0, peak_mb=190.0, divided=None):
    return {"speed": 1.0, "images": 400, "tracked_percent": 98.75, "times_lost": times_lost,
            "latency": {"p50_ms": 2.94, "p99_ms": 4.06, "max_ms": 17.8, "beyond_tracking_p50_ms": 0.2,
                        "beyond_tracking_p99_ms": 0.321, "later_than_a_frame": 3},
            "final": {"ate_rmse_m": ate_m, "share": 1}, "live": {"share": 0.9875}, "frames": {"dropped": dropped},
            "memory": {"peak_mb": peak_mb, "pool_mb": 135.1, "divided": divided}}


def memory_rows(lockstep_mb, threaded_mb, divided=None):
    rows = {"lockstep": lockstep_mb, "threads with locked memory": threaded_mb}
    return {label: {"runs": [live_run(peak_mb=mb, divided=divided) for mb in values]} for label, values in rows.items()}
