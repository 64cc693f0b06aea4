#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: calibrate.py PICTURE... --corners COLUMNSxROWS [--fisheye] -o CAMERA.yaml

Calibrates a camera by OpenCV (package python3-opencv) from pictures of a chessboard, and writes a camera file.
--corners counts inner corners: a board of 10x7 squares has 9x6. --fisheye takes the model kannala-brandt, for lenses
wider than about 110 degrees. Status: 0 written, 1 the pictures give no good calibration, 2 wrong use.
"""

import argparse
import pathlib
import re
import sys

import cv2
import numpy as np

LEAST_PICTURES = 10
MOST_RMS_PX = 1.0
GRID = (8, 6)  # cells of the image in which corners are looked for
LEAST_COVERAGE = 0.6
FOCAL_SIGMA = 0.003  # default of the key calibration.focal_sigma


class Unusable(Exception):
    """Why there is no calibration, one line."""


def refined(image, points, corners):
    """Corners to a fraction of a pixel. The detectors' own places are off by up to 0.2 px where squares are small."""
    grid = points.reshape(corners[1], corners[0], 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1)]
    half_window = int(np.clip(0.3 * min(steps), 3, 11))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-4)
    return cv2.cornerSubPix(image, points.reshape(-1, 1, 2), (half_window, half_window), (-1, -1), criteria)


def find_corners(picture, corners):
    """(size, corners found) of one picture; None in place of corners where the whole board is not in it."""
    image = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise Unusable(f"{picture}: cannot be read, expected a picture")
    size = (image.shape[1], image.shape[0])
    found, points = cv2.findChessboardCorners(image, corners)
    if not found:
        found, points = cv2.findChessboardCornersSB(image, corners)
    return size, refined(image, points.astype(np.float32), corners).reshape(-1, 2) if found else None


def read_pictures(pictures, corners):
    """(size, names, corners) of the pictures that show the board."""
    size, names, seen = None, [], []
    for picture in pictures:
        its_size, points = find_corners(picture, corners)
        if size is not None and its_size != size:
            raise Unusable(f"{picture}: {its_size[0]}x{its_size[1]}, expected {size[0]}x{size[1]} as the pictures before")
        size = its_size
        if points is not None:
            names.append(str(picture))
            seen.append(points)
    shown = f"{len(seen)} of {len(pictures)} pictures show the board of {corners[0]}x{corners[1]} inner corners"
    if len(seen) < LEAST_PICTURES:
        raise Unusable(f"{shown}, expected {LEAST_PICTURES} or more; is --corners right?")
    print(shown)
    return size, names, seen


def board(corners):
    """The board's corners in squares; its true size does not change the calibration."""
    points = np.zeros((corners[0] * corners[1], 3), np.float32)
    points[:, :2] = np.mgrid[0:corners[0], 0:corners[1]].T.reshape(-1, 2)
    return points


def coverage(seen, size):
    """Share of the image's cells that held a corner in some picture."""
    points = np.concatenate(seen)
    cells = {(int(x * GRID[0] / size[0]), int(y * GRID[1] / size[1])) for x, y in points}
    return len(cells) / (GRID[0] * GRID[1])


def calibrate_pinhole(seen, size, corners):
    """Camera matrix, coefficients, relative sigma of the focal length, RMS error of each picture."""
    objects = [board(corners)] * len(seen)
    _, matrix, distortion, _, _, sigmas, _, errors = cv2.calibrateCameraExtended(objects, seen, size, None, None)
    return matrix, distortion.ravel()[:5], float(sigmas[0, 0] / matrix[0, 0]), errors.ravel()


def calibrate_fisheye(seen, size, corners):
    objects = [board(corners).reshape(1, -1, 3).astype(np.float64)] * len(seen)
    images = [points.reshape(1, -1, 2).astype(np.float64) for points in seen]
    flags = cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW
    matrix, distortion = np.eye(3), np.zeros((4, 1))
    _, matrix, distortion, turns, places = cv2.fisheye.calibrate(objects, images, size, matrix, distortion, None, None, flags)
    errors = []
    for points, image, turn, place in zip(objects, images, turns, places):
        projected, _ = cv2.fisheye.projectPoints(points, turn, place, matrix, distortion)
        errors.append(float(np.sqrt(np.mean(np.sum((projected - image) ** 2, axis=-1)))))
    return matrix, distortion.ravel(), None, np.array(errors)


def camera_file(model, size, matrix, distortion):
    values = {"model": model, "width_px": size[0], "height_px": size[1], "fx_px": f"{matrix[0, 0]:.4f}",
              "fy_px": f"{matrix[1, 1]:.4f}", "cx_px": f"{matrix[0, 2]:.4f}", "cy_px": f"{matrix[1, 2]:.4f}",
              "distortion": "[" + ", ".join(f"{value:.7g}" for value in distortion) + "]"}
    return "".join(f"{name}: {value}\n" for name, value in values.items())


def report(matrix, focal_sigma, errors, names, seen, size):
    """Prints how good it is; returns its RMS error."""
    rms = float(np.sqrt(np.mean(errors ** 2)))
    width_deg = 2 * np.degrees(np.arctan(size[0] / (2 * matrix[0, 0])))
    print(f"RMS error {rms:.3f} px; focal length {matrix[0, 0]:.1f} px (as a pinhole {width_deg:.0f} degrees wide)")
    worst = int(np.argmax(errors))
    if errors[worst] > 3 * np.median(errors):
        print(f"note: {names[worst]} alone has {errors[worst]:.2f} px; leave it out if it is blurred")
    if focal_sigma is not None and focal_sigma > FOCAL_SIGMA:
        print(f"note: the focal length is certain to {100 * focal_sigma:.2f} % only; tilt the board more, take more pictures")
    share = coverage(seen, size)
    if share < LEAST_COVERAGE:
        print(f"note: corners cover {100 * share:.0f} % of the image; hold the board into the corners and edges too")
    return rms


def calibrate(options):
    size, names, seen = read_pictures(options.pictures, options.corners)
    how = calibrate_fisheye if options.fisheye else calibrate_pinhole
    try:
        matrix, distortion, focal_sigma, errors = how(seen, size, options.corners)
    except cv2.error as error:
        raise Unusable(f"OpenCV finds no calibration ({str(error).strip().splitlines()[-1]}); tilt the board more") from error
    rms = report(matrix, focal_sigma, errors, names, seen, size)
    if not rms <= MOST_RMS_PX:
        raise Unusable(f"the error is {rms:.2f} px, expected at most {MOST_RMS_PX}: a flat board, sharp pictures, the right model?")
    model = "kannala-brandt" if options.fisheye else "pinhole-radtan"
    options.output.write_text(camera_file(model, size, matrix, distortion))
    print(f"{options.output}: written")


def corners_of(text):
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match or min(map(int, match.groups())) < 3:
        raise argparse.ArgumentTypeError(f"'{text}': expected COLUMNSxROWS of inner corners, 3 or more each, like 9x6")
    return int(match.group(1)), int(match.group(2))


def main():
    parser = argparse.ArgumentParser(usage=__doc__.removeprefix("usage: "), add_help=False)
    parser.add_argument("pictures", nargs="*", type=pathlib.Path)
    parser.add_argument("--corners", type=corners_of, required=True)
    parser.add_argument("--fisheye", action="store_true")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__, end="")
        return 0
    try:
        calibrate(parser.parse_args())
    except (Unusable, OSError) as error:
        print(f"calibrate.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
