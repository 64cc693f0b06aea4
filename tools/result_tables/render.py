# SPDX-License-Identifier: Apache-2.0
"""Tables in Markdown from results, between markers: <!-- results:NAME --> ... <!-- /results:NAME -->."""

import re
import statistics

from . import cells, figures, spread
from .manifest import TABLES, find, shown
from .store import ResultsError

MODES = ("baseline", "vmp")
MARKED = re.compile(r"<!-- results:(?P<name>\w+) -->\n(?P<body>.*?)<!-- /results:(?P=name) -->", re.DOTALL)
MARKER = re.compile(r"<!-- /?results:(\w+) -->")


def grid(columns, rows):
    lines = [f"| {' | '.join(row)} |" for row in (columns, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(columns), *lines[1:]]) + "\n"


def metres(value):
    if value is None:
        return "none"
    return f"{value:.4f}" if value < 0.02 else f"{value:.3f}"


def accuracy(table, result):
    def cell(part):
        return f"{metres(part['ate_rmse_m'])} ({100 * (part['share'] or 0):.1f} %)"

    rows = [[row.label, cell(result["rows"][row.label]["final"]), cell(result["rows"][row.label]["live"]), row.given]
            for row in table.rows]
    return grid(["recording", "final", "live", "peer, final"], rows) + segments(table, result)


def segments(table, result):
    lines = []
    for row in table.rows:
        scales = [part["scale"] for part in result["rows"][row.label].get("segments") or [] if part.get("scale")]
        if len(scales) > 1:
            lines.append(f"\n{row.label}: scale of the stretches {', '.join(f'{scale:.4f}' for scale in scales)}; they "
                         f"differ by {100 * (max(scales) / min(scales) - 1):.1f} %.\n")
    return "".join(lines)


def compared(pairs):
    return [pair for pair in pairs if pair.get("compared", True)]


def pair_cells(label, pairs):
    """One row for all pairs: medians of both modes, median ratio with its interval, and what it says."""
    def both(value, form, factor=1):
        found = [spread.known([value(pair[mode]) for pair in pairs]) for mode in MODES]
        return " / ".join(form.format(factor * statistics.median(values)) if values else "-" for values in found)

    ate = spread.known(spread.ratios(compared(pairs), figures.final_ate_m))
    depth = spread.known(spread.ratios(compared(pairs), figures.p90_depth_m))
    return [label, f"{len(ate)} of {len(pairs)}", both(figures.final_ate_m, "{:.3f}"), spread.text(ate),
            spread.difference(ate), both(figures.p90_depth_m, "{:.0f}"), spread.text(depth),
            both(figures.live_share, "{:.1f}", 100), both(lambda run: run["depth_over_100_m_percent"], "{:.1f}"),
            f"{statistics.median(pair['vmp']['vmp_percent'] for pair in pairs):.1f}"]


PAIR_COLUMNS = ["", "pairs compared", "ATE m", "ratio (95 % interval)", "difference", "p90 depth m",
                "ratio (95 % interval)", "live share %", "> 100 m %", "VMP %"]


def pairs(table, result):
    rows = [pair_cells(label, values["pairs"]) for label, values in result["rows"].items()]
    return grid(PAIR_COLUMNS, rows) + landmarks(result)


def scenes(table, result):
    rows = [[*pair_cells(label, values["pairs"]), " / ".join(f"{values['abs_z_p95'][mode]:.1f}" for mode in MODES)]
            for label, values in result["rows"].items()]
    return grid([*PAIR_COLUMNS, "95 % of \\|z\\|"], rows)


LANDMARK_COLUMNS = (("n", "{:.0f}", "landmarks"), ("error_p50_percent", "{:.2f}", "median error %"),
                    ("error_p90_percent", "{:.1f}", "p90 error %"),
                    ("claimed_sigma_percent", "{:.2f}", "claimed sigma %"),
                    ("error_in_claimed_sigmas", "{:.2f}", "error in claimed sigmas"))


def landmarks(result):
    """Medians over the runs of each bin of true distance, where a world tells it."""
    runs = [pair for values in result["rows"].values() for pair in values["pairs"]]
    judged = [pair for pair in runs if all(pair[mode].get("landmarks") for mode in MODES)]
    bins = [name for name in (judged[0]["vmp"]["landmarks"] if judged else ()) if name.startswith("from_")]
    rows = [landmark_cells(judged, name) for name in bins
            if any(pair[mode]["landmarks"][name]["n"] for pair in judged for mode in MODES)]
    return "\n" + grid(["true distance m", *[words for _, _, words in LANDMARK_COLUMNS]], rows) if rows else ""


