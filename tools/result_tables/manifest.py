# SPDX-License-Identifier: Apache-2.0
"""Every table of tests/RESULTS.md with the commands that make it. In commands {bin} is the build's folder of programs,
{data} the folder of recordings, {jobs} an option. Each row runs in a folder of its own; its last command prints JSON.
"""

from dataclasses import dataclass

ESTIMATOR = ("slam", "config/farpoint.yaml")


@dataclass(frozen=True)
class Row:
    label: str
    commands: tuple
    given: str = ""  # a cell that no command makes, such as another program's figure


@dataclass(frozen=True)
class Table:
    name: str
    kind: str  # accuracy, scenes, pairs, bench: rendered from figures; by_hand: cells
    rows: tuple
    inputs: tuple = ESTIMATOR  # a change of these makes the table old
    timed: bool = False  # holds measured times: no two runs are equal
    long: bool = False  # --long runs it again and compares exactly

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
                 (f"config/worlds/{name}.yaml", "tools/simulate"))


def by_hand(name, *commands, inputs=ESTIMATOR, timed=True):
    """Tables whose commands print text: the cells in the results file were read off it."""
    return Table(name, "by_hand", (Row(name, commands),), inputs, timed)


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
    ), (*ESTIMATOR, "tests/scenes")),
    pairs("offsets_kitti", "KITTI 03, first half",
          "kitti {data}/kitti 03 --offsets 0,6,12,18,25,31,37,44,50,56,62,68,75,81,90"),
    pairs("offsets_karlsruhe", "Karlsruhe 0019, half",
          "kitti {data}/karlsruhe 2010_03_09_0019 --offsets 0,5,10,15,20", long=True),
    world("town", "620x188", 30),
    world("highway", "620x188", 30),
    world("valley", "480x270", 40),
    world("hover", "376x240", 40),
    by_hand("world_landmarks", *[f"tools/compare_modes world {name} --seeds 1-5 --duration {duration}"
                                 for name, duration in (("town", 30), ("highway", 30), ("valley", 40), ("hover", 40))],
            timed=False),
    Table("bench", "bench", (Row("KITTI 03, first half", (
        "{bin}/farpoint import kitti {data}/kitti 03 -o run.lcm", "{bin}/farpoint bench run.lcm --json")),),
        (*ESTIMATOR, "daemon"), timed=True),
    by_hand("work", "{bin}/farpoint report kitti03.lcm town.lcm -o work.html"),
    by_hand("gaps", "{bin}/test_replay --gtest_filter='*RecordedGapsLong*'", timed=False),
    by_hand("threads", "{bin}/test_replay --gtest_filter='RecordedThreadsLong.*'",
            "{bin}/farpointd --replay run.lcm --speed 1 --output out.lcm", inputs=(*ESTIMATOR, "daemon")),
    by_hand("memory", "{bin}/farpointd --replay run.lcm --lockstep --output out.lcm",
            "{bin}/farpointd --replay run.lcm --speed 1 --output locked.lcm",
            "{bin}/farpoint evaluate out.lcm locked.lcm --truth run.lcm --json",
            "{bin}/test_replay --gtest_filter='RecordedEndlessLong.*'",
            "{bin}/test_scenes --gtest_filter='EndlessLong.*'", inputs=(*ESTIMATOR, "daemon")),
    by_hand("beside_load", "{bin}/farpoint simulate endless30.yaml -o endless30.lcm --size 320x240 --duration 605",
            "{bin}/farpointd --replay endless30.lcm --speed 1 --output out.lcm --set realtime.capture_priority=40 "
            "--set realtime.output_priority=35 --set realtime.tracking_priority=30",
            "{bin}/farpoint evaluate out.lcm --truth endless30.lcm", inputs=(*ESTIMATOR, "daemon")),
    by_hand("hil", "tools/hil/bench --build build/release", "tools/hil/bench --build build/release --self-test",
            inputs=("daemon", "drivers", "ipc", "tools/hil")),
)


def find(name):
    for table in TABLES:
        if table.name == name:
            return table
    raise KeyError(name)


def shown(command):
    """The command as a reader types it in the root of the repository."""
    return (command.replace("{bin}", "build/release/bin").replace("{data}", "../shared/data")
            .replace("{root}/", "").replace("{jobs}", ""))
