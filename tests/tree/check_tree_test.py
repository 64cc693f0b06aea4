#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tree check finds what it promises to find, and nothing else."""

import pathlib
import tempfile
import unittest

import check_tree


class CheckTree(unittest.TestCase):
    def findings(self, files, of=check_tree.check):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "slam").mkdir()
            for path, text in files.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text)
            return of(root)

    def assert_refused(self, path, line, word):
        found = self.findings({path: line + "\n"})
        found = [finding for finding in found if "pragma once" not in finding]
        self.assertEqual(len(found), 1, found)
        self.assertIn(word, found[0])
        self.assertTrue(found[0].startswith(path + ":1: "), found[0])

    def assert_accepted(self, path, line):
        self.assertEqual(self.findings({path: "#pragma once\n" + line + "\n"}), [])

    def test_arrows_against_the_direction_are_refused(self):
        for path, target in [("slam/geometry/a.cc", "slam/image/feature.h"), ("slam/image/a.cc", "slam/map/map.h"),
                             ("slam/map/a.cc", "slam/mapping/mapper.h"), ("slam/map/a.cc", "slam/estimator.h"),
                             ("slam/tracking/a.cc", "slam/mapping/mapper.h"),
                             ("slam/mapping/a.cc", "slam/tracking/tracker.h"), ("slam/a.cc", "ipc/log.h"),
                             ("slam/geometry/a.cc", "farpoint/pose_t.hpp"), ("ipc/a.cc", "slam/config.h"), ("slam/image/a.cc", "slam/config.h"),
                             ("slam/config.h", "slam/map/map.h"), ("slam/config.h", "slam/estimator.h"),
                             ("ipc/a.cc", "drivers/log/log_source.h"), ("drivers/a.cc", "slam/estimator.h"),
                             ("daemon/a.cc", "slam/map/map.h"), ("daemon/a.cc", "tools/common/json.h"),
                             ("tools/import/a.cc", "daemon/config/rig.h"), ("slam/stages.h", "slam/geometry/se3.h"),
                             ("slam/image/a.cc", "slam/stages.h"), ("tools/bench/a.cc", "slam/map/map.h"), ("tools/import/a.cc", "slam/mapping/mapper.h")]:
            self.assert_refused(path, f'#include "{target}"', target)

    def test_arrows_along_the_direction_are_accepted(self):
        for path, target in [("slam/image/a.cc", "slam/geometry/se3.h"), ("slam/mapping/a.cc", "slam/map/map.h"),
                             ("slam/a.cc", "slam/tracking/tracker.h"), ("slam/map/a.cc", "slam/config.h"),
                             ("slam/config.h", "slam/image/pyramid.h"), ("slam/a.cc", "slam/config.h"),
                             ("daemon/a.cc", "slam/estimator.h"), ("daemon/a.cc", "farpoint_build.h"),
                             ("drivers/a.cc", "ipc/log.h"), ("ipc/a.cc", "farpoint/pose_t.hpp"),
                             ("tools/evaluate/a.cc", "slam/geometry/se3.h"), ("daemon/a.cc", "daemon/config/rig.h"), ("slam/tracking/a.cc", "slam/stages.h"),
                             ("tools/bench/a.cc", "daemon/config/rig.h"), ("tools/import/a.cc", "daemon/config/camera_file.h"), ("tools/commands/a.cc", "tools/bench/report.h")]:
            self.assert_accepted(path, f'#include "{target}"')

    def test_the_estimator_stays_pure(self):
        for header in ["iostream", "fstream", "thread", "mutex", "chrono", "spdlog/spdlog.h", "cstdio"]:
            self.assert_refused("slam/mapping/a.cc", f"#include <{header}>", header)
            self.assert_accepted("daemon/a.cc", f"#include <{header}>")
        self.assert_refused("slam/tracking/a.cc", "#include <ceres/ceres.h>", "ceres")
        self.assert_accepted("slam/mapping/a.cc", "#include <ceres/ceres.h>")

    def test_relative_includes_and_unknown_folders_are_refused(self):
        self.assert_refused("ipc/a.cc", '#include "log.h"', "root of the repository")
        self.assertIn("no rule", self.findings({"slam/magic/a.cc": "\n"})[0])

    def test_headers_have_their_guard(self):
        self.assertEqual(self.findings({"slam/map/a.h": "#pragma once\n"}), [])
        self.assertIn("pragma once", self.findings({"slam/map/a.h": "// #pragma once is missing\n"})[0])

    def test_long_files_say_why(self):
        lines = "\n" * (check_tree.MAX_LINES + 1)
        self.assertIn("lines", self.findings({"tests/map/a.cc": lines})[0])
        self.assertEqual(self.findings({"tests/map/a.cc": "// Long file: one table.\n" + lines}), [])
        self.assertEqual(self.findings({"tests/map/a.cc": lines[1:]}), [])

    def warnings(self, files):
        return self.findings(files, check_tree.warnings)

    def test_large_classes_are_warned_of(self):
        members = "".join(f"  int a{i}_ = f(b_, {{c_}});\n" for i in range(check_tree.MEMBERS_TO_WARN))
        clutter = "  static int s_;\n  int f() const { return x_ + y_; }\n  // int commented_;\n"
        text = "#pragma once\nclass A final : public B {\n" + clutter + members + "};\n"
        self.assertEqual(self.warnings({"slam/map/a.h": text}), [])
        more = text.replace("  static", "  std::map<int, C> z_, y_{};\n  static")
        self.assertIn(f"class A has {check_tree.MEMBERS_TO_WARN + 2} members", self.warnings({"slam/map/a.h": more})[0])
        self.assertEqual(self.warnings({"slam/map/a.h": more + "// Large class: one table.\n"}), [])
        self.assertEqual(self.findings({"slam/map/a.h": more}), [])

    def test_structs_hold_no_invariants(self):
        members = "".join(f"  int a{i}_;\n" for i in range(2 * check_tree.MEMBERS_TO_WARN))
        self.assertEqual(self.warnings({"slam/map/a.h": "#pragma once\nstruct A {\n" + members + "};\n"}), [])

    def test_longish_files_are_warned_of(self):
        lines = "\n" * (check_tree.LINES_TO_WARN + 1)
        self.assertIn("more than 500", self.warnings({"tests/map/a.cc": lines})[0])
        self.assertEqual(self.warnings({"tests/map/a.cc": lines[1:]}), [])
        self.assertEqual(self.warnings({"tests/map/a.cc": "// Long file: one table.\n" + lines}), [])

    def test_large_folders_are_warned_of(self):
        files = {f"ipc/a{i}.cc": "" for i in range(check_tree.UNITS_TO_WARN)} | {"ipc/a0.h": ""}
        self.assertEqual(self.warnings(files), [])
        files["ipc/b.cc"] = ""
        self.assertIn("ipc: 21 units", self.warnings(files)[0])
        self.assertEqual(self.warnings(files | {"ipc/README.md": "Large folder: one type each."}), [])

    def test_sources_name_their_licence(self):
        line = check_tree.SPDX
        for path, content in {"slam/a.h": f"// {line}\n", "tools/a.py": f"#!/usr/bin/env python3\n# {line}\n",
                              "ipc/CMakeLists.txt": f"# {line}\n", "ipc/README.md": "text\n"}.items():
            self.assertEqual(self.findings({path: content}, lambda root: list(check_tree.check_spdx(root))), [], path)
        for path, content in {"slam/a.h": f"#pragma once\n// {line}\n", "tools/a.py": "", "systemd/CMakeLists.txt": "\n"}.items():
            found = self.findings({path: content}, lambda root: list(check_tree.check_spdx(root)))
            self.assertEqual(found, [f"{path}: does not begin with '{line}'"])


if __name__ == "__main__":
    unittest.main()
