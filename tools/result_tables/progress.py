# SPDX-License-Identifier: Apache-2.0
"""A bar with the time left, on standard error. Silent where that is no terminal."""

import sys
import threading
import time

WIDTH = 24


class Progress:
    """Counts steps of about equal length. Threads may call it side by side."""

    def __init__(self, total, label, stream=None, clock=time.monotonic):
        self.total, self.label, self.done = total, label, 0
        self.stream, self.clock, self.start = stream or sys.stderr, clock, clock()
        self.lock = threading.Lock()
        self.shown = self.stream.isatty()
        self.draw()

    def step(self):
        with self.lock:
            self.done += 1
            self.draw()

    def draw(self):
        if not self.shown:
            return
        filled = WIDTH * self.done // max(self.total, 1)
        self.stream.write(f"\r\033[K{self.label} [{'#' * filled}{'.' * (WIDTH - filled)}] "
                          f"{self.done}/{self.total}{self.time_left()}")
        self.stream.flush()

    def time_left(self):
        if not self.done or self.done >= self.total:
            return ""
        left = round((self.clock() - self.start) / self.done * (self.total - self.done))
        return f", {left // 60}:{left % 60:02d} left"

    def close(self):
        if self.shown:
            self.stream.write("\r\033[K")
            self.stream.flush()
