#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tools/results: manifest, rendering, age, exact comparison, bootstrap, progress.

usage: results_test.py SOURCE_FOLDER
"""

import contextlib
import datetime
import dataclasses
import io
import json
import pathlib
import random
import re
import shutil
import subprocess
import tempfile
import unittest
import unittest.mock

from results_support import ROOT, memory_rows, result_of, script  # sets the path of what follows
from result_tables import figures, making, manifest, render, spread, store
from result_tables.progress import Progress


def run_row(ate_m, depth_m=40.0):
    return {"final": {"ate_rmse_m": ate_m, "share": 1}, "live": {"share": 0.9},
            "triangulation_depth_m": {"p90": depth_m}, "depth_over_100_m_percent": 1.0, "vmp_percent": 30.0}


def pair(start, baseline_m, vmp_m):
    return {"start": start, "baseline": run_row(baseline_m), "vmp": run_row(vmp_m)}


class Bootstrap(unittest.TestCase):
    def test_the_interval_of_known_data_is_that_of_order_statistics(self):
        # The median of 101 equally spaced values has a binomial interval of ranks 41 and 61 at 95 %.
        low, high = spread.median_interval([rank / 100 for rank in range(101)])
        self.assertAlmostEqual(low, 0.40, delta=0.02)
        self.assertAlmostEqual(high, 0.60, delta=0.02)

    def test_the_interval_holds_the_true_median_as_often_as_it_says(self):
        source = random.Random(7)
        samples = [[source.gauss(1, 0.3) for _ in range(20)] for _ in range(60)]
        held = sum(low <= 1 <= high for low, high in map(spread.median_interval, samples))
        self.assertGreaterEqual(held, 51)
        self.assertLess(held, 60)

    def test_equal_values_give_equal_intervals(self):
        source = random.Random(3)
        values = [source.gauss(1, 0.3) for _ in range(40)]
        self.assertEqual(spread.median_interval(values), spread.median_interval(list(values)))

    def test_at_least_two_thousand_resamples(self):
        self.assertGreaterEqual(spread.RESAMPLES, 2000)

    def test_what_lies_inside_the_interval_is_none(self):
        self.assertEqual(spread.difference([0.8, 1.3, 0.7, 1.2, 0.9, 1.4, 1.0]), "none")

    def test_what_lies_outside_is_named(self):
        self.assertEqual(spread.difference([0.5, 0.52, 0.48, 0.5, 0.51, 0.49]), "vmp better by 50 %")
        self.assertEqual(spread.difference([1.5, 1.52, 1.48, 1.5, 1.51, 1.49]), "vmp worse by 50 %")

    def test_four_pairs_say_nothing(self):
        self.assertIsNone(spread.median_interval([0.5, 0.5, 0.5, 0.5]))
        self.assertEqual(spread.difference([0.5, 0.5, 0.5, 0.5]), "unknown")

    def test_a_lost_run_has_no_ratio(self):
        lost = pair(1, 0.2, None)
        self.assertEqual(spread.ratios([pair(0, 0.2, 0.1), lost], figures.final_ate_m), [0.5, None])


class Rendering(unittest.TestCase):
    made = {"town": "| a |\n", "valley": "| b |\n"}

    def test_only_what_stands_between_markers_is_replaced(self):
        text = "before\n<!-- results:town -->\nold\n<!-- /results:town -->\nafter\n"
        self.assertEqual(render.rendered(text, self.made, "X.md"),
                         "before\n<!-- results:town -->\n| a |\n<!-- /results:town -->\nafter\n")

    def test_a_rendering_renders_to_itself(self):
        text = render.rendered("<!-- results:town -->\n<!-- /results:town -->\n", self.made, "X.md")
        self.assertEqual(render.rendered(text, self.made, "X.md"), text)

    def test_unknown_and_open_markers_are_refused(self):
        for text in ("<!-- results:hill -->\n<!-- /results:hill -->\n", "<!-- results:town -->\nopen\n",
                     "<!-- results:town -->\n<!-- results:valley -->\n<!-- /results:town -->\n"):
            with self.assertRaises(store.ResultsError):
                render.rendered(text, self.made, "X.md")

    def test_pairs_show_medians_ratio_and_difference(self):
        table = manifest.find("offsets_karlsruhe")
        pairs = [pair(start, 0.2, 0.1) for start in range(6)]
        text = render.block(table, result_of(table, {"Karlsruhe": {"pairs": pairs}}))
        self.assertIn("| Karlsruhe | 6 of 6 | 0.200 / 0.100 | 0.50 (0.50 to 0.50) | vmp better by 50 % | 40 / 40 |", text)
        self.assertIn("Made at `0123456`, 2026-11-20, in 3 s; a processor, 2 cores, AVX2.", text)
        self.assertIn("tools/compare_modes kitti ../shared/data/karlsruhe 2010_03_09_0019 --offsets", text)

    def test_a_carried_table_says_so(self):
        table = manifest.find("gaps")
        result = result_of(table, {"gaps": {"columns": ["a", "b"], "cells": [["1", "2"]]}})
        result["made"]["carried_over"] = "by hand from README"
        self.assertIn("Made at `0123456`, 2026-11-20; carried over by hand from README.\n\n| a | b |\n|---|---|\n| 1 | 2 |",
                      render.block(table, result))


class Headline(unittest.TestCase):
    def test_it_has_four_figures_each_with_its_commit(self):
        results = {table.name: store.load(table.name, ROOT / "tests" / "results") for table in manifest.TABLES}
        rows = render.headline(results).splitlines()[2:]
        self.assertEqual(len(rows), 4)
        for row in rows:
            self.assertRegex(row, r"^\| .* \| .*\d.* \| `\w+`, `[0-9a-f]{7}` \|$")

    def test_figures_of_made_tables_stand_in_it(self):
        results = {table.name: store.load(table.name, ROOT / "tests" / "results") for table in manifest.TABLES}
        stage = {"p50_ms": 3.25, "p99_ms": 4.5, "p50_yardsticks": 0.41, "p99_yardsticks": 0.6}
        bench = {"stages": {"tracking": stage}, "process_cpu_yardsticks": 2, "yardstick_ms": {"p50": 8, "p99": 10}}
        results["bench"] = result_of(manifest.find("bench"), {"KITTI": bench})
        results["memory"] = result_of(manifest.find("memory"), memory_rows([160.4], [192.1, 193.8]))
        text = render.headline(results)
        self.assertIn("| 3.2, 4.5 ms; 0.41, 0.60 of `cv::ORB`'s time | `bench`, `0123456` |", text)
        self.assertIn("| 160 MB; 192 .. 194 MB | `memory`, `0123456` |", text)

    def test_a_table_that_is_not_made_leaves_it_out(self):
        self.assertNotIn("headline", render.blocks({table.name: None for table in manifest.TABLES}))


class Check(unittest.TestCase):
    """The committed texts, in a copy that may be spoilt."""

    def setUp(self):
        self.results = script("results")
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.root = pathlib.Path(scratch.name)
        (self.root / "tests").mkdir()
        for name in self.results.TEXTS:
            (self.root / name).write_text((ROOT / name).read_text())

    def findings(self):
        return list(self.results.check_texts(self.root, ROOT / "tests" / "results"))

    def spoil(self, before, after):
        path = self.root / "tests" / "RESULTS.md"
        text = path.read_text()
        self.assertIn(before, text)
        path.write_text(text.replace(before, after, 1))

    def test_the_committed_texts_are_renderings(self):
        self.assertEqual(self.findings(), [])

    def test_a_changed_figure_is_found_by_its_line(self):
        number = next(number for number, line in enumerate((self.root / "tests/RESULTS.md").read_text().splitlines(), 1)
                      if "(100.0 %)" in line)
        self.spoil("(100.0 %)", "(99.0 %)")
        self.assertEqual(self.findings(), [f"RESULTS.md:{number}: not the rendering of the results "
                                           "(tools/results --render)"])

    def test_a_table_without_markers_is_found(self):
        path = self.root / "tests" / "RESULTS.md"
        path.write_text(re.sub(r"<!-- results:gaps.*?/results:gaps -->\n", "", path.read_text(), flags=re.DOTALL))
        self.assertEqual(self.findings(), ["tests/RESULTS.md: no markers for the table gaps"])


@unittest.skipUnless(shutil.which("git"), "no git")
class Age(unittest.TestCase):
    """In a repository of its own."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.root = pathlib.Path(scratch.name)
        self.git("init", "-q")
        self.write("slam/a.cc", "1")
        self.write("docs.md", "1")
        self.commit()
        self.table = manifest.Table("t", "pairs", (manifest.Row("r", ("true",)),), ("slam",))
        self.result = result_of(self.table, {}, store.git("rev-parse", "HEAD", root=self.root),
                                store.input_hashes(("slam",), root=self.root))

    def git(self, *words):
        subprocess.run(["git", "-C", str(self.root), "-c", "user.name=n", "-c", "user.email=e", *words], check=True)

    def write(self, name, text):
        (self.root / name).parent.mkdir(exist_ok=True)
        (self.root / name).write_text(text)

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "m")

    def age(self):
        return store.age(self.table, self.result, datetime.date(2026, 11, 23), self.root)

    def test_a_table_of_unchanged_inputs_has_none(self):
        self.write("docs.md", "2")
        self.commit()
        self.assertIsNone(self.age())

    def test_a_changed_input_is_named_with_days_and_commits(self):
        for text in "23":
            self.write("slam/a.cc", text)
            self.commit()
        self.assertRegex(self.age(), r"^t: made 3 days ago at [0-9a-f]{7}, since then slam changed in 2 commits$")

    def test_a_change_that_is_taken_back_leaves_it_new(self):
        for text in "21":
            self.write("slam/a.cc", text)
            self.commit()
        self.assertIsNone(self.age())

    def test_an_uncommitted_change_counts(self):
        self.write("slam/a.cc", "2")
        self.assertIn("slam changed", self.age())

    def test_of_a_configuration_only_the_named_sections_count(self):
        text = "a:\n  # comment\n  x: 1\nb:\n  x: 1\nab:\n  x: 1\n"
        names = ["a", "ab"]
        same, other = store.sections_hash(text, names), store.sections_hash
        self.assertEqual(same, other(text.replace("# comment", "# another"), names))
        self.assertEqual(same, other(text.replace("b:\n  x: 1\nab", "b:\n  x: 2\nab"), names))
        self.assertNotEqual(same, other(text.replace("a:\n  # comment\n  x: 1", "a:\n  # comment\n  x: 2"), names))
        self.assertNotEqual(same, other(text.replace("ab:\n  x: 1", "ab:\n  x: 2"), names))

    def test_another_section_of_the_configuration_leaves_it_new(self):
        table = dataclasses.replace(self.table, inputs=("conf.yaml#a",))
        self.write("conf.yaml", "a:\n  x: 1\nb:\n  x: 1\n")
        self.commit()
        self.result["made"]["inputs"] = store.input_hashes(table.inputs, root=self.root)
        self.write("conf.yaml", "a:\n  x: 1\nb:\n  x: 2\n")
        self.assertIsNone(store.age(table, self.result, root=self.root))
        self.commit()
        self.assertIsNone(store.age(table, self.result, root=self.root))
        self.write("conf.yaml", "a:\n  x: 2\nb:\n  x: 2\n")
        self.assertIn("conf.yaml changed", store.age(table, self.result, root=self.root))
        self.commit()
        self.assertIn("conf.yaml changed in 3 commits", store.age(table, self.result, root=self.root))

    def test_another_command_makes_it_old(self):
        self.result["made"]["commands"] = ["false"]
        self.assertIn("its command changed", self.age())

    def test_a_table_without_result_is_not_made(self):
        self.assertEqual(store.age(self.table, None, root=self.root), "t: not made yet")


