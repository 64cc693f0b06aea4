#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: bare_test.py BUILD_FOLDER CPACK [--spy] [--clone]

The .deb on a bare Debian 12 (the packages that Debian marks as required, and apt): apt installs it with what it depends
on, then the checks of alone_test.py, then the service under systemd in a container. With --spy also 'farpoint spy' with
a jar by make_types_jar, on a virtual display; with --clone, on another bare Debian, the commands of config/vehicles/README.md
from a clone and a folder of pictures to the report. Needs root, the network and 'tools/deps --package'. Minutes; no ctest entry.
The bare system is kept in ${XDG_CACHE_HOME:-~/.cache}/farpoint/bare for a month.
"""

import os
import pathlib
import shutil
import sys
import time

import alone_test
import package_support
from package_support import Failed, Machine, need, run

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(SOURCE / "tests/config"))
import first_day_test  # noqa: E402
import stand_ins  # noqa: E402

MONTH_S = 30 * 86400
SOURCES = ("/etc/apt/sources.list.d/debian.sources", "/etc/apt/sources.list")

# A log is the camera. What waits, waits for a condition.
SERVICE = r"""
until_true() { for i in $(seq 300); do "$@" && return 0; sleep 0.1; done; echo "not within 30 s: $*"; return 1; }
tracks() { farpoint ctl status 2> /dev/null | grep -q tracking; }
main_pid() { systemctl show -P MainPID farpointd; }
is_other() { now=$(main_pid); [ "$now" != 0 ] && [ "$now" != "$1" ]; }
complain() { echo "$1"; journalctl -u farpointd --no-pager | tail -5; exit 1; }
systemctl enable --now farpointd || complain "the service does not start"
[ "$(ps -o user= -p "$(main_pid)")" = farpoint ] || complain "the service runs as another user"
until_true tracks || complain "no tracking"
before=$(main_pid)
kill -9 "$before"
until_true is_other "$before" || complain "no other process after kill -9"
until_true tracks || complain "no tracking after kill -9"
systemctl stop farpointd || complain "the service does not stop"
[ -z "$(systemctl --failed --no-legend | grep farpoint)" ] || complain "the service failed"
[ -s /var/lib/farpoint/boot_counter ] || complain "no boot counter is kept"
echo well
"""

CONFIGURATION = """camera:
  driver: file
  device: /var/lib/farpoint/town.lcm
  calibration: log
"""

# In a network of its own.
SPY = r"""
ip link set lo up && ip route add 239.255.76.67/32 dev lo || exit 1
farpoint spy --jar /tmp/types.jar 2> /tmp/spy.err & spy=$!
for i in $(seq 100); do
  xwininfo -root -tree | grep -q '"LCM Spy"' && { kill $spy; exit 0; }
  kill -0 $spy 2> /dev/null || break
  sleep 0.2
