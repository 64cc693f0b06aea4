#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: alone_test.py BUILD_FOLDER SOURCE_FOLDER CPACK

The .deb on a machine that has what it depends on and no clone: installed by dpkg it simulates, replays, reports, checks and
collects a bugreport; an upgrade keeps a changed configuration; removal keeps all of it; purge keeps what is not the
package's. The machine is a copy-on-write view of this one. tests/systemd/bare_test.py does the same on a bare Debian.
Status 77 where it cannot run.
"""

import pathlib
import sys

import package_support
from package_support import Failed, Machine

USERS = {"/etc/farpoint/camera.yaml": "# mine\n", "/etc/farpoint/car.dbc": "mine\n", "/var/lib/farpoint/run.lcm": "mine\n",
         "/var/log/farpoint/drive.lcm": "mine\n"}
DAEMONS = {"/var/lib/farpoint/boot_counter": "7\n", "/var/log/farpoint/farpointd.log": "x\n",
           "/var/log/farpoint/farpointd.1.log": "x\n"}
CONFIGURATION = "/etc/farpoint/farpoint.yaml"
EDIT = "log:\n  level: debug\n"
# This machine may lack udev, of which no part is needed here; bare_test.py has it.
INSTALL = ("dpkg", "--ignore-depends=udev", "--force-confdef", "--force-confold", "--install")


def expect(condition, complaint):
    if not condition:
        raise Failed(complaint)


def check_installed(machine):
    expect(machine.do("dpkg-query", "-W", "-f", "${Status}", "farpoint") == "install ok installed", "it is not installed")
    expect("/var/lib/farpoint" in machine.do("getent", "passwd", "farpoint"), "no account farpoint")
    for folder in ("/var/lib/farpoint", "/var/log/farpoint"):
        expect(machine.do("stat", "-c", "%U %a", folder).strip() == "farpoint 750", f"{folder} is not the account's own")
    for program, page in (("farpointd", "farpointd.8"), ("farpoint", "farpoint.1")):
        expect(machine.holds(f"/usr/share/man/man{page[-1]}/{page}.gz"), f"no manual page {page}")
        expect("Usage: " + program in machine.do(program, "--help"), f"{program} --help has no usage")


def check_use(machine):
    """From nothing to a report, in a folder of its own."""
    said = machine.do("farpoint", "simulate", "town", "-o", "town.lcm", "--duration", "8", "--size", "620x188")
    expect("80 frames" in said, "simulate: " + said)
    machine.do("farpointd", "--replay", "town.lcm", "--lockstep", "--output", "out.lcm", "--trajectory", "path.tum")
    poses = len(machine.path("/tmp/path.tum").read_text().splitlines())
    expect(poses >= 40, f"only {poses} of 80 frames have a pose")
    machine.do("farpoint", "report", "out.lcm", "-o", "report.html")
    report = machine.path("/tmp/report.html").read_text()
    expect(report.rstrip().endswith("</html>") and "<svg" in report, "the report is no page with drawings")
    camera = ("camera.driver=file", "camera.device=town.lcm", "camera.calibration=log")
    table = machine.do("farpointd", "--check", *(word for setting in camera for word in ("--set", setting)))
    expect("a log with images of 620 x 188" in table, "--check: " + table)
    machine.do("farpoint", "bugreport", "-o", "fault.tar.gz")
    taken = machine.do("tar", "-tzf", "fault.tar.gz")
    for name in ("contents.txt", "versions/farpointd.txt", "state/check.txt", "configuration/farpoint.yaml"):
        expect(f"farpoint-bugreport/{name}\n" in taken, f"the bugreport lacks {name}")
    for vehicle in ("car", "rover", "drone"):
        machine.do("farpoint", "dbc", "--config", f"/usr/share/farpoint/vehicles/{vehicle}/farpoint.yaml", "-o", "bus.dbc")


def put_files(machine):
    for files in (USERS, DAEMONS):
        for name, content in files.items():
            machine.put(name, content)
    machine.put(CONFIGURATION, EDIT)


def expect_users_files(machine, when):
    for name, content in USERS.items():
        expect(machine.holds(name), f"{when} took {name}")
        expect(machine.path(name).read_text() == content, f"{when} changed {name}")


def change_configuration(unpacked):
    file = unpacked / CONFIGURATION.lstrip("/")
    file.write_text(file.read_text() + "# of the next version\n")


def check_upgrade(machine):
    machine.do(*INSTALL, "/tmp/next.deb")
    expect(machine.path(CONFIGURATION).read_text() == EDIT, "the upgrade replaced the configuration")
    expect_users_files(machine, "the upgrade")
    machine.do("farpointd", "--version")


def check_removal(machine):
    machine.do("systemctl", "enable", "farpointd.service")
    wanted = "/etc/systemd/system/multi-user.target.wants/farpointd.service"
    expect(machine.holds(wanted), "the service cannot be enabled")
    machine.do("dpkg", "-r", "farpoint")
    expect(not machine.holds("/usr/bin/farpointd"), "the removal left the program")
    expect(not machine.holds(wanted), "the removal left the service enabled")
    expect(machine.path(CONFIGURATION).read_text() == EDIT, "the removal took the configuration")
    expect_users_files(machine, "the removal")


def check_purge(machine):
    said = machine.do("dpkg", "-P", "farpoint")
    expect_users_files(machine, "the purge")
    for name in (*DAEMONS, CONFIGURATION):
        expect(not machine.holds(name), f"the purge left {name}")
    for folder in ("/etc/farpoint", "/var/lib/farpoint", "/var/log/farpoint"):
        expect(f"{folder} holds files" in said, f"the purge does not name {folder}, which stays")


def check_clean_purge(machine):
    """Where all files are the package's own, none stay."""
    for name in USERS:
        machine.path(name).unlink()
    listing = machine.do("dpkg-deb", "--contents", "/tmp/farpoint.deb").splitlines()
    files = [line.split(" ./", 1)[1].split(" -> ")[0] for line in listing]
    machine.do(*INSTALL, "/tmp/farpoint.deb")
    machine.do("dpkg", "-P", "farpoint")
    left = [name for name in files if "farpoint" in name and machine.holds(name)]
    left += [folder for folder in ("var/lib/farpoint", "var/log/farpoint") if machine.holds(folder)]
    expect(files and not left, "the purge left " + ", ".join(left))


def bring_packages(machine, build, cpack):
    """farpoint.deb and next.deb, a later version with another configuration, in the machine's /tmp."""
    folder = package_support.test_folder()
    package = package_support.make_package(build, cpack, folder)
    later = package_support.make_next_version(package, folder, change_configuration)
    machine.take(package, "/tmp/farpoint.deb")
    machine.take(later, "/tmp/next.deb")


def check_life(machine):
    """From the installation, which is done, to the purge."""
    check_installed(machine)
    check_use(machine)
    put_files(machine)
    check_upgrade(machine)
    check_removal(machine)
    check_purge(machine)
    check_clean_purge(machine)


def main():
    build, source, cpack = sys.argv[1:4]
    if reason := package_support.why_impossible(("dpkg", "dpkg-deb", "dpkg-shlibdeps", "systemd-sysusers")):
        package_support.skip(reason)
    package_support.enter_namespaces(with_network=False)
    try:
        machine = Machine("/", hidden=(source, build))
        bring_packages(machine, build, cpack)
        machine.do(*INSTALL, "/tmp/farpoint.deb")
        check_life(machine)
    except Failed as complaint:
        print(f"{pathlib.Path(sys.argv[0]).name}: {complaint}")
        sys.exit(1)


if __name__ == "__main__":
    main()