class Comparison(unittest.TestCase):
    def test_equal_results_have_no_difference(self):
        self.assertEqual(list(making.differences({"a": [1, {"b": 0.1}]}, {"a": [1, {"b": 0.1}]})), [])

    def test_the_last_digit_is_a_difference(self):
        self.assertEqual(list(making.differences({"a": {"b": [0.1, 0.2]}}, {"a": {"b": [0.1, 0.2000000001]}})),
                         ["a.b[1]: 0.2 in the file, 0.2000000001 now"])

    def test_a_missing_row_is_a_difference(self):
        self.assertEqual(len(list(making.differences({"a": 1, "b": 2}, {"a": 1}))), 1)

    def test_results_come_back_from_their_file_unchanged(self):
        table = manifest.find("offsets_karlsruhe")
        result = result_of(table, {"r": {"pairs": [pair(1, 0.123456789012, 0.1)], "z": 1}, "s": {"pairs": []}})
        with tempfile.TemporaryDirectory() as name:
            store.save(result, pathlib.Path(name))
            self.assertEqual(store.load(table.name, pathlib.Path(name)), result)
            for key in ("pairs", "runs", "tests", "scenarios"):
                result["rows"]["r"] = {"a": 1, key: [{"b": 2}, {"b": 3}]}
                store.save(result, pathlib.Path(name))
                self.assertEqual(store.load(table.name, pathlib.Path(name)), result)
                self.assertIn('\n{"b": 3}', (pathlib.Path(name) / f"{table.name}.json").read_text())

    def test_measured_times_are_not_kept(self):
        kept = json.dumps(figures.repeatable({"tracking_ms": {"p50": 1}, "peak_resident_mb": 2, "final": {"n": 3}}))
        self.assertNotRegex(kept, "_ms|_mb")


