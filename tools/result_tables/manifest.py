# SPDX-License-Identifier: Apache-2.0
"""Every table of tests/RESULTS.md with the commands that make it. In commands {bin} is the build's folder of programs,
{build} the build, {data} the folder of recordings, {root} the repository, {jobs} an option. Each row runs in a folder
of its own; its last command prints JSON.
"""

from dataclasses import dataclass

ESTIMATOR = ("slam", "config/farpoint.yaml#scale,pyramid,extractor,capacity,initialisation,tracking,keyframes,landmarks,"
                     "mapping,calibration")


@dataclass(frozen=True)
class Row:
    label: str
    commands: tuple
    given: str = ""  # a cell that no command makes, such as another program's figure


@dataclass(frozen=True)
class Table:
    name: str
    kind: str  # a key of render.KINDS
    rows: tuple
    inputs: tuple = ESTIMATOR  # a change of these makes the table old
    timed: bool = False  # holds measured times: no two runs are equal; other work on the machine disturbs it
    long: bool = False  # --long runs it again and compares exactly
    minutes: float = 1  # estimate for two cores; a finished result has the measured time
    shows_failures: bool = False  # status 1 with JSON is a result: a failed check is marked in the table

    @property
    def commands(self):
        return [command for row in self.rows for command in row.commands]


def recording(label, source, peer, evaluate=""):
    return Row(label, (f"{{bin}}/farpoint import {source} -o run.lcm",
                       "{bin}/farpointd --replay run.lcm --lockstep --output out.lcm",
                       f"{{bin}}/farpoint evaluate out.lcm --truth run.lcm{evaluate} --json"), peer)


def scene(label, arguments):
    return Row(label, (f"{{bin}}/sim_compare {arguments} --json",))


def pairs(name, label, arguments, inputs=(), **other):
    command = f"tools/compare_modes {arguments}{{jobs}} --json"
    return Table(name, "pairs", (Row(label, (command,)),), (*ESTIMATOR, *inputs), **other)


def world(name, size, duration_s):
    return pairs(f"world_{name}", name, f"world {name} --seeds 1-20 --duration {duration_s} --size {size}",
                 (f"config/worlds/{name}.yaml", "tools/simulate"), minutes=10)


KITTI = "{bin}/farpoint import kitti {data}/kitti 03 -o run.lcm"
EUROC = "{bin}/farpoint import euroc {data}/euroc/MH_01_part -o run.lcm"
DAEMON = (*ESTIMATOR, "config/farpoint.yaml#realtime", "daemon")


def live(label, importing, options):
    """Threaded runs, alone or beside load."""
    return Row(label, (importing, f"tools/live_runs run.lcm {options}"))


def recorded_tests(name, kind, program, suite, **other):
    """A table of figures that long tests record; a failed test keeps its row and is marked."""
    return Table(name, kind, (Row(suite, (test_figures(program, suite),)),), (*ESTIMATOR, "tests/replay"),
                 shows_failures=True, **other)


def test_figures(program, suite):
    return f"tools/test_figures {{bin}}/{program} --gtest_filter='*{suite}.*'"


PRIORITIES = "".join(f" --set realtime.{thread}_priority={priority}"
                     for thread, priority in (("capture", 40), ("output", 35), ("tracking", 30)))


def beside_load(label, settings):
    """Two minutes at 30 Hz beside four processes of load."""
    return Row(label, ("sed 's/rate_hz: .*/rate_hz: 30/' {root}/config/worlds/endless.yaml > endless30.yaml",
                       "{bin}/farpoint simulate endless30.yaml -o run.lcm --size 320x240 --duration 120",
                       f"tools/live_runs run.lcm --computing 2 --copying 1 --writing 1{settings}"))


