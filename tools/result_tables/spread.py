# SPDX-License-Identifier: Apache-2.0
"""Medians of paired ratios, and how uncertain they are."""

import random
import statistics

RESAMPLES = 4000
SEED = 1
# Fewer pairs give no interval: resamples of three or four values hardly differ from the values themselves.
MIN_PAIRS = 5


def ratios(pairs, value):
    """vmp / baseline of each pair {"baseline": run, "vmp": run}; None where `value` gives a run no figure."""
    found = []
    for pair in pairs:
        below, above = value(pair["baseline"]), value(pair["vmp"])
        found.append(above / below if below and above is not None else None)
    return found


def percentile(values, percent):
    """The value at this rank, in percent of their number; the largest for 100."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, percent * len(ordered) // 100)]


def known(values):
    return [v for v in values if v is not None]


def median_interval(values, share=0.95):
    """Percentile bootstrap of the median: (low, high). The seed is fixed, so that equal values give equal intervals.
    None for fewer than MIN_PAIRS values."""
    if len(values) < MIN_PAIRS:
        return None
    source = random.Random(SEED)
    medians = sorted(statistics.median(source.choices(values, k=len(values))) for _ in range(RESAMPLES))
    tail = (1 - share) / 2
    return medians[int(tail * RESAMPLES)], medians[int((1 - tail) * RESAMPLES) - 1]


def difference(values, smaller_is_better=True):
    """What the ratios say in words: 'none' where the interval of their median holds 1."""
    interval = median_interval(values)
    if interval is None:
        return "unknown"
    low, high = interval
    if low <= 1 <= high:
        return "none"
    percent = 100 * (statistics.median(values) - 1)
    better = (percent < 0) == smaller_is_better
    return f"vmp {'better' if better else 'worse'} by {abs(percent):.0f} %"


def text(values, digits=2):
    """Median and interval, as in a table."""
    if not values:
        return "-"
    interval = median_interval(values)
    middle = f"{statistics.median(values):.{digits}f}"
    return middle if interval is None else f"{middle} ({interval[0]:.{digits}f} to {interval[1]:.{digits}f})"
