"""Opens the recordings that the options of a run name, as a replay of their environment."""

from __future__ import annotations

from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import fawkes_interface_dirs
from cxbridge.run.replay.recordings import Recordings
from cxbridge.run.replay.replay import Replay
from cxbridge.trace.compare.checks import Tolerance
from cxbridge.trace.compare.model import Order


def open_replay(options: RunOptions) -> tuple[RunOptions, Replay]:
    """Read the recordings that the options name.

    :returns: the options, with scenario and spec of the recorded run where they name none; the replay.
    :raises CxbridgeError: when they cannot be replayed, or something else is wrong with the options.
    """
    dirs = list(options.interface_dirs)
    if options.fawkes_dir is not None:
        dirs += fawkes_interface_dirs(options.fawkes_dir)
    recordings = Recordings.read(options.replay, InterfaceRegistry(dirs))
    options = recordings.complete(options)
    options.check()
    seconds = options.replay_tolerance
    tolerance = None if seconds is None else Tolerance(seconds)
    return options, Replay(recordings, Order(options.replay_order), tolerance)
