#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The word check finds what the rule refuses, where people read it."""

import pathlib
import tempfile
import unittest

import check_words


def found(path, text):
    return list(check_words.findings_of(path, text))


class CheckWords(unittest.TestCase):
    def test_objects_that_know_want_or_hear_are_found(self):
        for text in ["// The camera wants less light.", "// A map that knows its age.", "// The thread hears of it.",
                     "// which speaks LCM", "// The kernel does not know the rate."]:
            self.assertEqual(len(found("a.h", text)), 1, text)

    def test_people_may_know_and_want(self):
        self.assertEqual(found("a.h", "// An operator may want to know the rate."), [])

    def test_the_phrases_of_the_rule_are_found(self):
        for text in ["// Views in somebody's hands at once", "// its motion says nothing any more", "// so many frames",
                     "// wanders for ever", "// the one that is told of it", "// moves nothing", "// all but two",
                     "// The next frame bears it out."]:
            self.assertGreaterEqual(len(found("a.cc", text)), 1, text)

    def test_code_is_no_text(self):
        self.assertEqual(found("a.cc", "if (camera.wants(this) && so_many) nobody();"), [])
        self.assertEqual(found("a.cc", 'send("udp://x", nobody());'), [])
        self.assertEqual(found("a.py", "nobody = so / many"), [])

    def test_messages_are_text(self):
        self.assertEqual(len(found("a.cc", 'throw Error("the camera knows no rate");')), 1)
        self.assertEqual(len(found("a.py", 'print("for ever")')), 1)

    def test_readmes_are_text(self):
        self.assertEqual(len(found("README.md", "It runs for ever.")), 1)

    def test_phrases_over_two_lines_are_found_once(self):
        self.assertEqual(len(found("a.h", "// Waits for\n// ever and\n// ever")), 1)
        self.assertEqual(len(found("a.h", "// for ever\n// and more\n")), 1)

    def test_listed_files_are_left_out_until_they_are_clean(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "tests/tree").mkdir(parents=True)
            (root / "slam").mkdir()
            (root / "README.md").write_text("Short.\n")
            (root / "slam/a.h").write_text("// for ever\n")
            (root / check_words.NOT_YET).write_text("# not yet\nslam/a.h\nslam/gone.h\n")
            self.assertEqual(len(check_words.check(root)), 1)  # the file that is gone
            (root / "slam/a.h").write_text("// without end\n")
            findings = check_words.check(root)
            self.assertEqual(len(findings), 2)
            self.assertIn("slam/a.h is clean", findings[0])
            check_words.prune(root)
            self.assertEqual(check_words.check(root), [])
            self.assertEqual((root / check_words.NOT_YET).read_text(), "# not yet\n")


if __name__ == "__main__":
    unittest.main()