class Making(unittest.TestCase):
    def make_row(self, *commands, **options):
        table = manifest.Table("t", "bench", (manifest.Row("r", commands),), **options)
        return making.make_row(table, table.rows[0], {"bin": "/bin", "data": "", "root": ROOT, "jobs": ""})

    def test_the_last_command_of_a_row_is_kept(self):
        self.assertEqual(self.make_row("echo '[1, 2]' > made.json", "{bin}/cat made.json"), [1, 2])

    def test_a_failed_command_is_named_with_what_it_said(self):
        with self.assertRaisesRegex(store.ResultsError, "status 3 of .*no recording"):
            self.make_row("echo no recording >&2; exit 3")

    def test_a_program_that_fails_before_a_pipe_is_found(self):
        with self.assertRaisesRegex(store.ResultsError, "status 4"):
            self.make_row("(echo 1; exit 4) | cat")

    def test_a_failed_check_is_a_result_where_the_table_shows_it(self):
        self.assertEqual(self.make_row("echo 5; exit 1", shows_failures=True), 5)
        for command, shows in (("echo 5; exit 1", False), ("echo 5; exit 2", True), ("exit 1", True)):
            with self.assertRaises(store.ResultsError):
                self.make_row(command, shows_failures=shows)

    def test_of_live_runs_the_usual_figures_are_kept(self):
        run = {"speed": 1, "final": {"ate_rmse_m": 1, "mean": 2}, "live": {}, "memory": {"peak_mb": 3}}
        (kept,) = figures.live({"load": {}, "runs": [run]})["runs"]
        self.assertEqual((kept["final"]["ate_rmse_m"], kept["memory"]), (1, {"peak_mb": 3}))
        self.assertNotIn("mean", kept["final"])
        self.assertEqual(figures.live({"runs": [{"name": "out"}]}), {"runs": [{"name": "out"}]})

    def test_a_build_of_no_commit_is_refused(self):
        with self.assertRaises(store.ResultsError):
            making.refuse_unnamed_build(manifest.TABLES[0], "0123456789ab-dirty")


