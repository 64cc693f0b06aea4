# SPDX-License-Identifier: Apache-2.0
"""Cells of the tables of runs, tests and scenarios: (columns, rows) from a result."""

from .spread import percentile

CASES = {"kitti03": "KITTI 03, first half", "euroc": "EuRoC MH_01, part, camera 0", "town": "`town`, 40 s"}


def escaped(text):
    return text.replace("|", "\\|")


def spread(values, form):
    """Least and greatest as text, one where both are equal; None counts as lost."""
    known = sorted(value for value in values if value is not None)
    if not known:
        return "lost"
    ends = list(dict.fromkeys(form.format(value) for value in (known[0], known[-1])))
    return " .. ".join(ends) + (f", {len(values) - len(known)} lost" if len(known) < len(values) else "")


def name(test):
    return CASES.get(test["case"], test["case"])


def verdict(test):
    return "passes" if test["passed"] else "**fails**"


BENCH = (("tracking", "tracking, image to pose"), ("pyramid", "of it: pyramid"), ("extraction", "of it: extraction"),
         ("matching", "of it: matching"), ("alignment", "of it: alignment"), ("pose", "of it: pose"),
         ("mapping", "mapping, a keyframe"), ("triangulation", "of it: triangulation"), ("fusing", "of it: fusing"),
         ("local_ba", "of it: local BA"), ("calibration", "of it: refinement of the calibration"),
         ("culling", "of it: culling"), ("decode", "decoding"), ("tracking_wall", "tracking, elapsed"),
         ("mapping_wall", "mapping, elapsed"))


def bench(table, result):
    (values,) = result["rows"].values()
    rows = []
    for key, name in BENCH:
        stage = values["stages"].get(key)
        if stage:
            rows.append([name, f"{stage['p50_ms']:.1f}", f"{stage['p99_ms']:.1f}",
                         f"{stage['p50_yardsticks']:.2f}, {stage['p99_yardsticks']:.2f}"])
    yardsticks, yardstick = values["process_cpu_yardsticks"], values["yardstick_ms"]
    return ["CPU time of the thread", "p50 ms", "p99 ms", "p50, p99 in yardsticks"], [
        *rows,
        ["process, a frame (mean; decoding included)", f"{yardsticks * yardstick['p50']:.1f}", "", f"{yardsticks:.2f}"],
        ["the yardstick", f"{yardstick['p50']:.1f}", f"{yardstick['p99']:.1f}", ""]]


WORK = (("features, matches, inliers a frame", (("features", "{:.0f}"), ("matches", "{:.0f}"), ("inliers", "{:.0f}"))),
        ("inliers of the matches, %", (("inliers_percent", "{:.1f}"),)),
        ("keyframes that see a point; seconds between the first and the last",
         (("keyframes_a_point", "{:.0f}"), ("seconds_a_point", "{:.2f}"))),
        ("keyframes, % of the frames", (("keyframes_percent", "{:.1f}"),)),
        ("tracking, CPU ms", (("tracking_ms", "{:.2f}"),)),
        ("extraction, matching, alignment, pose, CPU ms",
         tuple((f"{stage}_ms", "{:.2f}") for stage in ("extraction", "matching", "alignment", "pose"))),
        ("mapping; of it triangulation, local BA, CPU ms a keyframe",
         tuple((f"{stage}_ms", "{:.1f}") for stage in ("mapping", "triangulation", "local_ba"))))


def work(table, result):
    """Two runs side by side, and the ratio of the second to the first."""
    (values,) = result["rows"].values()
    kitti, town = (run["work"] for run in values["runs"])
    rows = [[name, *[", ".join(form.format(run[key]) for key, form in figures) for run in (kitti, town)],
             ", ".join(f"{town[key] / kitti[key]:.2f}" for key, _ in figures)] for name, figures in WORK]
    return ["median over the run", "KITTI 03 half", "town", "ratio"], rows


def tests(result):
    return [test for values in result["rows"].values() for test in values["tests"]]


def gaps(table, result):
    rows = []
    for test in tests(result):
        f = test["figures"]
        back = f"{f['back']}, after at most {f['latest_back_s']:.2f} s" if f["back"] else "0"
        rows.append([name(test), str(f["places"]), str(f["seen"]), back, str(f["poses"]), str(f["wrong_poses"]),
                     verdict(test)])
    return ["recording", "places", "with a view seen before", "back in the same map within 1 s",
            "poses judged in 3 s after it", "wrong", "the test"], rows


def odometry_gaps(table, result):
    rows = []
    for test in tests(result):
        f = test["figures"]
        rows.append([name(test), f"{f['judged']} of {f['gaps']}", str(f["kept"]), str(f["resets"]), f"{f['worst_m']:.3f}",
                     verdict(test)])
    return ["recording", "gaps judged", "motion kept, or the counter rose", "the counter rose",
            "worst error without that, m", "the test"], rows


def searching(table, result):
    """CPU of a frame by what the frame was, pooled over all rows, and for each of them."""
    rows = list(result["rows"].items())
    pooled = {kind: [ms for _, values in rows for ms in values["cpu_ms"][kind]] for kind in rows[0][1]["cpu_ms"]}
    named = [(label, values["cpu_ms"], f"{values['valid']} of {values['frames']}") for label, values in rows]
    return ["recording", "frames that track, search", "tracking p50, p99 ms", "searching p50, p99 ms", "ratio of p99",
            "tracking is lost, worst ms", "frames valid"], [
                searching_cells(*row) for row in [*named, ("all", pooled, "")]]


