# SPDX-License-Identifier: Apache-2.0
"""A consumer of the bus that keeps to the DBC alone: which poses it takes for true, and whether it was right to.

The scenario notes what it did in a file of events, one a line, in seconds of the real time clock:

    blind FROM TO       no image can have been tracked in that time
    silent FROM TO      no daemon runs in that time
    held FROM TO        the output thread stands still in that time
    stopped AT          an orderly end
    started AT          a start, except the first
"""

import collections
import math
import pathlib

from host import can_bus

# An image's time is known to 1 ms, and candump's clock of arrival to some ms on the guest's one core.
AGE_ERROR_S = 0.01
# Longest validity without an image, and one period of images at 10 Hz that were still on their way.
BLIND_AFTER_S = 0.25 + 0.1
# The prediction over a period of images may be off by the whole motion in it.
PERIOD_S = 0.1
TIMEOUT_S = 0.1  # the DBC's GenMsgTimeoutTime of the status frame
ENDING_S = 0.1  # what a process that was just killed had given to the kernel
STOPPED = can_bus.STATE_STOPPED

Accepted = collections.namedtuple("Accepted", "time_s taken_s origin place heading_deg speed_m_s yaw_rate_deg_s")


class Consumer:
    def __init__(self, messages):
        self.receiver = can_bus.Receiver(messages)
        self.messages = messages

    def signal(self, epoch, name):
        """The value of the epoch's frame that has this signal; None where it is not available or did not come."""
        for identifier, message in self.messages.items():
            if name in message.signals and identifier in epoch.frames:
                return self._available(message, name, epoch.frames[identifier])
        return None

    @staticmethod
    def _available(message, name, data):
        _, bits, signed, _ = message.signals[name]
        code = 1 << bits - 1 if signed else (1 << bits) - 1
        if bits > 1 and can_bus.raw(message, name, data) == code:
            return None
        return can_bus.value(message, name, data)

    def accept(self, epoch):
        """What a controller would use; None where the epoch says that nothing may be used."""
        if not self.signal(epoch, "PoseValid"):
            return None
        vector = [self.signal(epoch, name) for name in ("PositionX", "PositionY", "PositionZ")]
        velocity = [self.signal(epoch, name) for name in ("VelocityX", "VelocityY", "VelocityZ")]
        return Accepted(epoch.time_s, epoch.time_s - self.signal(epoch, "Age"),
                        (self.signal(epoch, "BootCounter"), self.signal(epoch, "ResetCounter")),
                        None if None in vector else vector, self.signal(epoch, "Heading"),
                        0.0 if None in velocity else math.hypot(*velocity), abs(self.signal(epoch, "YawRate") or 0.0))


def events(path):
    """name -> [times]."""
    found = collections.defaultdict(list)
    for line in pathlib.Path(path).read_text().splitlines():
        name, *times = line.split()
        found[name].append([float(time) for time in times])
    return found


def judge(messages, log, stamps_s, happened):
    """(complaint or None, figures)."""
    consumer = Consumer(messages)
    complaint, epochs = consumer.receiver.epochs(log)
    if complaint:
        return complaint, []
    taken = [one for one in map(consumer.accept, epochs) if one is not None]
    if len(taken) < can_bus.LEAST_EPOCHS:
        return f"only {len(taken)} epochs with a valid pose", []
    worst_s, complaint = ages(taken, stamps_s)
    jumps, complaint = (0, complaint) if complaint else steps(taken)
    for check in (silences, blind_times, ends, starts):
        complaint = complaint or check(consumer, epochs, happened)
    if complaint:
        return complaint, []
    origins = len({one.origin for one in taken})
    return None, [f"{len(epochs)} epochs, {len(taken)} poses accepted of {origins} origins, age off by at most "
                  f"{1e3 * worst_s:.1f} ms, largest step {jumps:.2f} of what the speed allows"]


def ages(taken, stamps_s):
    """No accepted pose is older than it says: there is an image of that time."""
    worst_s = 0.0
    for one in taken:
        error_s = min(abs(stamp_s - one.taken_s) for stamp_s in stamps_s)
        if error_s > AGE_ERROR_S:
            return 0.0, f"the age is wrong at {one.time_s:.3f}: no image {1e3 * error_s:.0f} ms around its time"
        worst_s = max(worst_s, error_s)
    return worst_s, None


def steps(taken):
    """Within one origin nothing moves faster than its speed; (largest share of what is allowed, complaint)."""
    speed_m_s = sorted(one.speed_m_s for one in taken)[int(0.99 * len(taken))]
    rate_deg_s = sorted(one.yaw_rate_deg_s for one in taken)[int(0.99 * len(taken))]
    worst = 0.0
    for before, after in zip(taken, taken[1:]):
        if before.origin != after.origin or before.place is None or after.place is None:
            continue
        past_s = after.time_s - before.time_s
        moved_m = math.dist(before.place, after.place)
        turned_deg = abs(math.remainder(after.heading_deg - before.heading_deg, 360.0))
        share = max(moved_m / (0.05 + 2.0 * speed_m_s * (past_s + PERIOD_S)),
                    turned_deg / (0.5 + 2.0 * rate_deg_s * (past_s + PERIOD_S)))
        if share > 1.0:
            return 0.0, (f"another origin unnoticed at {after.time_s:.3f}: a step of {moved_m:.2f} m and "
                         f"{turned_deg:.1f} deg in {past_s:.2f} s")
        worst = max(worst, share)
    return worst, None


def silences(consumer, epochs, happened):
    """No epoch while no daemon runs, and else no gap in which a receiver times out, except while output is held."""
    del consumer
    silent = happened["silent"]
    for begin_s, end_s in silent:
        for epoch in epochs:
            if begin_s + ENDING_S < epoch.time_s < end_s:
                return f"an epoch at {epoch.time_s:.3f}, where no daemon runs"
    for before, after in zip(epochs, epochs[1:]):
        excused = any(begin_s - TIMEOUT_S < after.time_s and before.time_s < end_s + TIMEOUT_S
                      for begin_s, end_s in (*silent, *happened["held"]))
        if after.time_s - before.time_s > TIMEOUT_S and not excused:
            return f"no epoch for {after.time_s - before.time_s:.2f} s at {before.time_s:.3f}"
    return None


def blind_times(consumer, epochs, happened):
    for begin_s, end_s in happened["blind"]:
        for epoch in epochs:
            if begin_s + BLIND_AFTER_S < epoch.time_s < end_s and consumer.signal(epoch, "PoseValid"):
                return f"a valid pose at {epoch.time_s:.3f}, {epoch.time_s - begin_s:.2f} s after the last image"
    return None


def ends(consumer, epochs, happened):
    """The last epoch before an orderly end says that it is one."""
    for (at_s,) in happened["stopped"]:
        last = [epoch for epoch in epochs if epoch.time_s < at_s][-1]
        if consumer.signal(last, "State") != STOPPED:
            return f"the last epoch before the end at {at_s:.3f} has state {consumer.signal(last, 'State'):.0f}"
    return None


def starts(consumer, epochs, happened):
    """Each start counts up."""
    for (at_s,) in happened["started"]:
        before = [epoch for epoch in epochs if epoch.time_s < at_s][-1]
        after = next(epoch for epoch in epochs if epoch.time_s > at_s)
        one, other = (consumer.signal(epoch, "BootCounter") for epoch in (before, after))
        if other != one % 255 + 1:
            return f"boot counter {other:.0f} after the start at {at_s:.3f}, {one:.0f} before"
    return None