class WithDaemon(unittest.TestCase):
    """A folder of programs whose farpointd only names its commit."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.daemon_of("0123456789ab")

    def daemon_of(self, commit):
        daemon = self.folder / "farpointd"
        daemon.write_text(f"#!/bin/sh\necho farpointd 0.1.0 {commit} gcc Release\n")
        daemon.chmod(0o755)


class Interrupted(WithDaemon):
    def setUp(self):
        super().setUp()
        self.ran = self.folder / "ran"
        self.table = manifest.Table("t", "bench", (
            manifest.Row("a", (f"echo a >> {self.ran}; echo 1",)),
            manifest.Row("b", (f"test -e {self.folder}/ready && echo 2",))))

    def make(self):
        return making.make(self.table, self.folder, "", 1, self.folder)

    def test_finished_rows_are_not_run_again(self):
        with self.assertRaises(store.ResultsError):
            self.make()
        (self.folder / "ready").touch()
        self.assertEqual(self.make()["rows"], {"a": 1, "b": 2})
        self.assertEqual(self.ran.read_text(), "a\n")

    def test_rows_of_another_build_are(self):
        with self.assertRaises(store.ResultsError):
            self.make()
        (self.folder / "ready").touch()
        self.daemon_of("ba9876543210")
        self.make()
        self.assertEqual(self.ran.read_text(), "a\na\n")

    def test_a_finished_table_starts_anew(self):
        (self.folder / "ready").touch()
        self.make()
        self.make()
        self.assertEqual(self.ran.read_text(), "a\na\n")


class AllOfThem(WithDaemon):
    """Which tables --all makes, and that one which cannot be made stops none."""

    def setUp(self):
        super().setUp()
        self.results = script("results")
        self.tables = tuple(manifest.Table(name, "bench", (manifest.Row("r", (command,)),), timed=timed, minutes=3)
                            for name, command, timed in (("timed", "echo {}", True), ("broken", "exit 3", False),
                                                         ("other", "echo {}", False)))
        for target, value in ((manifest, {"TABLES": self.tables}), (store, {"FOLDER": self.folder}),
                              (self.results, {"write_texts": lambda: None})):
            patch = unittest.mock.patch.multiple(target, **value)
            patch.start()
            self.addCleanup(patch.stop)
        self.loaded = unittest.mock.patch.object(store, "load", lambda name, folder=self.folder: (
            json.loads((folder / f"{name}.json").read_text()) if (folder / f"{name}.json").is_file() else None))
        self.loaded.start()
        self.addCleanup(self.loaded.stop)

    def save(self, name, commit, **made):
        table = manifest.find(name)
        result = result_of(table, {"r": {}}, commit)
        result["made"].update(made)
        store.save(result, self.folder)

    def chosen(self):
        return [table.name for table in self.results.chosen(self.results.options(["--all", "--bin", str(self.folder)]))]

    def test_times_are_measured_last(self):
        self.assertEqual(self.chosen(), ["broken", "other", "timed"])

    def test_what_this_build_has_made_is_left_out(self):
        self.save("timed", "0123456789ab" + "0" * 28)
        self.save("broken", "f" * 40)
        self.save("other", "0123456789ab" + "0" * 28, carried_over="by hand")
        self.assertEqual(self.chosen(), ["broken", "other"])

    def test_another_command_is_made_again(self):
        self.save("timed", "0123456789ab" + "0" * 28, commands=["false"])
        self.assertIn("timed", self.chosen())

    def test_a_table_that_cannot_be_made_stops_none(self):
        o = self.results.options(["--all", "--bin", str(self.folder)])
        saved = []
        with unittest.mock.patch.object(store, "save", lambda result: saved.append(result["table"])), \
                unittest.mock.patch.object(making, "PARTIAL", self.folder), \
                contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
            self.assertFalse(self.results.make_tables(o))
        self.assertEqual(saved, ["other", "timed"])
        self.assertIn("not made: broken", said.getvalue())

    def test_the_list_has_minutes(self):
        self.save("timed", "0123456789ab", seconds=600)
        results = {table.name: store.load(table.name) for table in self.tables}
        with contextlib.redirect_stdout(io.StringIO()) as printed, \
                unittest.mock.patch.object(self.results, "load_all", lambda: results):
            self.results.list_tables()
        self.assertIn("broken: not made yet; about 3 min\n", printed.getvalue())
        self.assertIn("accuracy: 2 tables, about 6 min\nall: 3 tables, about 16 min\n", printed.getvalue())


class CheckLong(WithDaemon):
    """A table that is made again, by a command that only prints."""

    def setUp(self):
        super().setUp()
        self.table = manifest.Table("t", "bench", (manifest.Row("r", ("echo '{\"ate_m\": 0.206}'",)),), long=True)
        self.results = script("results")

    def findings(self, ate_m, simd=None, table_changes=()):
        result = making.make(self.table, self.folder, "", 1, self.folder)
        result["rows"]["r"]["ate_m"] = ate_m
        result["made"].update(table_changes)
        if simd:
            result["made"]["machine"]["simd"] = simd
        store.save(result, self.folder)
        o = self.results.options(["--check", "--long", "--bin", str(self.folder)])
        with unittest.mock.patch.object(manifest, "TABLES", (self.table,)), \
                contextlib.redirect_stdout(io.StringIO()) as printed:
            return list(self.results.check_again(o, self.folder)), printed.getvalue()

    def test_the_same_figures_are_no_finding(self):
        self.assertEqual(self.findings(0.206), ([], "t: every figure is the same again\n"))

    def test_another_last_digit_is(self):
        self.assertEqual(self.findings(0.2060000001)[0], ["t: r.ate_m: 0.2060000001 in the file, 0.206 now"])

    def test_another_instruction_set_is_not_compared_and_said(self):
        findings, printed = self.findings(0.3, "another")
        self.assertEqual(findings, [])
        self.assertIn("t: not compared: made with another", printed)

    def test_a_carried_table_is_a_finding(self):
        self.assertEqual(len(self.findings(0.206, table_changes={"carried_over": "by hand"})[0]), 1)


class Manifest(unittest.TestCase):
    def test_names_are_unique_and_have_files_or_are_not_made(self):
        names = [table.name for table in manifest.TABLES]
        self.assertEqual(len(names), len(set(names)))
        files = {path.stem for path in (ROOT / "tests" / "results").glob("*.json")}
        self.assertEqual(files - set(names), set())

    def test_inputs_exist(self):
        for table in manifest.TABLES:
            for path in table.inputs:
                file, _, names = path.partition("#")
                self.assertTrue((ROOT / file).exists(), f"{table.name}: {path}")
                sections = set(re.findall(r"^(\w+):", (ROOT / file).read_text(), re.MULTILINE)) if names else set()
                self.assertLessEqual(set(names.split(",")) - {""}, sections, f"{table.name}: {path}")

    def test_each_script_that_takes_the_programs_folder_is_given_it(self):
        scripts = {command.split()[0] for table in manifest.TABLES for command in table.commands
                   if command.startswith("tools/")}
        taking = {script for script in scripts if "\n  --bin DIR" in (ROOT / script).read_text()}
        self.assertEqual(taking, set(making.TAKING_BIN))

    def test_every_command_exists(self):
        lists = "\n".join(path.read_text() for folder in ("tests", "daemon", "tools")
                          for path in (ROOT / folder).glob("CMakeLists.txt"))
        targets = set(re.findall(r"(?:add_executable|farpoint_test|farpoint_test_program)\((\w+)", lists))
        for table in manifest.TABLES:
            self.assertTrue(table.commands, table.name)
            for command in table.commands:
                program, *words = command.split()
                if program == "sed":
                    continue
                if program.startswith("{bin}/"):
                    self.assertIn(program.removeprefix("{bin}/"), targets, f"{table.name}: {command}")
                else:
                    self.assertTrue((ROOT / program).is_file(), f"{table.name}: {command}")
                if program == "{bin}/farpoint":
                    self.assertTrue((ROOT / f"tools/commands/{words[0]}_command.cc").is_file(), command)

    def test_no_table_is_made_by_hand(self):
        for table in manifest.TABLES:
            self.assertIn(table.kind, render.KINDS, table.name)
            self.assertIn(table.kind, making.KEEP, table.name)
            for row in table.rows:
                self.assertRegex(row.commands[-1], r" --json$|^tools/(count_instructions|live_runs|lost_runs|test_figures) ", table.name)

    def test_every_suite_of_a_command_exists(self):
        sources = "\n".join(path.read_text() for path in (ROOT / "tests").rglob("*_test.cc"))
        for table in manifest.TABLES:
            for suite in re.findall(r"gtest_filter='\*?(\w+)", " ".join(table.commands)):
                self.assertRegex(sources, rf"TEST\w*\({suite},|INSTANTIATE_TEST_SUITE_P\(\w*,?\s*{suite}", table.name)

    def test_modes_are_compared_on_twenty_seeds(self):
        for table in manifest.TABLES:
            if table.kind in ("pairs", "scenes"):
                for command in table.commands:
                    seeds = re.search(r"--seeds (\d+-)?(\d+)", command)
                    self.assertTrue(seeds is None or int(seeds.group(2)) >= 20, command)


class Terminal(io.StringIO):
    def isatty(self):
        return True


class ProgressBar(unittest.TestCase):
    def test_without_terminal_nothing_is_written(self):
        stream = io.StringIO()
        bar = Progress(2, "town", stream)
        bar.step()
        bar.close()
        self.assertEqual(stream.getvalue(), "")

    def test_the_time_left_follows_from_the_steps_done(self):
        stream, times = Terminal(), iter([0, 30])
        Progress(4, "town", stream, lambda: next(times)).step()
        self.assertTrue(stream.getvalue().endswith("1/4, 1:30 left"), stream.getvalue())


if __name__ == "__main__":
    unittest.main()
