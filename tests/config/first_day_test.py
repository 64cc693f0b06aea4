#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: first_day_test.py SOURCE_FOLDER BUILD_FOLDER SCENARIO | page

Runs the commands of config/vehicles/README.md as they stand there. Above each block of commands the page names a scenario;
here each scenario has what a reader brings (recordings of ../shared/data stand in) and what must come out. 'page' checks
that no block is left out, and figures that the page repeats. Status 77 where the recordings are missing.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import stand_ins

MARK = re.compile(r"^<!-- (?:run in (?P<scenario>\w+)|not run: (?P<reason>.+)) -->$")
# What no test runs, or another one: programs of other projects and hardware, the build, the package.
NOT_RUN = ("kalibr_calibrate_cameras ", "rosrun ", "ros2 run ", "v4l2-ctl ", "tools/deps ", "cmake ", "export PATH", "cp car/", "systemctl ",
           "journalctl ", "farpoint top", "farpointd --config farpoint.yaml --set camera.device=usb:1-1 ",
           "farpointd --check --config farpoint.yaml --set camera.device=usb:1-1 ")
PICTURES, RATE_HZ, KITTI_SIZE = 240, 10, (1242, 375)


class Failed(Exception):
    """What the test complains of."""


def expect(condition, complaint):
    if not condition:
        raise Failed(complaint)


# ---- the page ----

def blocks(page):
    """(scenario, reason why it is not run, text) of each block of commands; Failed for a block without a mark."""
    mark, block, found = None, None, []
    for number, line in enumerate(page.splitlines(), 1):
        if block is not None:
            if line == "```":
                found.append((mark["scenario"], mark["reason"], "\n".join(block)))
                mark, block = None, None
            else:
                block.append(line)
        elif line.startswith("```"):
            expect(mark is not None, f"README.md:{number}: a block of commands without a mark above it")
            block = []
        elif line:
            mark = MARK.match(line)
    return found


def commands(block):
    return block.replace("\\\n", " ").splitlines()


# What a reader may bring, and the log that its import makes.
SOURCES = {"drive": "drive.lcm", "drive.mp4": "from_video.lcm", "drive.bag": "from_bag.lcm", "drive.mcap": "from_mcap.lcm",
           "drive.db3": "from_db3.lcm"}


def from_bare_debian(page, source):
    """The commands from a clone and such a source to the report: set-up, import, check, replay, report."""
    found = blocks(page)
    setup = [command for _, reason, block in found if "tools/test" in (reason or "") for command in commands(block)]
    chain = commands(next(block for _, _, block in found if "path.tum" in block))
    if source == "drive":
        return setup + chain
    named = f"farpoint import {'video' if source.endswith('mp4') else 'bag'} {source} "
    own = next(command for _, _, block in found for command in commands(block)
               if command.startswith(named) and "--list" not in command)
    return [*setup, own, *(command.replace("drive.lcm", SOURCES[source]) for command in chain[1:])]


def check_page(page, source):
    found = blocks(page)
    named = {scenario for scenario, _, _ in found if scenario}
    expect(named == set(SCENARIOS), f"scenarios of the page and of the test differ: {named ^ set(SCENARIOS)}")
    for _, reason, block in found:
        for command in commands(block) if reason else ():
            expect(command.startswith(NOT_RUN), f"'{command}' is not run ({reason}), and could be")
    results = json.loads((source / "tests/results/bench.json").read_text())
    check_figures(page, results)
    for source in SOURCES:
        most = len(from_bare_debian(page, source))
        expect(most <= 7, f"{most} commands from a bare Debian and {source} to the report, expected at most 7")


def check_figures(page, results):
    """The page rounds; it must not be off by more than 15 % from the table that it names."""
    text = json.dumps(results)
    tracking = json.loads(re.search(r'"tracking": (\{[^{}]*\})', text).group(1))
    process = float(re.search(r'"process_cpu_yardsticks": ([\d.]+)', text).group(1))
    said = re.search(r"tracking takes ([\d.]+) of one \(p50\) and ([\d.]+) \(p99\), and a frame with all that belongs to it\n"
                     r"([\d.]+) on the mean", page)
    expect(said is not None, "the page does not give the figures of the table 'bench' in the words that are known here")
    for name, figure, true in (("p50", said.group(1), tracking["p50_yardsticks"]), ("p99", said.group(2), tracking["p99_yardsticks"]),
                               ("process", said.group(3), process)):
        expect(abs(float(figure) / true - 1) < 0.15, f"{name}: the page says {figure} yardsticks, the table bench {true:.2f}")
    for yardstick, p99, *cores in re.findall(r"^\| ([\d]+) ms \| ([\d]+) ms \| ([\d.]+), ([\d.]+), ([\d.]+) \|", page, re.MULTILINE):
        expect(abs(int(p99) / (int(yardstick) * tracking["p99_yardsticks"]) - 1) < 0.15, f"{yardstick} ms: p99 of {p99} ms is wrong")
        for rate_hz, share in zip((10, 20, 30), map(float, cores)):
            true = int(yardstick) * process * rate_hz / 1000
            expect(abs(share - true) < 0.05 + 0.15 * true, f"{yardstick} ms at {rate_hz} Hz: {share} cores, expected {true:.2f}")


