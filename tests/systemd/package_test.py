#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: package_test.py BUILD_FOLDER CMAKE CPACK

What cmake --install puts where, and the .deb: its files, its conffiles, that its scripts parse, and no error of lintian.
Status 77 where the packaging tools are missing.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

FILES = {
    "usr/bin/farpointd", "usr/bin/farpoint", "etc/farpoint/farpoint.yaml", "usr/share/farpoint/farpoint.dbc",
    "usr/share/farpoint/cameras/README.md", "usr/share/farpoint/types/status_t.lcm",
    "usr/lib/systemd/system/farpointd.service", "usr/lib/sysusers.d/farpoint.conf", "usr/lib/tmpfiles.d/farpoint.conf",
    "usr/lib/udev/rules.d/60-farpoint.rules", "usr/lib/systemd/network/80-farpoint-lcm.network",
    "usr/lib/farpoint/farpoint_ceres.so", "usr/share/doc/farpoint/copyright", "usr/share/doc/farpoint/changelog.gz",
    "usr/share/doc/farpoint/daemon.md", "usr/share/doc/farpoint/systemd.md",
    "usr/share/doc/farpoint/examples/80-farpoint-can.network",
}

# What is only built where its packages are.
OPTIONAL = {
    "lib/farpoint/farpoint_libcamera.so": "usr/lib/farpoint/farpoint_libcamera.so",
    "share/farpoint/farpoint_types.jar": "usr/share/farpoint/farpoint_types.jar",
}


def expected_files(build):
    return FILES | {where for made, where in OPTIONAL.items() if (pathlib.Path(build) / made).exists()}


def run(*command, **kwargs):
    return subprocess.run(command, capture_output=True, text=True, **kwargs)


def check_install(build, cmake, folder):
    done = run(cmake, "--install", build, "--prefix", "/usr", env={**os.environ, "DESTDIR": folder})
    if done.returncode != 0:
        yield "cmake --install: " + done.stderr.strip()
    present = {path.relative_to(folder).as_posix() for path in pathlib.Path(folder).rglob("*") if path.is_file()}
    for missing in sorted(expected_files(build) - present):
        yield "not installed: " + missing
    for stray in sorted(p for p in present if not p.startswith(("usr/", "etc/farpoint/"))):
        yield "installed where it does not belong: " + stray


def check_package(build, cpack, folder):
    done = run(cpack, "-G", "DEB", "-B", folder, "--config", str(pathlib.Path(build) / "CPackConfig.cmake"), cwd=build)
    packages = list(pathlib.Path(folder).glob("*.deb"))
    if done.returncode != 0 or len(packages) != 1:
        yield "cpack: " + (done.stderr or done.stdout).strip()
        return
    package = str(packages[0])
    listing = run("dpkg-deb", "-c", package).stdout
    for file in sorted(expected_files(build)):
        if f" ./{file}\n" not in listing:
            yield "not in the package: " + file
    if "conffiles" not in run("dpkg-deb", "--ctrl-tarfile", package, errors="replace").stdout:
        yield "no conffiles: the configuration would not be kept"
    control = run("dpkg-deb", "-f", package, "Depends").stdout
    if "libc6" not in control or "systemd" not in control:
        yield "dependencies were not found out: " + control.strip()
    unpacked = pathlib.Path(folder) / "control"
    run("dpkg-deb", "-e", package, str(unpacked))
    for script in ("postinst", "prerm", "postrm"):
        if run("sh", "-n", str(unpacked / script)).returncode != 0:
            yield script + " does not parse"
    if shutil.which("lintian"):
        report = run("lintian", "--fail-on", "error", "--allow-root", package)
        if report.returncode != 0:
            yield "lintian: " + "; ".join(line for line in report.stdout.splitlines() if line.startswith("E:"))


def main():
    build, cmake, cpack = sys.argv[1:4]
    if not all(shutil.which(program) for program in ("dpkg-deb", "dpkg-shlibdeps", "gzip")):
        print("package_test.py: no dpkg-dev")
        return 77
    with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
        problems = [*check_install(build, cmake, first), *check_package(build, cpack, second)]
    for problem in problems:
        print("package_test.py: " + problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