def landmark_cells(judged, name):
    def both(key, form):
        found = [spread.known([pair[mode]["landmarks"][name][key] for pair in judged]) for mode in MODES]
        return " / ".join(form.format(statistics.median(values)) if values else "-" for values in found)

    distance = name.removeprefix("from_").removesuffix("_m").replace("_to_", " to ")
    return [distance, *[both(key, form) for key, form, _ in LANDMARK_COLUMNS]]


def of_cells(make):
    """A renderer from a function that returns columns and rows."""
    return lambda table, result: grid(*make(table, result))


def carried(table, result):
    """Cells that were read off a text once, until the table's commands have run."""
    return "\n".join(grid(values["columns"], values["cells"]) for values in result["rows"].values())


OF_CELLS = (cells.bench, cells.work, cells.gaps, cells.odometry_gaps, cells.searching, cells.threads, cells.beside_load,
            cells.memory, cells.instructions, cells.endless, cells.hil)
KINDS = {"accuracy": accuracy, "scenes": scenes, "pairs": pairs, **{make.__name__: of_cells(make) for make in OF_CELLS}}


def is_carried(result):
    return "cells" in next(iter(result["rows"].values()))


def made_line(made):
    words = f"Made at `{made['commit'][:7]}`, {made['date']}"
    if made.get("carried_over"):
        return f"{words}; carried over {made['carried_over']}.\n"
    machine = made["machine"]
    return f"{words}, in {made['seconds']} s; {machine['cpu']}, {machine['cores']} cores, {machine['simd']}.\n"


def block(table, result):
    """What stands between the markers of a table."""
    if result is None:
        return "Not made yet.\n"
    rendered = carried if is_carried(result) else KINDS[table.kind]
    commands = "\n".join(shown(command) for command in result["made"]["commands"])
    return f"```\n{commands}\n```\n{made_line(result['made'])}\n{rendered(table, result)}"


def rows_of(make, result):
    """The rows of a result whose figures stand in the headline, read off a text or made."""
    return next(iter(result["rows"].values()))["cells"] if is_carried(result) else make(None, result)[1]


def headline(results):
    """The four figures of README.md."""
    def at(name):
        return f"`{name}`, `{results[name]['made']['commit'][:7]}`"

    drive = find("recordings").rows[0]
    kitti = results["recordings"]["rows"][drive.label]["final"]
    far = next(iter(results["offsets_kitti"]["rows"].values()))["pairs"]
    depths = [statistics.median(figures.p90_depth_m(pair[mode]) for pair in far) for mode in MODES]
    tracking, memory = rows_of(cells.bench, results["bench"])[0], rows_of(cells.memory, results["memory"])[0]
    return grid(["what", "figure", "table, commit"], [
        [f"RMS position error, {drive.label}, {100 * kitti['share']:.0f} % of the frames, aligned by scale",
         f"{metres(kitti['ate_rmse_m'])} m; ORB-SLAM3 {drive.given.replace('..', 'to')} m", at("recordings")],
        ["p90 depth of new points with virtual map points against without, same drive, 15 starts",
         f"{depths[1]:.1f} m against {depths[0]:.1f} m", at("offsets_kitti")],
        ["tracking a frame of 1241x376, image to pose, CPU p50 and p99",
         f"{tracking[1]}, {tracking[2]} ms; {tracking[3]} of `cv::ORB`'s time", at("bench")],
        [memory[0], memory[1], at("memory")]])


def blocks(results):
    """Text for every marker. `results` maps a table's name to its result or None."""
    made = {table.name: block(table, results[table.name]) for table in TABLES}
    if all(results[name] for name in ("recordings", "offsets_kitti", "bench", "memory")):
        made["headline"] = headline(results)
    return made


def rendered(text, made, name):
    """`text` with each marked stretch replaced. Refuses markers that are unknown, doubled or not closed."""
    found = [match["name"] for match in MARKED.finditer(text)]
    if MARKER.findall(text) != [word for word in found for _ in range(2)]:
        raise ResultsError(f"{name}: a marker is not closed, or stands inside another; expected lines of their own")
    unknown = sorted(set(found) - set(made))
    if unknown:
        raise ResultsError(f"{name}: no results for the marker {unknown[0]}; expected one of {', '.join(sorted(made))}")
    return MARKED.sub(lambda m: f"<!-- results:{m['name']} -->\n{made[m['name']]}<!-- /results:{m['name']} -->", text)
