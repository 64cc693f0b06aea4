#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The README check finds folders without one, and paths that are not there."""

import pathlib
import tempfile
import unittest

import check_readmes


class CheckReadmes(unittest.TestCase):
    def findings(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path, text in {"README.md": "", **files}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text)
            return check_readmes.check(root)

    def test_folders_of_the_programs_have_a_readme_of_their_own(self):
        files = {"slam/README.md": "`map/`", "slam/map/a.h": ""}
        self.assertEqual(self.findings(files), ["slam/map: no README.md"])
        self.assertEqual(self.findings({**files, "slam/map/README.md": ""}), [])

    def test_other_folders_may_be_named_above(self):
        files = {"tools/README.md": "", "tools/import/a.h": ""}
        self.assertEqual(self.findings(files), ["tools/import: no README.md, and none above names it"])
        for text in ["`import/`", "`tools/import`", "`tools/import/`", "[x](import/a.h)"]:
            self.assertEqual(self.findings({**files, "tools/README.md": text}), [], text)

    def test_paths_in_backticks_exist(self):
        files = {"slam/README.md": "`slam/a.h` `a.h` `slam/a` `farpointd --help` `a/b` `run.lcm` `T_a_b`", "slam/a.h": ""}
        self.assertEqual(self.findings(files), [])
        for name in ["slam/b.h", "b.h", "slam/b", "slam/x/"]:
            self.assertEqual(self.findings({**files, "slam/README.md": f"`{name}`"}),
                             [f"slam/README.md: `{name}` is not there"])

    def test_links_lead_somewhere(self):
        self.assertEqual(self.findings({"ipc/README.md": "[a](../README.md) [b](https://example.org) [c](#d)"}), [])
        self.assertEqual(self.findings({"ipc/README.md": "[a](b.md)"}), ["ipc/README.md: link to b.md, which is not there"])

    def test_command_lines_are_no_paths(self):
        self.assertEqual(self.findings({"ipc/README.md": "```\n`slam/b.h`\n```\n"}), [])


if __name__ == "__main__":
    unittest.main()