TABLES = (
    Table("recordings", "accuracy", (
        recording("KITTI 03, first half, 284 m", "kitti {data}/kitti 03", "0.766 .. 0.847",
                  " --segments 0:70,110:400"),
        recording("Karlsruhe 0019, half, 98 m", "kitti {data}/karlsruhe 2010_03_09_0019", "0.93 .. 0.94"),
        recording("EuRoC MH_01, part, camera 0", "euroc {data}/euroc/MH_01_part", "0.0058 .. 0.0061"),
        recording("TUM fr1_rpy, part",
                  "tum {data}/tum/freiburg1_rpy_part --camera {root}/config/cameras/tum-freiburg1.yaml",
                  "0.016 .. 0.017 over 27 .. 40 %"),
    ), (*ESTIMATOR, "tools/import", "tools/evaluate"), long=True),
    Table("scenes", "scenes", (
        scene("straight, 300 m", "--seeds 20 --scene straight"),
        scene("highway, 740 m", "--seeds 20 --scene highway"),
        scene("highway, 40 more seeds", "--first 21 --seeds 40 --scene highway"),
        scene("turning, 280 m", "--seeds 20 --scene turning"),
        scene("hovering drone, 180 m", "--seeds 20 --scene hovering"),
        scene("hovers, then flies", "--seeds 20 --scene hover_start"),
        scene("endless, winding, 600 m", "--seeds 20 --scene endless"),
    ), (*ESTIMATOR, "tests/scenes"), minutes=13),
    pairs("offsets_kitti", "KITTI 03, first half",
          "kitti {data}/kitti 03 --offsets 0,6,12,18,25,31,37,44,50,56,62,68,75,81,90", minutes=2),
    pairs("offsets_karlsruhe", "Karlsruhe 0019, half",
          "kitti {data}/karlsruhe 2010_03_09_0019 --offsets 0,5,10,15,20", long=True),
    world("town", "620x188", 30),
    world("highway", "620x188", 30),
    world("valley", "480x270", 40),
    world("hover", "376x240", 40),
    Table("bench", "bench", (Row("KITTI 03, first half", (
        "{bin}/farpoint import kitti {data}/kitti 03 -o run.lcm", "{bin}/farpoint bench run.lcm --json")),),
        DAEMON, timed=True),
    Table("work", "work", (Row("KITTI 03, first half, and town", (
        "{bin}/farpoint import kitti {data}/kitti 03 -o kitti.lcm",
        "{bin}/farpointd --replay kitti.lcm --lockstep --output kitti03.lcm",
        "{bin}/farpoint simulate town -o run.lcm --duration 60",
        "{bin}/farpointd --replay run.lcm --lockstep --output town.lcm",
        "{bin}/farpoint report kitti03.lcm town.lcm --json")),),
        (*ESTIMATOR, "tools/report", "tools/simulate", "config/worlds/town.yaml"), timed=True, minutes=2),
    Table("instructions", "instructions", (
        Row("rendered `town` at 320x240, 3.5 s", (
            "{bin}/farpoint simulate town -o run.lcm --size 320x240 --duration 3.5",
            "tools/count_instructions run.lcm")),
    ), (*ESTIMATOR, "tools/count_instructions"), minutes=2),
    recorded_tests("gaps", "gaps", "test_replay", "RecordedGapsLong", minutes=2),
    recorded_tests("odometry_gaps", "odometry_gaps", "test_replay", "RecordedOdometryGapsLong", minutes=6),
    Table("searching", "searching", (
        Row("KITTI 03, first half", (KITTI, "tools/lost_runs run.lcm")),
        Row("EuRoC MH_01, part, camera 0", (EUROC, "tools/lost_runs run.lcm")),
    ), (*ESTIMATOR, "tools/lost_runs"), timed=True, minutes=2),
    Table("threads", "threads", (
        live("KITTI 03 half (9.7 Hz), 1", KITTI, "--speed 1 --runs 3 --computing 8"),
        live("KITTI 03 half, 2 and 3", KITTI, "--speed 2,3 --runs 2"),
        live("KITTI 03 half, 4 and 5", KITTI, "--speed 4,5 --runs 2"),
        live("KITTI 03 half, 6", KITTI, "--speed 6 --runs 3"),
        live("KITTI 03 half, 8 and 12 (116 Hz)", KITTI, "--speed 8,12 --runs 3"),
        live("EuRoC part, camera 0 (20 Hz), 1", EUROC, "--speed 1 --computing 8"),
        live("EuRoC part, 1 to 4", EUROC, "--speed 1,2,3,4"),
        live("EuRoC part, 6 (120 Hz)", EUROC, "--speed 6 --runs 2"),
    ), DAEMON, timed=True, minutes=7),
    Table("memory", "memory", (
        Row("lockstep", (KITTI, "{bin}/farpointd --replay run.lcm --lockstep --output out.lcm",
                         "{bin}/farpoint report out.lcm --json")),
        live("threads with locked memory", KITTI, "--speed 2 --runs 2 --memory"),
    ), DAEMON, timed=True),
    Table("memory_endless", "endless", (
        Row("KITTI 03 half driven forth and back", (test_figures("test_replay", "RecordedEndlessLong"),)),
        Row("scene `endless`, room for 250 keyframes", (test_figures("test_scenes", "EndlessLong"),)),
        Row("rendered world `endless`, 320x240", (
            "{bin}/farpoint simulate endless -o - --size 320x240 --duration 2000 | "
            "{bin}/farpointd --replay - --lockstep --output out.lcm", "{bin}/farpoint report out.lcm --json")),
    ), (*DAEMON, "tests/replay", "tests/scenes", "tools/simulate"), timed=True, minutes=20, shows_failures=True),
    Table("beside_load", "beside_load", (
        beside_load("`SCHED_FIFO`: capture 40, output 35, tracking 30", PRIORITIES),
        beside_load("ordinary", ""),
    ), (*DAEMON, "tools/live_runs", "tools/result_tables/load.py"), timed=True, minutes=9),
    Table("hil", "hil", (
        Row("as it is", ("tools/hil/bench --build {build} --json",)),
        Row("broken", ("tools/hil/bench --build {build} --self-test --json",)),
    ), ("daemon", "drivers", "ipc", "tools/hil"), timed=True, minutes=38, shows_failures=True),
)


def find(name):
    for table in TABLES:
        if table.name == name:
            return table
    raise KeyError(name)


def shown(command):
    """The command as a reader types it in the root of the repository."""
    return (command.replace("{bin}", "build/release/bin").replace("{build}", "build/release")
            .replace("{data}", "../shared/data").replace("{root}/", "").replace("{jobs}", ""))
