"""The settings of the ROS 2 executive: the tree ``ros2cx:`` (docs/evidence/ros2cx.md)."""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from cxbridge.config import Configuration

TREE = "/ros2cx"
_KEYS = ("mode", "removal-blocks", "unsensed")


class Ros2CxMode(StrEnum):
    """What to do where the original, ros2-clips-executive (2021), has a defect."""

    SANE = "sane"
    ORIGINAL = "original"


class Ros2CxSettings(Struct, frozen=True):
    """Settings of a run with ``--ros2cx``.

    :param mode: whether the original's defects are repeated.
    :param removal_blocks: seconds for which the removal of the first, second ... ended skill blocks the
        executive. In the original it is a random time between 0 and 2 s. Only the mode ``original`` allows
        them.
    :param unsensed: executors whose effects have no sensor. When they succeed, the effects of the action are
        asserted in place of a sensor's report, as for dummies.
    """

    mode: Ros2CxMode = Ros2CxMode.SANE
    removal_blocks: tuple[float, ...] = ()
    unsensed: tuple[str, ...] = ()

    @property
    def original(self) -> bool:
        return self.mode is Ros2CxMode.ORIGINAL

    @classmethod
    def of(cls, config: Configuration) -> Ros2CxSettings:
        """Read the settings.

        :raises ConfigError: if a key or mode is unknown.
        """
        for key in config.keys(TREE):
            if key not in _KEYS:
                hint = f"the keys are {', '.join(_KEYS)}"
                raise config.error(f"{TREE}/{key}", f"there is no {TREE[1:]}/{key}", hint)
        text = config.get_str(f"{TREE}/mode", default=str(Ros2CxMode.SANE))
        try:
            mode = Ros2CxMode(text)
        except ValueError:
            hint = f"the modes are {', '.join(Ros2CxMode)}"
            raise config.error(f"{TREE}/mode", f"{TREE[1:]}/mode cannot be '{text}'", hint) from None
        blocks = tuple(config.get_floats(f"{TREE}/removal-blocks", default=[]))
        if blocks and mode is not Ros2CxMode.ORIGINAL:
            # in the mode sane, removals do not block: the times would have no effect
            message = "removal-blocks goes with mode: original only"
            raise config.error(f"{TREE}/removal-blocks", message, "write mode: original")
        return cls(mode, blocks, tuple(config.get_strings(f"{TREE}/unsensed", default=[])))