# ---- what a reader brings, and what must come out ----

class Reader:
    """A folder with the examples, the programs on the path, and what the commands printed."""

    def __init__(self, source, build, folder, until):
        self.source, self.folder, self.said = source, folder, ""
        self.recordings = (source.parent / "shared/data").resolve()
        self.vehicles = folder / "vehicles"
        shutil.copytree(source / "config/vehicles", self.vehicles)
        (folder / "bin").mkdir()
        (folder / "bin/python3").symlink_to("/usr/bin/python3")
        (folder / "bin/timeout").symlink_to(source / "tests/config/patient_timeout.py")
        path = f"{folder}/bin:{build}/bin:{os.environ['PATH']}"
        self.environment = {**os.environ, "PATH": path, "PYTHONDONTWRITEBYTECODE": "1", "FARPOINT_UNTIL": until}
        alone = ["unshare", "--map-root-user", "--net"]  # nothing leaves, and tests run side by side
        self.prefix = alone if subprocess.run([*alone, "true"], capture_output=True, check=False).returncode == 0 else []

    def run(self, where, block):
        done = subprocess.run([*self.prefix, "bash", "-euo", "pipefail", "-c", block], cwd=where, env=self.environment, text=True,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        self.said += done.stdout
        print(done.stdout, end="")
        expect(done.returncode == 0, f"status {done.returncode} of:\n{block}")

    def recording(self, name):
        return self.recordings / name


def poses_of(file):
    return len(file.read_text().splitlines())


def pictures_of(log):
    from host import lcm_log  # of tools/hil: code that shares nothing with what is tested
    return [(image.utime, image.pixels) for _, image in lcm_log.images(log)]


def expect_report(file):
    text = file.read_text()
    expect(text.rstrip().endswith("</html>") and text.count("<svg") >= 5, f"{file.name} is no report")


def lens_of_kitti(reader):
    return stand_ins.kitti_lens(reader.recording(stand_ins.KITTI), KITTI_SIZE)


def bring_recording(recordings, where, count=PICTURES):
    """A folder of pictures with ROS' calibration, and the same as film and as bags."""
    recording = recordings / stand_ins.KITTI
    lens = stand_ins.kitti_lens(recording, KITTI_SIZE)
    pictures = stand_ins.link_pictures(recording / "image_0", where / "drive", count)
    (where / "ost.yaml").write_text(stand_ins.ros_calibration(lens))
    (where / "board-camchain.yaml").write_text(stand_ins.kalibr_chain(lens))
    (where / "drive.bag").write_bytes(stand_ins.bag_of(pictures, lens, RATE_HZ))
    (where / "drive.mcap").write_bytes(stand_ins.mcap_of(pictures, lens, RATE_HZ))
    stand_ins.write_db3_of(pictures, lens, RATE_HZ, where / "drive.db3")
    stand_ins.make_video(f"{where}/drive/%06d.jpg", RATE_HZ, where / "drive.mp4")
    return where


def prepare_recording(reader, count=PICTURES):
    return bring_recording(reader.recordings, reader.folder, count)


def expect_imports(where, names):
    """The logs hold the pictures byte for byte, a film its frames."""
    files = [path.read_bytes() for path in sorted((where / "drive").iterdir())]
    expect(len(files) == PICTURES, f"{len(files)} pictures")
    for name in names:
        taken = pictures_of(where / f"{name}.lcm")
        expect([pixels for _, pixels in taken] == files, f"{name}.lcm does not hold the pictures byte for byte")
        start = taken[0][0]
        expect(all(abs(utime - start - number * 1e6 / RATE_HZ) < 2 for number, (utime, _) in enumerate(taken)),
               f"the times of {name}.lcm are not {RATE_HZ} a second")
    expect_same_pictures(files, [pixels for _, pixels in pictures_of(where / "from_video.lcm")])


def expect_run(where):
    """What a replay and its report left."""
    poses = poses_of(where / "path.tum")
    expect(poses >= 0.95 * PICTURES, f"only {poses} of {PICTURES} frames have a pose")
    expect_report(where / "report.html")


def check_recording(reader):
    where = reader.folder
    expect_imports(where, ("drive", "chain", "from_bag", "from_mcap", "from_db3"))
    expect_run(where)
    expect("sensor_msgs/CompressedImage" in reader.said, "--list names no images")
    expect(f"drive.lcm: {PICTURES} images in 23.9 s (10 Hz)" in reader.said, "--check does not describe the log")
    expect("mask.png: " in reader.said and "% of the image" in reader.said, "--check does not describe the mask")
    taken = subprocess.run(["tar", "-tzf", where / "fault.tar.gz"], capture_output=True, text=True, check=True).stdout
    expect("hardware/processor.txt" in taken and "state/check.txt" in taken, "the bugreport lacks processor or check: " + taken)


def expect_same_pictures(files, taken):
    """A video was encoded and decoded on the way: grey levels may differ by rounding."""
    import cv2
    import numpy as np
    expect(len(taken) == len(files), f"{len(taken)} of {len(files)} frames of the video were taken")
    for number in (0, len(files) // 2, len(files) - 1):
        one, other = (cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE).astype(int)
                      for data in (files[number], taken[number]))
        expect(np.abs(one - other).max() <= 2, f"frame {number} of the video differs by up to {np.abs(one - other).max()} grey levels")


def prepare_bench(reader):
    prepare_recording(reader, 80)
    reader.run(reader.folder, "farpoint import images drive --rate 10 --camera ost.yaml -o drive.lcm")
    return reader.folder


def check_bench(reader):
    expect("yardstick" in reader.said and "tracking" in reader.said, "bench names no yardstick")


def prepare_calibration(reader):
    import chessboard
    chessboard.write_pictures(chessboard.PINHOLE, reader.folder / "film")
    # Two pictures a second, each shown for as long as the command takes one.
    stand_ins.make_video(f"{reader.folder}/film/%04d.png", 2, reader.vehicles / "board.mp4")
    return reader.vehicles


def check_calibration(reader):
    import chessboard
    lines = dict(line.split(": ", 1) for line in (reader.vehicles / "camera.yaml").read_text().splitlines())
    true = chessboard.PINHOLE["matrix"][0, 0]
    expect(abs(float(lines["fx_px"]) / true - 1) < 0.002, f"focal length {lines['fx_px']}, expected {true}")
    # Its file is one that the programs take.
    reader.run(reader.folder, "farpoint import images film --rate 10 --camera vehicles/camera.yaml -o film.lcm")


def prepare_car(reader):
    where = reader.vehicles / "car"
    stand_ins.replace_lens(where / "camera.yaml", lens_of_kitti(reader))
    stand_ins.link_pictures(reader.recording(stand_ins.KITTI) / "image_0", where / "drive", 120)
    return where


def check_car(reader):
    where = reader.vehicles / "car"
    expect("FARPOINT_STATUS" in (where / "odometry.dbc").read_text(), "odometry.dbc describes no frame")
    expect(poses_of(where / "out.candump") > 1000, "few frames for the bus")
    live = pictures_of(where / "again-000001.lcm")
    expect(len(live) >= 10, f"{len(live)} pictures were recorded in eight seconds at {RATE_HZ} Hz")
    expect_report(where / "report.html")


def prepare_rover(reader):
    where, source = reader.vehicles / "rover", reader.recording(stand_ins.KARLSRUHE)
    (where / "recordings/sequences").mkdir(parents=True)
    (where / "recordings/sequences/01").symlink_to(source)
    return where


def check_rover(reader):
    where = reader.vehicles / "rover"
    expect("2 cameras" in reader.said, "the second camera was not imported")
    expect("live from v4l2 usb:1-1.1 and usb:1-1.2" in reader.said, "it did not start with two cameras")
    expect("no_camera" in reader.said or "no camera" in reader.said, "nothing names the missing cameras")
    expect_report(where / "report.html")


def prepare_drone(reader):
    where, source = reader.vehicles / "drone", reader.recording(stand_ins.EUROC)
    stand_ins.replace_lens(where / "camera.yaml", stand_ins.euroc_lens(source))
    stand_ins.link_pictures(source / "data", where / "flight", 200)
    return where


def check_drone(reader):
    where = reader.vehicles / "drone"
    expect("read as ns" in reader.said, "the names were not read as stamps")
    expect(poses_of(where / "live.tum") >= 120, f"only {poses_of(where / 'live.tum')} of 200 poses are valid")
    expect_report(where / "report.html")


def prepare_simulation(reader):
    return reader.vehicles


def check_simulation(reader):
    expect(re.search(r"\bATE\b", reader.said), "evaluate prints no error")


SCENARIOS = {"recording": (prepare_recording, check_recording), "bench": (prepare_bench, check_bench),
             "calibration": (prepare_calibration, check_calibration), "car": (prepare_car, check_car),
             "rover": (prepare_rover, check_rover), "drone": (prepare_drone, check_drone),
             "simulation": (prepare_simulation, check_simulation)}
# What the live runs of a scenario print before their seconds count.
UNTIL = {"car": "streams ", "rover": "-> no_camera"}
WITHOUT_RECORDINGS = ("calibration", "simulation")


def check_scenario(name, page, source, build):
    prepare, check = SCENARIOS[name]
    with tempfile.TemporaryDirectory() as folder:
        reader = Reader(source, build, pathlib.Path(folder), UNTIL.get(name, "live from"))
        where = prepare(reader)
        for scenario, _, block in blocks(page):
            if scenario == name:
                reader.run(where, block)
        check(reader)


def main():
    source, build, name = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]
    page = (source / "config/vehicles/README.md").read_text()
    if name in SCENARIOS and name not in WITHOUT_RECORDINGS and not (source.parent / "shared/data/kitti").is_dir():
        print("first_day_test.py: no recordings in ../shared/data")
        return 77
    try:
        check_page(page, source) if name == "page" else check_scenario(name, page, source, build)
    except Failed as complaint:
        print(f"first_day_test.py: {name}: {complaint}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
