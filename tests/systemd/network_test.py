#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: network_test.py SOURCE_FOLDER

The package's route takes LCM's default group to the loopback interface, and nothing else: by the text of the network
file and of the package's scripts, and in a network of its own, where the system allows one.
"""

import configparser
import pathlib
import re
import shutil
import subprocess
import sys

# mDNS, SOME/IP-SD's usual group, DDS.
OTHERS = ("224.0.0.251", "224.244.224.245", "239.255.0.1")


def default_group(source):
    header = (source / "ipc/channels.h").read_text()
    return re.search(r'kDefaultLcmUrl\[\] = "udpm://([\d.]+):', header).group(1)


def routes(path):
    parser = configparser.RawConfigParser(strict=True)
    parser.optionxform = str
    parser.read(path)
    return [value for key, value in parser["Route"].items() if key == "Destination"]


def in_own_network(script):
    return subprocess.run(["unshare", "-rn", "sh", "-c", script], capture_output=True, text=True)


def check_routing(destination, group):
    if shutil.which("unshare") is None or in_own_network("ip link set lo up").returncode != 0:
        print("network_test.py: no network of its own here: the routes were compared as text only")
        return
    begin = f"ip link set lo up && ip route add {destination} dev lo scope link && ip route get "
    found = in_own_network(begin + group)
    if found.returncode != 0 or "dev lo" not in found.stdout:
        yield f"{group} does not go to lo: {found.stdout}{found.stderr}"
    for other in OTHERS:
        if in_own_network(begin + other).returncode == 0:
            yield f"{other} goes to lo too"


def main():
    source = pathlib.Path(sys.argv[1])
    group = default_group(source)
    destinations = routes(source / "systemd/80-farpoint-lcm.network")
    problems = []
    if destinations != [group + "/32"]:
        problems.append(f"the network file routes {destinations}, expected {group}/32 alone")
    if f"ip route del {group}/32 dev lo" not in (source / "systemd/debian/prerm").read_text():
        problems.append("prerm does not delete the route that the network file sets")
    manual = (source / "systemd/README.md").read_text()
    for way in ("networkd", "NetworkManager", "ifupdown"):
        if not re.search(rf"\|\s*{way}\s*\|[^|]*{re.escape(group)}/32", manual):
            problems.append(f"systemd/README.md does not tell how {way} sets the route to {group}/32")
    for destination in destinations:
        problems += check_routing(destination, group)
    for problem in problems:
        print("network_test.py: " + problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
