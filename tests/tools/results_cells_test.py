#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of runs, tests and scenarios: their cells, and the scripts that print their figures.

usage: results_cells_test.py SOURCE_FOLDER
"""

import argparse
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from results_support import ROOT, live_run, memory_rows, result_of, script  # sets the path of what follows
from result_tables import cells, load, manifest, render, resident


def recorded(case, figures_, passed=True):
    return {"name": f"Recordings/S.T/{case}", "case": case, "passed": passed, "figures": figures_}


class Cells(unittest.TestCase):
    """Each renderer on figures that tell its columns apart."""

    def table(self, name, rows):
        """The rows of the rendered table, without its heading."""
        table = manifest.find(name)
        text = render.block(table, result_of(table, rows))
        lines = [line for line in text.splitlines() if line.startswith("|")]
        self.assertEqual({line.count("|") - line.count("\\|") for line in lines}, {lines[0].count("|")})
        return lines[2:]

    def test_bench(self):
        def stage(ms):
            return {"p50_ms": ms, "p99_ms": 2 * ms, "p50_yardsticks": ms / 10, "p99_yardsticks": ms / 5}
        values = {"stages": {"tracking": stage(3.3), "local_ba": stage(5)}, "process_cpu_yardsticks": 2.2,
                  "yardstick_ms": {"p50": 10, "p99": 12}}
        self.assertEqual(self.table("bench", {"KITTI": values}), [
            "| tracking, image to pose | 3.3 | 6.6 | 0.33, 0.66 |", "| of it: local BA | 5.0 | 10.0 | 0.50, 1.00 |",
            "| process, a frame (mean; decoding included) | 22.0 |  | 2.20 |", "| the yardstick | 10.0 | 12.0 |  |"])

    def test_work_puts_the_second_run_over_the_first(self):
        keys = [key for _, parts in cells.WORK for key, _ in parts]
        runs = [{"name": name, "work": {key: factor * (1 + place) for place, key in enumerate(keys)}}
                for name, factor in (("kitti03", 100), ("town", 90))]
        lines = self.table("work", {"both": {"runs": runs}})
        self.assertEqual(lines[0],
                         "| features, matches, inliers a frame | 100, 200, 300 | 90, 180, 270 | 0.90, 0.90, 0.90 |")
        self.assertEqual(len(lines), len(cells.WORK))

    def test_gaps(self):
        found = {"places": 20, "seen": 15, "back": 14, "latest_back_s": 0.104, "poses": 412, "wrong_poses": 1}
        none = {**found, "back": 0}
        several = [recorded("kitti03", found), recorded("euroc", none, False)]
        self.assertEqual(self.table("gaps", {"S": {"tests": several}}), [
            "| KITTI 03, first half | 20 | 15 | 14, after at most 0.10 s | 412 | 1 | passes |",
            "| EuRoC MH_01, part, camera 0 | 20 | 15 | 0 | 412 | 1 | **fails** |"])

    def test_odometry_over_gaps(self):
        found = {"gaps": 16, "judged": 15, "kept": 13, "resets": 6, "worst_m": 0.3456}
        self.assertEqual(self.table("odometry_gaps", {"S": {"tests": [recorded("town", found, False)]}}),
                         ["| `town`, 40 s | 15 of 16 | 13 | 6 | 0.346 | **fails** |"])

    def test_searching_pools_the_frames_of_all_rows(self):
        def row(tracking, searching, lost):
            return {"cpu_ms": {"tracking": tracking, "searching": searching, "lost": lost}, "valid": 9, "frames": 20}
        rows = {"KITTI": row([float(ms) for ms in range(1, 101)], [50.0] * 98 + [120.0, 200.0], [7.0, 30.0]),
                "EuRoC": row([10.0] * 100, [5.0] * 50, [4.0])}
        self.assertEqual(self.table("searching", rows), [
            "| KITTI | 100, 100 | 51.0, 100.0 | 50.0, 200.0 | 2.00 | 30.0 | 9 of 20 |",
            "| EuRoC | 100, 50 | 10.0, 10.0 | 5.0, 5.0 | 0.50 | 4.0 | 9 of 20 |",
            "| all | 200, 150 | 10.0, 99.0 | 50.0, 120.0 | 1.21 | 30.0 |  |"])

    def test_threads(self):
        rows = {"KITTI, 1": {"load": {"computing": 8}, "runs": [live_run(0.199), live_run(0.2554), live_run(0.21)]},
                "KITTI, 6": {"load": {},
                             "runs": [live_run(0.2, times_lost=2), live_run(None, times_lost=1, dropped=7)]},
                "EuRoC": {"load": {}, "runs": [live_run(0.00431), live_run(None)]}}
        self.assertEqual(self.table("threads", rows), [
            "| KITTI, 1 | 8 computing | 3 | none | 0.199 .. 0.255 | 100.0 | 98.8 | 0 |",
            "| KITTI, 6 | nothing | 2 | 3, in 2 of 2 runs | 0.200, 1 lost | 100.0 | 98.8 | 0 .. 7 |",
            "| EuRoC | nothing | 2 | none | 0.0043, 1 lost | 100.0 | 98.8 | 0 |"])

    def test_no_run_with_a_path_is_lost(self):
        self.assertEqual(cells.spread([None, None], "{:.3f}"), "lost")

    def test_beside_load(self):
        rows = {"ordinary": {"load": {"computing": 2, "copying": 1}, "runs": [live_run(dropped=9)]}}
        self.assertEqual(self.table("beside_load", rows), [
            "| ordinary | 2 computing, 1 copying | 2.9, 4.1, 17.8 | 0.20, 0.32 | 3 | 9 | 400 | 98.8 |"])

    def test_memory(self):
        divided = {"libraries_mb": 16.1, "files_mb": 0, "pools_and_stacks_mb": 164.4, "locked_mb": 177.2}
        self.assertEqual(self.table("memory", memory_rows([160.4], [191.8, 193.7], divided)), [
            "| peak memory of KITTI 03 half, lockstep; threads with locked memory | 160 MB; 192 .. 194 MB |",
            "| of the latter, after 3 s: pools, heap and stacks; libraries and program; locked of all "
            "| 164 MB; 16 MB; 177 MB |", "| pools of the estimator, by the configuration | 135 MB |"])

    def test_memory_of_runs_that_ended_before_it_was_read(self):
        self.assertEqual(len(self.table("memory", memory_rows([160.4], [191.8, 193.7]))), 2)

    def test_instructions(self):
        run = {"frames": 30, "keyframes": 7, "frame": {"pyramid": 1234.5}, "keyframe": {"find_pairs": 20000, "mapping": 9}}
        self.assertEqual(self.table("instructions", {"a": run, "b": {**run, "keyframes": 8}}), [
            "| frames, keyframes counted | 30, 7 | 30, 8 |", "| a frame: pyramid | 1.23 | 1.23 |",
            "| a keyframe: find pairs | 20.00 | 20.00 |", "| a keyframe: mapping | 0.01 | 0.01 |"])

    def test_drives_without_end(self):
        figures_ = {"frames": 3000, "tenth_mb": 158.2, "half_mb": 161.25, "end_mb": 161.4, "early_p99_ms": 4.2,
                    "late_p99_ms": 4.31}
        run = {"frames": {"tracked": 20000}, "memory": {"steadiness": {
            "second_twentieth_p99_ms": 2.5, "last_twentieth_p99_ms": 2.6, "tenth_mb": 1, "half_mb": 2, "end_mb": 3}}}
        rows = {"a": {"tests": [recorded("", figures_)]}, "b": {"runs": [run]}}
        self.assertEqual(self.table("memory_endless", rows), [
            "| a | 3,000 | 158.2, 161.2, 161.4 | 4.20, 4.31 | passes |",
            "| b | 20,000 | 1.0, 2.0, 3.0 | 2.50, 2.60 |  |"])

    def test_scenarios_of_the_bench(self):
        def scenarios(*several):
            return {"scenarios": [{"name": name, "title": f"The {name}.", "broken": "it is cut", "well": well,
                                   "text": text} for name, well, text in several]}
        rows = {"as it is": scenarios(("boot", True, "4.5 s | 1 core"), ("can", False, "an epoch is missing"),
                                      ("fd", True, "50 Hz")),
                "broken": scenarios(("boot", True, "status 7"), ("can", False, "did not fail"))}
        self.assertEqual(self.table("hil", rows), [
            "| `boot`: The boot. | 4.5 s \\| 1 core | it is cut: status 7 |",
            "| `can`: The can. | **FAILED**: an epoch is missing | it is cut: **not as it must**, did not fail |",
            "| `fd`: The fd. | 50 Hz | not run |"])


class TestFigures(unittest.TestCase):
    """The adapter from GoogleTest's report."""

    def setUp(self):
        self.script = script("test_figures")

    def report(self, **changes):
        entry = {"name": "T/kitti03", "file": "x.cc", "line": 3, "value_param": "...", "status": "RUN",
                 "result": "COMPLETED", "timestamp": "now", "time": "2s", "classname": "Recordings/S", "places": "20", "worst_m": "0.5"}
        return {"testsuites": [{"testsuite": [{**entry, **changes}]}]}

    def test_properties_are_numbers_and_nothing_else_is_kept(self):
        self.assertEqual(self.script.figures_of(self.report()), {"tests": [
            {"name": "Recordings/S.T/kitti03", "case": "kitti03", "passed": True,
             "figures": {"places": 20, "worst_m": 0.5}}]})

    def test_a_failed_test_keeps_its_figures(self):
        (test,) = self.script.figures_of(self.report(failures=[{"failure": "x"}]))["tests"]
        self.assertFalse(test["passed"])
        self.assertEqual(test["figures"]["places"], 20)

    def test_a_skipped_test_gives_no_result(self):
        with self.assertRaisesRegex(self.script.NoResult, "kitti03: skipped, expected it to run"):
            self.script.figures_of(self.report(result="SKIPPED"))

    def test_a_filter_that_matches_none_gives_no_result(self):
        with self.assertRaisesRegex(self.script.NoResult, "no test ran"):
            self.script.figures_of({"testsuites": []})

    def run_program(self, body):
        with tempfile.TemporaryDirectory() as name:
            program = pathlib.Path(name) / "program"
            find_out = "for word; do case $word in --gtest_output=json:*) out=${word#*:};; esac; done"
            program.write_text(f"#!/bin/bash\n{find_out}\n{body}")
            program.chmod(0o755)
            return subprocess.run([ROOT / "tools/test_figures", program, "--gtest_filter=S.*"], capture_output=True,
                                  text=True, check=False)

    def test_the_status_is_that_of_the_tests(self):
        for failures, status in ({}, 0), ({"failures": [{}]}, 1):
            done = self.run_program(f"echo said; echo '{json.dumps(self.report(**failures))}' > $out; exit {status}\n")
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertEqual(len(json.loads(done.stdout)["tests"]), 1)
            self.assertIn("said", done.stderr)

    def test_a_crash_gives_no_result(self):
        done = self.run_program("kill -SEGV $$\n")
        self.assertEqual((done.returncode, done.stdout), (2, ""))


