#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: package_test.py BUILD_FOLDER CMAKE CPACK

What cmake --install puts where, and the .deb: its files, its conffiles, that its scripts parse, that its manual pages name
every option, that a build of the programs alone suffices, and nothing that lintian has to say. Status 77 where the packaging
tools are missing.
"""

import gzip
import os
import pathlib
import re
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
    "usr/share/doc/farpoint/examples/80-farpoint-can.network", "usr/share/doc/farpoint/tools.md",
    "usr/share/farpoint/worlds/town.yaml", "usr/share/farpoint/worlds/README.md", "usr/share/farpoint/make_types_jar",
    "usr/share/farpoint/vehicles/README.md", "usr/share/farpoint/vehicles/car/farpoint.yaml",
    "usr/share/farpoint/vehicles/rover/camera_1.yaml", "usr/share/farpoint/vehicles/drone/camera.yaml",
    "usr/share/man/man8/farpointd.8.gz", "usr/share/man/man1/farpoint.1.gz",
}
PAGES = {"farpointd": 8, "farpoint": 1}
OPTION = re.compile(r"^  (?:-\w,)?(--[\w-]+)", re.MULTILINE)
COMMAND = re.compile(r"^  (\w+) ", re.MULTILINE)

# What is only built where its packages are.
OPTIONAL = {
    "lib/farpoint/farpoint_libcamera.so": "usr/lib/farpoint/farpoint_libcamera.so",
    "share/farpoint/farpoint_types.jar": "usr/share/farpoint/farpoint_types.jar",
}


def expected_files(build):
    return FILES | {where for made, where in OPTIONAL.items() if (pathlib.Path(build) / made).exists()}


def run(*command, **kwargs):
    return subprocess.run(command, capture_output=True, text=True, check=False, **kwargs)


def check_install(build, cmake, folder):
    done = run(cmake, "--install", build, "--prefix", "/usr", env={**os.environ, "DESTDIR": folder})
    if done.returncode != 0:
        yield "cmake --install: " + done.stderr.strip()
    present = {path.relative_to(folder).as_posix() for path in pathlib.Path(folder).rglob("*") if path.is_file()}
    for missing in sorted(expected_files(build) - present):
        yield "not installed: " + missing
    for stray in sorted(p for p in present if not p.startswith(("usr/", "etc/farpoint/"))):
        yield "installed where it does not belong: " + stray


def helps(program, *words):
    """(words, text) of --help of a program and of all its sub-commands."""
    text = run(str(program), *words, "--help").stdout
    yield words, text
    if "\nSubcommands:\n" in text:
        for name in COMMAND.findall(text.split("\nSubcommands:\n", 1)[1].split("\n\n")[0] + "\n"):
            yield from helps(program, *words, name)


def check_manual_pages(build, folder):
    """Each command's part of a page names every option of its --help, and groff has nothing to say."""
    for program, section in PAGES.items():
        packed = pathlib.Path(folder) / f"usr/share/man/man{section}/{program}.{section}.gz"
        if not packed.exists():
            continue  # named by check_install()
        page = gzip.decompress(packed.read_bytes()).decode().replace("\\-", "-")
        commands = 0
        for words, text in helps(pathlib.Path(build) / "bin" / program):
            begin = page.find(f"\\fB{' '.join((program, *words))} [OPTIONS]")
            if begin < 0:
                yield f"{program}.{section}: no usage of '{' '.join((program, *words))}'"
                continue
            commands += 1
            part = page[begin:].split("[OPTIONS]", 2)[1]
            yield from (f"{program}.{section}: {' '.join(words)} lacks {option}" for option in OPTION.findall(text)
                        if option != "--help" and not re.search(re.escape(option) + r"\b", part))
        if program == "farpoint" and commands < 12:
            yield f"{program}.{section}: only {commands} commands"
        if shutil.which("groff"):
            said = run("groff", "-man", "-Tutf8", "-ww", "-z", input=gzip.decompress(packed.read_bytes()).decode())
            yield from (f"{program}.{section}: {line}" for line in said.stderr.splitlines())


def check_programs_suffice(build):
    """What is installed comes from the programs, the modules that they load, or the configuration of the build."""
    if not (pathlib.Path(build) / "build.ninja").exists():
        return
    install = (pathlib.Path(build) / "systemd/cmake_install.cmake").read_text()
    made = {str(pathlib.Path(name).relative_to(build)) for name in re.findall(r'"(/[^"\n]+)"', install)
            if name.startswith(build + "/")}
    ninja = shutil.which("ninja") or "ninja"
    targets = {name.strip() for name in run(ninja, "-C", build, "-t", "targets", "all").stdout.replace(":", "\n").splitlines()}
    programs = ("bin/farpointd", "bin/farpoint")
    needed = set(run(ninja, "-C", build, "-t", "inputs", *programs).stdout.splitlines()) | set(programs)
    if len(needed) < 100:
        yield f"ninja names only {len(needed)} inputs of the programs"
    for name in sorted(made & targets - needed):
        yield f"{name} is installed, and a build of farpointd and farpoint alone does not make it"


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
        report = run("lintian", "--fail-on", "error,warning", "--allow-root", package)
        if report.returncode != 0:
            yield "lintian: " + "; ".join(line for line in report.stdout.splitlines() if line.startswith(("E:", "W:")))


def main():
    build, cmake, cpack = sys.argv[1:4]
    if not all(shutil.which(program) for program in ("dpkg-deb", "dpkg-shlibdeps", "gzip")):
        print("package_test.py: no dpkg-dev")
        return 77
    with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
        problems = [*check_install(build, cmake, first), *check_manual_pages(build, first), *check_programs_suffice(build),
                    *check_package(build, cpack, second)]
    for problem in problems:
        print("package_test.py: " + problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
