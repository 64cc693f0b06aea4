# SPDX-License-Identifier: Apache-2.0
"""Pictures of a chessboard as a camera of known lens sees it."""

import functools

import cv2
import numpy as np

SQUARES = (10, 7)  # 9x6 inner corners
PIXELS_A_SQUARE = 36
MARGIN = 1  # white squares around the board
FINER = 2  # a pixel is the mean of FINER x FINER rays

PINHOLE = {"size": (480, 360), "matrix": np.array([[390.0, 0, 244], [0, 388, 177], [0, 0, 1]]),
           "distortion": np.array([-0.24, 0.07, 0.0006, -0.0004, 0.0]), "fisheye": False}
FISHEYE = {"size": (480, 360), "matrix": np.array([[218.0, 0, 241], [0, 219, 182], [0, 0, 1]]),
           "distortion": np.array([-0.02, 0.006, -0.004, 0.0007]), "fisheye": True}


@functools.cache
def texture():
    columns, rows = (SQUARES[0] + 2 * MARGIN, SQUARES[1] + 2 * MARGIN)
    y, x = np.mgrid[0:rows, 0:columns]
    inside = (x >= MARGIN) & (x < columns - MARGIN) & (y >= MARGIN) & (y < rows - MARGIN)
    squares = np.where(inside & ((x + y) % 2 == 0), 25, 230).astype(np.uint8)
    return cv2.GaussianBlur(np.kron(squares, np.ones((PIXELS_A_SQUARE, PIXELS_A_SQUARE), np.uint8)), (5, 5), 1.2)


def rays(lens):
    """Direction (x, y, 1) of each ray, by rows."""
    width, height = lens["size"]
    y, x = np.mgrid[0:height * FINER, 0:width * FINER]
    points = ((np.stack([x, y], axis=-1) + 0.5) / FINER - 0.5).reshape(-1, 1, 2)
    if lens["fisheye"]:
        found = cv2.fisheye.undistortPoints(points, lens["matrix"], lens["distortion"])
    else:
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 1e-9)
        found = cv2.undistortPointsIter(points, lens["matrix"], lens["distortion"], None, None, criteria)
    return np.concatenate([found.reshape(-1, 2), np.ones((found.shape[0], 1))], axis=1)


def picture(lens, directions, turn_rad, place):
    """One picture; `place` is the board's middle in the camera's axes, in squares."""
    rotation, _ = cv2.Rodrigues(np.array(turn_rad, dtype=np.float64))
    middle = np.array([SQUARES[0] / 2, SQUARES[1] / 2, 0.0])
    origin = np.array(place, dtype=np.float64) - rotation @ middle
    homography = np.column_stack([rotation[:, 0], rotation[:, 1], origin])
    board = directions @ np.linalg.inv(homography).T
    with np.errstate(divide="ignore", invalid="ignore"):
        board = board[:, :2] / board[:, 2:]
    width, height = lens["size"]
    at = ((board + MARGIN) * PIXELS_A_SQUARE - 0.5).astype(np.float32).reshape(height * FINER, width * FINER, 2)
    fine = cv2.remap(texture(), np.ascontiguousarray(at[..., 0]), np.ascontiguousarray(at[..., 1]), cv2.INTER_LINEAR,
                     borderMode=cv2.BORDER_CONSTANT, borderValue=120)
    return cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)


def write_pictures(lens, folder, count=15, seed=3):
    """Numbered PNG files of the board at many places and tilts; those near the edges keep the whole board in the picture."""
    folder.mkdir(parents=True, exist_ok=True)
    source, directions = np.random.default_rng(seed), rays(lens)
    half_width, half_height = (side / 2 / lens["matrix"][0, 0] for side in lens["size"])
    for number in range(count):
        distance = source.uniform(13, 16) * lens["matrix"][0, 0] / (0.8125 * lens["size"][0])
        side = [(-1, -1), (1, -1), (-1, 1), (1, 1), (0, 0)][number % 5]
        place = [side[0] * 0.4 * half_width * distance, side[1] * 0.35 * half_height * distance, distance]
        # Tilted, to all sides: a board that faces the camera tells focal length and distance apart badly.
        tilt, direction = source.uniform(0.4, 0.65), 2.4 * number
        turn = [tilt * np.cos(direction), tilt * np.sin(direction), source.uniform(-0.2, 0.2)]
        cv2.imwrite(str(folder / f"{number:04d}.png"), picture(lens, directions, turn, place))
