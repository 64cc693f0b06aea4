# SPDX-License-Identifier: Apache-2.0
"""What of the programs' JSON is kept."""

RUN_KEYS = ("images", "resets", "times_lost", "maps", "map_points", "vmp_percent", "triangulation_depth_m",
            "depth_over_50_m_percent", "depth_over_100_m_percent", "landmarks", "segments")
TRAJECTORY_KEYS = ("n", "share", "path_m", "scale", "ate_rmse_m", "rpe_1s_translation_m", "rpe_1s_rotation_deg")


def repeatable(run):
    """Of `farpoint evaluate --json`. Measured times and memory are left out: all that stays is the same in each lockstep
    replay of one log."""
    kept = {key: run.get(key) for key in RUN_KEYS}
    kept.update(trajectories(run))
    return kept


def trajectories(run):
    return {part: {key: (run.get(part) or {}).get(key) for key in TRAJECTORY_KEYS} for part in ("final", "live")}


def live(printed):
    """Of runs with threads: all, of their trajectories the usual keys."""
    runs = [{**run, **(trajectories(run) if "final" in run else {})} for run in printed["runs"]]
    return {**printed, "runs": runs}


def final_ate_m(run):
    return run["final"]["ate_rmse_m"]


def p90_depth_m(run):
    return (run["triangulation_depth_m"] or {}).get("p90")


def live_share(run):
    return run["live"]["share"]
