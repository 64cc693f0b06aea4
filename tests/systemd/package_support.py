# SPDX-License-Identifier: Apache-2.0
"""A machine of its own for the package: a copy-on-write view of a root file system, in namespaces of its own."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

NAMESPACES = ("unshare", "--mount", "--pid", "--fork", "--mount-proc", "--ipc", "--uts")
INSIDE = "FARPOINT_TEST_FOLDER"  # set within the namespaces: a folder for the test, on the real disk


class Failed(Exception):
    """What the test complains of, one line."""


def run(*command, **options):
    return subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          errors="replace", check=False, **options)


def need(done, what):
    """The command's output; Failed where its status is not 0."""
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip()).splitlines()
        raise Failed(f"{what}: status {done.returncode}: {' | '.join(words[-3:])}")
    return done.stdout


def why_impossible(needed):
    """Why this machine cannot hold such a machine; empty where it can."""
    missing = [program for program in (*needed, "unshare", "chroot", "mount") if shutil.which(program) is None]
    if missing:
        return "no " + ", ".join(missing)
    if os.geteuid() != 0:
        return "no permission: a chroot needs root"
    with tempfile.TemporaryDirectory() as folder:
        tried = run(*NAMESPACES, "sh", "-c", f"mount -t tmpfs none {folder} && cd {folder} && mkdir u w m && "
                    "mount -t overlay none -o lowerdir=/,upperdir=u,workdir=w m")
    return "" if tried.returncode == 0 else "no permission to mount an overlay: " + tried.stderr.strip()


def skip(reason):
    """Ends the test as skipped, in the form that tests/tree/skipped_tests.py reads."""
    print(f"{pathlib.Path(sys.argv[0]).name}:0: Skipped\n{reason}\n[  SKIPPED ]")
    sys.exit(77)


def enter_namespaces(with_network):
    """Starts this script anew in namespaces of its own, and ends with its status; returns in there."""
    if os.environ.get(INSIDE):
        return
    command = [*NAMESPACES, *([] if with_network else ["--net"]), sys.executable, "-B", *sys.argv]
    with tempfile.TemporaryDirectory(prefix="farpoint-package-") as folder:
        status = subprocess.run(command, env={**os.environ, INSIDE: folder}, check=False).returncode
    sys.exit(status)


def test_folder():
    return pathlib.Path(os.environ[INSIDE])


def mount(*words):
    need(run("mount", *words), "mount " + " ".join(map(str, words)))


class Machine:
    """A root file system that keeps nothing: what is written goes to memory. Needs enter_namespaces() before."""

    KERNEL = (("proc", "proc"), ("tmpfs", "run"))

    def __init__(self, lower, name="machine", hidden=()):
        self.folder = test_folder() / name
        self.folder.mkdir()
        self.root = self.folder / "root"
        mount("--make-rprivate", "/")
        mount("-t", "tmpfs", "-o", "mode=755", "none", self.folder)
        for name in ("root", "upper", "work"):
            (self.folder / name).mkdir()
        mount("-t", "overlay", "none", "-o",
              f"lowerdir={lower},upperdir={self.folder}/upper,workdir={self.folder}/work", self.root)
        for kind, place in self.KERNEL:
            mount("-t", kind, "none", self.root / place)
        mount("--rbind", "/dev", self.root / "dev")
        # The clone does not stand in for what the package lacks.
        for path in hidden:
            if (place := self.path(path)).is_dir():
                mount("-t", "tmpfs", "none", place)

    def path(self, name):
        return self.root / str(name).lstrip("/")

    def holds(self, name):
        return os.path.lexists(self.path(name))

    def put(self, name, content):
        self.path(name).parent.mkdir(parents=True, exist_ok=True)
        self.path(name).write_text(content)

    def take(self, source, name):
        shutil.copyfile(source, self.path(name))

    def run(self, *command, **options):
        environment = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root",
                       "LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive", "TMPDIR": "/tmp"}
        environment |= {name: value for name, value in os.environ.items() if name.lower().endswith("_proxy")}
        return run("chroot", self.root, "sh", "-c", 'cd /tmp && exec "$@"', "sh", *command, env=environment, **options)

    def do(self, *command, **options):
        """Runs a command that must succeed; returns what it printed."""
        return need(self.run(*command, **options), " ".join(map(str, command)))

    def boot(self, script, limit_s=180):
        """Starts systemd in a container on this root, runs the script there, and returns its status and what it printed."""
        for place in ("dev", *(place for _, place in self.KERNEL)):
            need(run("umount", "--recursive", self.root / place), "umount " + place)
        self.put("/root/script", script)
        self.put("/etc/systemd/system/script.service", "[Unit]\nAfter=multi-user.target\n[Service]\nType=exec\n"
                 "ExecStart=/bin/sh -c 'sh /root/script > /root/said 2>&1; systemctl --no-block exit $$?'\n")
        done = run("timeout", limit_s, "systemd-nspawn", "--quiet", "--directory", self.root, "--register=no", "--keep-unit",
                   "--private-network", "--console=pipe", "--boot", "systemd.unit=multi-user.target",
                   "systemd.wants=script.service", "systemd.show_status=0")
        said = self.path("/root/said").read_text(errors="replace") if self.holds("/root/said") else done.stderr
        return done.returncode, said


def make_package(build, cpack, folder):
    """The .deb of a build."""
    build = pathlib.Path(build).resolve()
    done = run(cpack, "-G", "DEB", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=none", "-B", folder, "--config", build / "CPackConfig.cmake", cwd=build)
    packages = list(pathlib.Path(folder).glob("*.deb"))
    if done.returncode != 0 or len(packages) != 1:
        raise Failed("cpack: " + (done.stderr or done.stdout).strip())
    return packages[0]


def make_next_version(package, folder, changed=lambda unpacked: None):
    """The package of a later version, whose unpacked files `changed` may alter."""
    unpacked = pathlib.Path(folder) / "next"
    need(run("dpkg-deb", "-R", package, unpacked), "dpkg-deb -R")
    control = unpacked / "DEBIAN/control"
    lines = control.read_text().splitlines()
    control.write_text("".join(line + ("+next" if line.startswith("Version:") else "") + "\n" for line in lines))
    changed(unpacked)
    later = pathlib.Path(folder) / "next.deb"
    need(run("dpkg-deb", "-b", "-Znone", unpacked, later), "dpkg-deb -b")
    return later
