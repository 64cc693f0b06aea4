# SPDX-License-Identifier: Apache-2.0
"""Load beside a measured run, without programs from outside: processes at normal priority that compute, copy memory or
write to the disk. They end with the process that started them.

usage: load.py KIND PARENT_PID FOLDER"""

import mmap
import os
import pathlib
import subprocess
import sys

COPIED_BYTES, WRITTEN_BYTES = 64 << 20, 4 << 20


def compute(_):
    for _ in range(100_000):
        pass


def copy_memory(_):
    """Maps memory anew each time, so that every page faults once."""
    with mmap.mmap(-1, COPIED_BYTES) as memory:
        memory[:] = bytes(COPIED_BYTES)


def write_disk(folder):
    path = folder / f"load_{os.getpid()}"
    with open(path, "wb") as file:
        file.write(bytes(WRITTEN_BYTES))
        os.fsync(file.fileno())
    path.unlink()


KINDS = {"computing": compute, "copying": copy_memory, "writing": write_disk}


class Load:
    """The processes live as long as the context. `counts` maps a kind to its number of processes."""

    def __init__(self, counts, folder):
        self.counts, self.folder, self.processes = counts, folder, []

    def __enter__(self):
        for kind, count in self.counts.items():
            words = [sys.executable, __file__, kind, str(os.getpid()), str(self.folder)]
            self.processes += [subprocess.Popen(words) for _ in range(count)]
        return self

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.wait()


def main():
    kind, parent, folder = sys.argv[1:]
    while os.getppid() == int(parent):
        KINDS[kind](pathlib.Path(folder))


if __name__ == "__main__":
    main()
