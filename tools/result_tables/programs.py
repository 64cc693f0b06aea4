# SPDX-License-Identifier: Apache-2.0
"""Programs that a script of tools/ runs."""

import subprocess
import sys


def output_of(script, command):
    """Standard output of the command; ends the script with the command's error where it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{script}: {command[0]} failed with status {done.returncode}: {done.stderr.strip()}")
    return done.stdout
