#!/usr/bin/env python3
"""The tree check finds what it promises to find, and nothing else."""

import pathlib
import tempfile
import unittest

import check_tree


class CheckTree(unittest.TestCase):
    def findings(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "slam").mkdir()
            for path, text in files.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text)
            return check_tree.check(root)

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


if __name__ == "__main__":
    unittest.main()
