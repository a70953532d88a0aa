"""The settings of the thesis' executive, ros2-clips-executive (2021): the tree ``ros2cx:``.

docs/evidence/ros2cx.md lists the defects of that executive and the settings.
"""

from __future__ import annotations

from msgspec import Struct

from cxbridge.config import Configuration

TREE = "/ros2cx"  # path of the settings
_KEYS = ("mode", "removal-blocks", "unsensed")
_SANE, _ORIGINAL = "sane", "original"  # modes


class Ros2CxSettings(Struct, frozen=True):
    """Settings of a run with ``--ros2cx``.

    :param repeats_defects: whether to repeat the defects of the thesis' executive, so that recorded runs can
        be compared: the mode ``original``. Otherwise the mode is ``sane``.
    :param removal_block_times_s: how long the removal of the first, second ... ended skill blocks the
        executive. The thesis' executive blocks for a random time between 0 and 2 s. Only the mode
        ``original`` allows these times.
    :param unsensed_executors: names of executors whose effects have no sensor. When such an executor
        succeeds, the effects of its action are asserted in place of a sensor's report, as for dummies.
    """

    repeats_defects: bool = False
    removal_block_times_s: tuple[float, ...] = ()
    unsensed_executors: tuple[str, ...] = ()

    @classmethod
    def from_config(cls, config: Configuration) -> Ros2CxSettings:
        """Read the settings.

        :raises ConfigError: if a key or mode is unknown, a value has the wrong type, or ``removal-blocks`` is
            set without the mode ``original``.
        """
        for key in config.keys(TREE):
            if key not in _KEYS:
                raise config.error(
                    f"{TREE}/{key}", f"there is no {TREE[1:]}/{key}", f"the keys are {', '.join(_KEYS)}"
                )
        mode = config.get_str(f"{TREE}/mode", default=_SANE)
        if mode not in (_SANE, _ORIGINAL):
            raise config.error(
                f"{TREE}/mode", f"{TREE[1:]}/mode cannot be '{mode}'", f"the modes are {_SANE}, {_ORIGINAL}"
            )
        block_times_s = tuple(config.get_floats(f"{TREE}/removal-blocks", default=[]))
        if block_times_s and mode != _ORIGINAL:
            # in the mode sane, removals do not block: the times would have no effect
            raise config.error(
                f"{TREE}/removal-blocks", "removal-blocks requires mode: original", "write mode: original"
            )
        return cls(
            mode == _ORIGINAL, block_times_s, tuple(config.get_strings(f"{TREE}/unsensed", default=[]))
        )