def searching_cells(label, cpu_ms, valid):
    ends = {kind: [percentile(cpu_ms[kind], p) for p in (50, 99)] for kind in ("tracking", "searching")}
    return [label, f"{len(cpu_ms['tracking'])}, {len(cpu_ms['searching'])}",
            *[", ".join(f"{ms:.1f}" for ms in ends[kind]) for kind in ("tracking", "searching")],
            f"{ends['searching'][1] / ends['tracking'][1]:.2f}", f"{max(cpu_ms['lost']):.1f}", valid]


def beside(load):
    return ", ".join(f"{count} {kind}" for kind, count in load.items()) or "nothing"


def lost(runs):
    times = [run["times_lost"] for run in runs]
    return f"{sum(times)}, in {sum(map(bool, times))} of {len(times)} runs" if any(times) else "none"


def threads(table, result):
    rows = []
    for label, values in result["rows"].items():
        runs = values["runs"]
        ate = [run["final"]["ate_rmse_m"] for run in runs]
        form = "{:.4f}" if all(value < 0.02 for value in ate if value is not None) else "{:.3f}"
        rows.append([label, beside(values["load"]), str(len(runs)), lost(runs), spread(ate, form),
                     spread([100 * run["final"]["share"] for run in runs], "{:.1f}"),
                     spread([100 * run["live"]["share"] for run in runs], "{:.1f}"),
                     spread([run["frames"]["dropped"] for run in runs], "{}")])
    return ["recording, `--speed`", "beside it", "runs", "times lost", "final ATE m", "final share %", "live share %",
            "frames dropped"], rows


def beside_load(table, result):
    rows = []
    for label, values in result["rows"].items():
        (run,) = values["runs"]
        latency = run["latency"]
        rows.append([label, beside(values["load"]),
                     ", ".join(f"{latency[key]:.1f}" for key in ("p50_ms", "p99_ms", "max_ms")),
                     ", ".join(f"{latency[f'beyond_tracking_{p}_ms']:.2f}" for p in ("p50", "p99")),
                     str(latency["later_than_a_frame"]), str(run["frames"]["dropped"]), str(run["images"]),
                     f"{run['tracked_percent']:.1f}"])
    return ["priorities", "beside it", "latency p50, p99, max ms", "beyond tracking p50, p99 ms",
            "later than a frame period", "dropped", "frames", "frames tracked %"], rows


def memory(table, result):
    lockstep, threaded = (values["runs"] for values in result["rows"].values())
    divided = [run["memory"]["divided"] for run in threaded if run["memory"]["divided"]]

    def parts(*names):
        return "; ".join(f"{spread([part[f'{name}_mb'] for part in divided], '{:.0f}')} MB" for name in names)

    peaks = [spread([run["memory"]["peak_mb"] for run in runs], "{:.0f}") for runs in (lockstep, threaded)]
    rows = [["peak memory of KITTI 03 half, lockstep; threads with locked memory", f"{peaks[0]} MB; {peaks[1]} MB"]]
    if divided:
        rows.append(["of the latter, after 3 s: pools, heap and stacks; libraries and program; locked of all",
                     parts("pools_and_stacks", "libraries", "locked")])
    return ["what", "peak"], [*rows, ["pools of the estimator, by the configuration",
                                      spread([lockstep[0]["memory"]["pool_mb"]], "{:.0f} MB")]]


def instructions(table, result):
    """A row a part, a column a recording; millions."""
    runs = list(result["rows"].values())
    rows = [["frames, keyframes counted", *[f"{run['frames']}, {run['keyframes']}" for run in runs]]]
    rows += [[f"{words[unit]}{part.replace('_', ' ')}", *[f"{run[unit][part] / 1000:.2f}" for run in runs]]
             for words in ({"frame": "a frame: ", "keyframe": "a keyframe: "},)
             for unit in words for part in runs[0][unit]]
    return ["million instructions", *result["rows"]], rows


def endless(table, result):
    rows = [endless_cells(label, values) for label, values in result["rows"].items()]
    return ["drive", "frames", "resident MB after a tenth, half, all", "tracking p99 early, late, CPU ms",
            "the test"], rows


def endless_cells(label, values):
    """Figures of a test or of a run's report."""
    if "tests" in values:
        (test,) = values["tests"]
        f, times, says = test["figures"], ("early_p99_ms", "late_p99_ms"), verdict(test)
        frames = f["frames"]
    else:
        (run,) = values["runs"]
        f, times, says = run["memory"]["steadiness"], ("second_twentieth_p99_ms", "last_twentieth_p99_ms"), ""
        frames = run["frames"]["tracked"]
    return [label, f"{frames:,}", ", ".join(f"{f[key]:.1f}" for key in ("tenth_mb", "half_mb", "end_mb")),
            ", ".join(f"{f[key]:.2f}" for key in times), says]


def hil(table, result):
    """Each scenario's figures, and the complaint of its broken form."""
    broken = {one["name"]: one for one in result["rows"]["broken"]["scenarios"]}
    rows = []
    for one in result["rows"]["as it is"]["scenarios"]:
        other = broken.get(one["name"])
        says = (f"{other['broken']}: {'' if other['well'] else '**not as it must**, '}{other['text']}" if other
                else "not run")
        rows.append([f"`{one['name']}`: {escaped(one['title'])}",
                     ("" if one["well"] else "**FAILED**: ") + escaped(one["text"]), escaped(says)])
    return ["scenario", "measured in the guest", "broken, it says"], rows
