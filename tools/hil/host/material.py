# SPDX-License-Identifier: Apache-2.0
"""What scenarios are given: the programs under test, the bench's own, a simulated sequence, the package."""

import pathlib
import shutil
import subprocess
import tempfile

from host import lcm_log

PROGRAMS = ("farpointd", "farpoint")
MODULES = "lib/farpoint"  # what farpointd loads, beside bin/
# Slow motion between walls: seen by a small image with few features, which is all that the guest can track live.
SEQUENCE = ["simulate", "yard", "--size", "320x240", "--duration", "9"]
FIRST, FRAMES = 80, 100  # where the vehicle has begun to move


class NotMade(Exception):
    pass


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        raise NotMade(f"{pathlib.Path(command[0]).name} failed: {(done.stderr or done.stdout).strip()[-400:]}")
    return done.stdout


class Stock:
    """Made once, laid beside each scenario."""

    def __init__(self, build, here):
        self.build, self.here = build, here
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="farpoint-hil-stock-"))

    def __enter__(self):
        try:
            self._compile()
            self._simulate()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.folder, ignore_errors=True)

    def _compile(self):
        compiler = ("cc", "-O2", "-Wall", "-Wextra", "-Werror")
        for source in sorted((self.here / "programs").glob("*.c")):
            run(*compiler, "-static", "-o", self.folder / source.stem, source)
        for source in sorted((self.here / "preloads").glob("*.c")):
            run(*compiler, "-shared", "-fPIC", "-o", self.folder / f"{source.stem}.so", source)

    def _simulate(self):
        log = self.folder / "sequence.lcm"
        run(self.build / "bin/farpoint", *SEQUENCE, "-o", log)
        calibration = lcm_log.first_camera(lcm_log.first(log, "CALIBRATION"))
        (self.folder / "camera.yaml").write_text(lcm_log.camera_file(calibration))
        with open(self.folder / "frames.grey", "wb") as frames:
            for number, (_, image) in enumerate(lcm_log.images(log)):
                if FIRST <= number < FIRST + FRAMES:
                    frames.write(image.pixels)
        log.unlink()
        shutil.copy(self.here.parents[1] / "config/worlds/yard.yaml", self.folder)

    def packages(self):
        """The run-time libraries of what is tested, as Debian's packages."""
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "debian").mkdir()
            (pathlib.Path(folder) / "debian/control").write_text("Source: farpoint\nPackage: farpoint\n")
            binaries = [self.build / "bin" / p for p in PROGRAMS] + sorted((self.build / MODULES).glob("*.so"))
            text = run("dpkg-shlibdeps", "-O", *binaries, cwd=folder)
        alternatives = text.strip().split("=", 1)[1].split(",")
        return [alternative.split("|")[0].split("(")[0].strip() for alternative in alternatives]

    def package(self):
        """The .deb, made where it is first asked for."""
        made = list(self.folder.glob("package/*.deb"))
        if not made:
            run("cpack", "-G", "DEB", "-B", self.folder / "package", "--config", self.build / "CPackConfig.cmake",
                cwd=self.build)
            made = list(self.folder.glob("package/*.deb"))
        return made[0]

    def _lay_out_modules(self, folder):
        if not (self.build / MODULES / "farpoint_libcamera.so").exists():
            raise NotMade(f"{self.build}: built without libcamera, expected it built with libcamera-dev (tools/deps)")
        shutil.copytree(self.build / MODULES, folder / MODULES)

    def lay_out(self, several, folder, broken):
        """What a machine is given that runs these scenarios; each has a folder of its own for what it leaves."""
        for program in PROGRAMS:
            shutil.copy(self.build / "bin" / program, folder)
        for file in self.folder.iterdir():
            if file.is_file():
                shutil.copy(file, folder)
        shutil.copy(self.here / "run_scenarios.sh", folder / "scenario")
        if any(one.needs == "package" for one in several):
            shutil.copy(self.package(), folder / "farpoint.deb")
        if any(one.needs == "libcamera" for one in several):
            self._lay_out_modules(folder)
        support = (self.here / "support.sh").read_text()
        for one in several:
            (folder / one.name).mkdir()
            script = f"BROKEN={'yes' if broken else ''}\n{support}\n{one.script}"
            (folder / one.name / "scenario").write_text(script)
            (folder / one.name / "frames.grey").symlink_to(folder / "frames.grey")
        (folder / "names").write_text("".join(one.name + "\n" for one in several))
