#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""config/vehicles/calibrate.py on rendered chessboards: the lens is found again, and unsuitable pictures are refused.

usage: calibrate_test.py SOURCE_FOLDER      Status 77 without python3-opencv.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import cv2
    import chessboard
except ImportError:
    print("calibrate_test.py: no python3-opencv")
    sys.exit(77)

SCRIPT = pathlib.Path(sys.argv.pop(1)) / "config/vehicles/calibrate.py"


class Calibrating(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def calibrate(self, *arguments):
        pictures = sorted(map(str, (self.folder / "board").glob("*.png")))
        return subprocess.run([sys.executable, "-B", str(SCRIPT), *pictures, "-o", str(self.folder / "camera.yaml"), *arguments],
                              capture_output=True, text=True, check=False)

    def render(self, lens, count=15):
        chessboard.write_pictures(lens, self.folder / "board", count)

    def found(self):
        lines = (self.folder / "camera.yaml").read_text().splitlines()
        return dict(line.split(": ", 1) for line in lines)

    def expect_lens(self, lens, relative):
        found, matrix = self.found(), lens["matrix"]
        for key, true in (("fx_px", matrix[0, 0]), ("fy_px", matrix[1, 1])):
            self.assertAlmostEqual(float(found[key]), true, delta=relative * true, msg=key)
        for key, true in (("cx_px", matrix[0, 2]), ("cy_px", matrix[1, 2])):
            self.assertAlmostEqual(float(found[key]), true, delta=relative * matrix[0, 0], msg=key)
        self.assertEqual((int(found["width_px"]), int(found["height_px"])), lens["size"])

    def test_a_pinhole_is_found_again(self):
        self.render(chessboard.PINHOLE)
        done = self.calibrate("--corners", "9x6")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.found()["model"], "pinhole-radtan")
        self.expect_lens(chessboard.PINHOLE, 0.001)
        self.assertIn("15 of 15 pictures", done.stdout)

    def test_a_fisheye_is_found_again(self):
        self.render(chessboard.FISHEYE)
        done = self.calibrate("--corners", "9x6", "--fisheye")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.found()["model"], "kannala-brandt")
        self.expect_lens(chessboard.FISHEYE, 0.001)

    def expect_refusal(self, part, *arguments):
        done = self.calibrate(*arguments)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(part, done.stderr)
        self.assertFalse((self.folder / "camera.yaml").exists())

    def test_unsuitable_pictures_are_refused_in_one_line(self):
        self.render(chessboard.PINHOLE, 2)
        self.expect_refusal("0 of 2 pictures show the board of 8x5 inner corners, expected 10 or more; is --corners right?",
                            "--corners", "8x5")
        last = self.folder / "board/0001.png"
        image = cv2.imread(str(last))
        cv2.imwrite(str(last), image[:300])
        self.expect_refusal("0001.png: 480x300, expected 480x360", "--corners", "9x6")
        last.write_text("no picture")
        self.expect_refusal("0001.png: cannot be read", "--corners", "9x6")

    def test_pictures_of_two_lenses_are_refused(self):
        self.render(chessboard.FISHEYE, 12)
        chessboard.write_pictures(chessboard.PINHOLE, self.folder / "board", 6)
        self.expect_refusal("expected at most 1.0", "--corners", "9x6")

    def test_wrong_use_is_status_two(self):
        done = self.calibrate("--corners", "nine")
        self.assertEqual(done.returncode, 2)
        self.assertIn("like 9x6", done.stderr)


if __name__ == "__main__":
    unittest.main()
