"""The settings of the thesis' executive: the tree ``ros2cx:`` of a configuration.

docs/evidence/ros2cx.md lists the defects of ros2-clips-executive (2021) and the settings.
"""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from cxbridge.config import Configuration

TREE = "/ros2cx"  # path of the settings
_KEYS = ("mode", "removal-blocks", "unsensed")


class Ros2CxMode(StrEnum):
    """How to treat the defects of the thesis' executive, ros2-clips-executive (2021)."""

    SANE = "sane"  # avoid the defects
    ORIGINAL = "original"  # repeat the defects, so that recorded runs can be compared


class Ros2CxSettings(Struct, frozen=True):
    """Settings of a run with ``--ros2cx``.

    :param removal_block_times_s: how long the removal of the first, second ... ended skill blocks the
        executive. The thesis' executive blocks for a random time between 0 and 2 s. Only the mode
        ``original`` allows these times.
    :param unsensed_executors: names of executors whose effects have no sensor. When such an executor
        succeeds, the effects of its action are asserted in place of a sensor's report, as for dummies.
    """

    mode: Ros2CxMode = Ros2CxMode.SANE
    removal_block_times_s: tuple[float, ...] = ()
    unsensed_executors: tuple[str, ...] = ()

    @property
    def repeats_defects(self) -> bool:
        return self.mode is Ros2CxMode.ORIGINAL

    @classmethod
    def from_config(cls, config: Configuration) -> Ros2CxSettings:
        """Read the settings.

        :raises ConfigError: if a key or mode is unknown.
        """
        for key in config.keys(TREE):
            if key not in _KEYS:
                hint = f"the keys are {', '.join(_KEYS)}"
                raise config.error(f"{TREE}/{key}", f"there is no {TREE[1:]}/{key}", hint)
        mode_name = config.get_str(f"{TREE}/mode", default=str(Ros2CxMode.SANE))
        try:
            mode = Ros2CxMode(mode_name)
        except ValueError:
            hint = f"the modes are {', '.join(Ros2CxMode)}"
            raise config.error(f"{TREE}/mode", f"{TREE[1:]}/mode cannot be '{mode_name}'", hint) from None
        block_times_s = tuple(config.get_floats(f"{TREE}/removal-blocks", default=[]))
        if block_times_s and mode is not Ros2CxMode.ORIGINAL:
            # in the mode sane, removals do not block: the times would have no effect
            message = "removal-blocks requires mode: original"
            raise config.error(f"{TREE}/removal-blocks", message, "write mode: original")
        return cls(mode, block_times_s, tuple(config.get_strings(f"{TREE}/unsensed", default=[])))
