#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which skipped tests are excused."""

import unittest

import skipped_tests


def results(*cases):
    return "<testsuite>" + "".join(cases) + "</testsuite>"


def skipped(name, reason):
    return (f'<testcase name="{name}" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>'
            f"<system-out>[ RUN      ] {name}\n/x/t.cc:2: Skipped\n{reason}\n[  SKIPPED ] {name} (0 ms)\n"
            "</system-out></testcase>")


class SkippedTests(unittest.TestCase):
    def test_passed_and_failed_tests_are_not_skipped(self):
        self.assertEqual(skipped_tests.unexcused(results('<testcase name="A.B" status="run"/>',
                                                         '<testcase name="A.C" status="fail"/>')), [])

    def test_missing_recordings_are_no_excuse(self):
        self.assertEqual(skipped_tests.unexcused(results(skipped("A.B", "no recordings in ../shared/data"))),
                         [("A.B", "no recordings in ../shared/data")])

    def test_a_missing_permission_is(self):
        self.assertEqual(skipped_tests.unexcused(results(skipped("A.B", "no permission for a network"))), [])

    def test_a_skip_without_reason_is_not(self):
        found = skipped_tests.unexcused(results('<testcase name="A.B" status="disabled"/>'))
        self.assertEqual(found, [("A.B", "no reason given, status 'disabled'")])


if __name__ == "__main__":
    unittest.main()