done
xwininfo -root -tree; cat /tmp/spy.err; exit 1
"""


def step(text):
    print(f"bare_test.py: {text}", flush=True)


def bare_root():
    """A root file system with nothing except required packages and apt, made once a month."""
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "farpoint/bare"
    root = cache / "root"
    if root.is_dir() and time.time() - root.stat().st_mtime < MONTH_S:
        return root
    shutil.rmtree(cache, ignore_errors=True)
    cache.mkdir(parents=True)
    step("making a bare Debian, some minutes")
    sources = [path for path in SOURCES if pathlib.Path(path).is_file() and "bookworm" in pathlib.Path(path).read_text()]
    need(run("mmdebstrap", "--quiet", "--variant=apt", "bookworm", cache / "building", *sources[:1]), "mmdebstrap")
    (cache / "building").rename(root)
    os.utime(root)
    return root


def bare_machine(name):
    machine = Machine(bare_root(), name)
    shutil.copyfile("/etc/resolv.conf", machine.path("/etc/resolv.conf"))
    return machine


def apt(machine, *words):
    return machine.do("apt-get", "-qy", "-o", "Acquire::Retries=3", "-o", "APT::Sandbox::User=root", *words)


def install(machine, *packages):
    apt(machine, "install", "--no-install-recommends", *packages)


def check_service(machine):
    step("the service under systemd, in a container")
    machine.do("cp", "/tmp/town.lcm", "/var/lib/farpoint/town.lcm")
    machine.put(alone_test.CONFIGURATION, CONFIGURATION)
    install(machine, "systemd-sysv", "procps")
    status, said = machine.boot(SERVICE)
    alone_test.expect(status == 0 and said.rstrip().endswith("well"), f"service: status {status}: {said.strip()[-1500:]}")


def kept_words():
    """ccache counts the language of messages as a part of what a compiler does."""
    words = [f"{name}={value}" for name, value in os.environ.items() if name == "LANG" or name.startswith("LC_")]
    return ["env", "--unset=LC_ALL", *words, "CCACHE_DIR=/ccache"]


def check_clone():
    """What the page says for a bare Debian, as it stands there, for each source; ccache of this machine makes it quicker."""
    step("from a clone to the report")
    recordings = (SOURCE.parent / "shared/data").resolve()
    alone_test.expect((recordings / stand_ins.KITTI).is_dir(), f"no recording in {recordings}")
    machine = bare_machine("clone")
    apt(machine, "update")
    need(run("git", "clone", "--quiet", SOURCE, machine.path("/root/farpoint")), "git clone")
    clone = first_day_test.bring_recording(recordings, machine.path("/root/farpoint"))
    for picture in (clone / "drive").iterdir():  # links to a folder that is not there
        content = picture.read_bytes()
        picture.unlink()
        picture.write_bytes(content)
    if cache := os.environ.get("CCACHE_DIR"):
        machine.path("/ccache").mkdir()
        package_support.mount("--bind", cache, machine.path("/ccache"))
    page = (SOURCE / "config/vehicles/README.md").read_text()
    for number, source in enumerate(first_day_test.SOURCES):
        commands = first_day_test.from_bare_debian(page, source)
        step(f"{source}: {len(commands)} commands: {'; '.join(commands)}")
        if number > 0:  # built once
            commands = commands[-5:]
        begun = time.monotonic()
        said = machine.do(*kept_words(), "bash", "-euo", "pipefail", "-c", "cd /root/farpoint\n" + "\n".join(commands))
        print("\n".join(said.splitlines()[-10:]))
        step(f"{source}: {time.monotonic() - begun:.0f} s")
        first_day_test.expect_run(clone)
        (clone / "report.html").unlink()
    first_day_test.expect_imports(clone, ("drive", "from_bag", "from_mcap", "from_db3"))


def check_spy(machine):
    step("farpoint spy")
    install(machine, "default-jre", "default-jdk-headless", "liblcm-bin", "liblcm-java", "libjchart2d-java", "xvfb", "xauth",
            "x11-utils")
    machine.do("/usr/share/farpoint/make_types_jar", "/tmp/types.jar")
    machine.do("unshare", "--net", "xvfb-run", "sh", "-c", SPY)


def main():
    build, cpack = sys.argv[1:3]
    if reason := package_support.why_impossible(("mmdebstrap", "systemd-nspawn", "dpkg-deb", "dpkg-shlibdeps")):
        package_support.skip(reason)
    package_support.enter_namespaces(with_network=True)
    try:
        if "--clone" in sys.argv[3:]:
            check_clone()
        step("the package, by apt")
        machine = bare_machine("package")
        alone_test.bring_packages(machine, build, cpack)
        apt(machine, "update")
        install(machine, "/tmp/farpoint.deb")
        alone_test.check_life(machine)
        install(machine, "/tmp/farpoint.deb")
        if "--spy" in sys.argv[3:]:
            check_spy(machine)
        check_service(machine)
    except (Failed, first_day_test.Failed) as complaint:
        print(f"{pathlib.Path(sys.argv[0]).name}: {complaint}")
        sys.exit(1)
    step("passed")


if __name__ == "__main__":
    main()
