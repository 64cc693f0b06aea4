# SPDX-License-Identifier: Apache-2.0
"""Scenarios: small shell scripts that run in the guest, with a head that says the rest.

    # What is proved, in one line.
    #@ form: short                    or long
    #@ machine: systemd               else in a machine without it; reboots: with it, and the scenario may boot it
                                      again, with its disk as it is, and begins anew
    #@ devices: -device ...           further devices of the machine
    #@ seconds: what it takes, where that is more than a usual scenario does
    #@ needs: package                 the .deb is laid beside it; libcamera: the module that farpointd loads
    #@ check: NAME ARGUMENT...        of checks.py, on what it left; any number
    #@ broken: what is left out or inverted where $BROKEN is set
    #@ broken_says: the complaint that must follow, a regular expression
"""

import dataclasses
import pathlib
import re


@dataclasses.dataclass
class Scenario:
    name: str
    title: str
    script: str
    form: str = "short"
    machine: str = "plain"
    devices: str = ""
    needs: str = ""
    seconds: int = 0
    broken: str = ""
    broken_says: str = ""
    checks: list = dataclasses.field(default_factory=list)

    def fails_as_it_says(self, complaint):
        return complaint is not None and re.search(self.broken_says, complaint) is not None


def read(path):
    lines = path.read_text().splitlines()
    title = next(line for line in lines if "SPDX-License-Identifier" not in line)
    one = Scenario(path.stem, title.lstrip("# "), path.read_text())
    for line in lines:
        if not line.startswith("#@ "):
            continue
        key, value = line[3:].split(": ", 1)
        if key == "check":
            one.checks.append(value.split())
        elif key == "seconds":
            one.seconds = int(value)
        elif key in ("form", "machine", "devices", "needs", "broken", "broken_says"):
            setattr(one, key, value)
        else:
            raise ValueError(f"{path}: unknown key '{key}'")
    if not one.broken or not one.broken_says:
        raise ValueError(f"{path}: expected 'broken' and 'broken_says'")
    return one


def read_all(folder):
    return [read(path) for path in sorted(pathlib.Path(folder).glob("*.sh"))]


def complaint_of(folder):
    """What the scenario itself complained of; None where it ended well."""
    if not (folder / "status").exists():
        return "it did not end in time" if (folder / "out").exists() else "the machine did not come to it"
    status = (folder / "status").read_text().strip()
    if status == "0":
        return None
    if (folder / "complaint").exists():
        return (folder / "complaint").read_text().strip()
    last = (folder / "out").read_text(errors="replace").strip().splitlines()[-1:]
    return f"status {status}" + (": " + last[0] if last else ", nothing was said")


def lines_of(folder, name):
    return (folder / name).read_text().splitlines() if (folder / name).exists() else []