class OwnLoad(unittest.TestCase):
    def alive(self, processes):
        return [process.poll() is None for process in processes]

    def test_it_lives_as_long_as_the_context(self):
        with tempfile.TemporaryDirectory() as name:
            with load.Load({"computing": 1, "copying": 1, "writing": 1}, name) as running:
                time.sleep(1)
                self.assertEqual(self.alive(running.processes), [True] * 3)
            self.assertEqual(self.alive(running.processes), [False] * 3)

    def test_it_ends_with_the_process_that_started_it(self):
        done = subprocess.run([sys.executable, load.__file__, "computing", "1", "/tmp"], timeout=60, check=False)
        self.assertEqual(done.returncode, 0)


class Resident(unittest.TestCase):
    def test_it_divides_by_the_mapped_file(self):
        def mapping(file, rss_kb, locked_kb):
            return (f"7f00a000-7f00b000 r-xp 00000000 08:01 123                        {file}\nSize:    4 kB\n"
                    f"Rss:    {rss_kb} kB\nPss:    9 kB\nLocked:    {locked_kb} kB\nVmFlags: rd ex\n")
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "smaps"
            path.write_text(mapping("/usr/lib/libc.so.6", 1000, 1000) + mapping("/opt/bin/farpointd", 2000, 2000)
                            + mapping("/tmp/run.lcm", 4000, 0) + mapping("[heap]", 8000, 8000)
                            + mapping("", 16000, 500))
            self.assertEqual(resident.divided(path), {"libraries_mb": 3.072, "files_mb": 4.096,
                                                      "pools_and_stacks_mb": 24.576, "locked_mb": 11.776})


class LiveRuns(unittest.TestCase):
    """The script, with programs that only print."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        accuracy = {"runs": [{"images": 4, "tracked_percent": 99, "times_lost": 0, "maps": 1, "resets": 1,
                              "latency": None, "final": {}, "live": {}, "map_points": 3}]}
        figures_ = {"runs": [{"frames": {"dropped": 1}, "memory": {"peak_mb": 5}}]}
        self.program("farpoint", f"case $1 in evaluate) echo '{json.dumps(accuracy)}';; "
                                 f"report) echo '{json.dumps(figures_)}';; esac")
        self.program("farpointd", f'echo "$@" >> {self.folder}/ran')

    def program(self, name, body):
        (self.folder / name).write_text(f"#!/bin/bash\n{body}\n")
        (self.folder / name).chmod(0o755)

    def run_script(self, *words):
        return subprocess.run([ROOT / "tools/live_runs", "run.lcm", "--bin", self.folder, *words], capture_output=True,
                              text=True, check=False)

    def test_each_pace_runs_as_often_as_asked(self):
        done = self.run_script("--speed", "1,2.5", "--runs", "2", "--computing", "1", "--set", "a.b=3")
        printed = json.loads(done.stdout)
        self.assertEqual([run["speed"] for run in printed["runs"]], [1, 1, 2.5, 2.5])
        self.assertEqual(printed["load"], {"computing": 1})
        self.assertEqual(printed["runs"][0]["frames"], {"dropped": 1})
        self.assertEqual(printed["runs"][0]["memory"], {"peak_mb": 5, "divided": None})
        ran = (self.folder / "ran").read_text().splitlines()
        self.assertEqual(len(ran), 4)
        self.assertRegex(ran[2], r"^--replay run.lcm --speed 2.5 --output \S+/out.lcm --set a.b=3$")

    def test_the_load_is_there_while_the_daemon_runs(self):
        self.program("farpointd", f"pgrep -f load.py.computing.$PPID > {self.folder}/beside; exit 0")
        if shutil.which("pgrep") is None:
            self.skipTest("no pgrep")
        self.run_script("--computing", "2")
        self.assertEqual(len((self.folder / "beside").read_text().split()), 2)

    def test_a_daemon_that_fails_ends_it_with_its_message(self):
        self.program("farpointd", "echo no such log >&2; exit 2")
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("farpointd ended with status 2: no such log", done.stderr)


class CountInstructions(unittest.TestCase):
    counting = script("count_instructions")
    # Names are written once, and numbered from there on; a cost may stand behind a relative position.
    PROFILE = """fn=(1) main
16 400
cfn=(2) farpoint::slam::A::b(int)
calls=2 30
16 1000
fn=(2)
30 900
cfn=(3) farpoint::slam::N_AVX2::kernel(unsigned char const*)
calls=7 50
+3 100
fn=(4) other
cfi=(5)
cfn=(2)
calls=1 30
* 500
70 9
"""

    def profile(self):
        return self.counting.Profile(self.PROFILE.splitlines())

    def test_calls_and_what_they_contain_are_added_up_over_all_callers(self):
        profile = self.profile()
        self.assertEqual(profile.of(profile.calls, "A::b"), 3)
        self.assertEqual(profile.of(profile.costs, "A::b"), 1500)
        self.assertEqual(profile.part(("A::b",), 3), 0.5)
        self.assertEqual(profile.simd, "AVX2")

    def test_a_function_that_is_gone_is_named(self):
        with self.assertRaisesRegex(self.counting.NoCount, "A::c was never called"):
            self.profile().part(("A::c",), 1)


class LostRuns(unittest.TestCase):
    lost_runs = script("lost_runs")

    @staticmethod
    def image(k):
        return b"f" * 8 + struct.pack(">qq", 100 * k, k) + bytes([k]) * 40

    def test_images_of_elsewhere_keep_their_own_times_and_numbers(self):
        events = [("CAMERA_0", self.image(k)) for k in range(30)]
        events.insert(7, ("IMU", b"an inertial sample"))
        made = self.lost_runs.replaced(events, 0.5, argparse.Namespace(first=10, lost=4, seen=6))
        images = [data for channel, data in made if channel == "CAMERA_0"]
        self.assertEqual([struct.unpack_from(">qq", data, 8) for data in images], [(100 * k, k) for k in range(30)])
        shown = [data[-1] for data in images]
        self.assertEqual(shown[10:14], [25, 26, 27, 28])
        self.assertEqual(shown[20:24], [5, 6, 7, 8])
        self.assertEqual(shown[:10] + shown[14:20] + shown[24:], [*range(10), *range(14, 20), *range(24, 30)])
        self.assertEqual(made[7], events[7])

    def test_a_frame_searches_where_the_one_before_had_no_pose(self):
        states = [3, 3, 4, 5, 6, 6, 3, 3]
        frames = [(state, state in (3, 4), float(k)) for k, state in enumerate(states)]
        self.assertEqual(self.lost_runs.sort_out(frames),
                         {"tracking": [1.0, 2.0, 7.0], "lost": [3.0], "searching": [4.0, 5.0, 6.0]})


if __name__ == "__main__":
    unittest.main()
