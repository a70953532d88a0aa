"""The Skillers of a run or a daemon: one, or several by name."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import get_args

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.skiller.backend import DEFAULT_SKILLER, INSTANCES, Mode, SkillerBackend

KINDS = ("lua", "simulator")
"""The Skillers of this process."""

_SPACE = "/skiller/skillspace"
_KEYS = ("kind", "skillspace", "mode")


class SkillerSettings(Struct, frozen=True):
    """The settings of one Skiller.

    :param name: id of its interfaces.
    :param kind: one of :data:`KINDS`.
    :param space: its skill space; None: the configuration's.
    :param mode: what to do where Fawkes is odd.
    """

    name: str
    kind: str
    space: str | None
    mode: Mode


def skiller_mode(config: Configuration, path: str = "/skiller/mode", default: Mode = "strict") -> Mode:
    """Return what to do where Fawkes is odd, in Skillers and in action mappings.

    :raises ConfigError: when it is none of the modes.
    """
    value = config.get_str(path, default=default)
    modes: tuple[Mode, ...] = get_args(Mode)
    for mode in modes:
        if value == mode:
            return mode
    raise config.error(path, f"{path} cannot be '{value}'", f"one of: {', '.join(modes)}")


def skiller_settings(
    config: Configuration, kind: str, served: Collection[str] = ()
) -> tuple[SkillerSettings, ...]:
    """Return the Skillers to make: those of :data:`INSTANCES`, else the one.

    :param kind: of those that do not say theirs.
    :param served: the names of those that another component makes.
    :raises ConfigError: when an instance is invalid.
    """
    mode = skiller_mode(config)
    names = config.keys(INSTANCES)
    for name in names:
        for key in config.keys(f"{INSTANCES}/{name}"):
            if key not in _KEYS:
                place = f"{INSTANCES}/{name}/{key}"
                raise config.error(place, f"{place} means nothing", f"use: {', '.join(_KEYS)}")
    settings = [_read(config, name, kind, mode) for name in names]
    settings = settings or [SkillerSettings(DEFAULT_SKILLER, kind, None, mode)]
    return tuple(item for item in settings if item.name not in served)


def _read(config: Configuration, name: str, kind: str, mode: Mode) -> SkillerSettings:
    path = f"{INSTANCES}/{name}"
    own = config.get_str(f"{path}/kind", default=kind)
    if own not in KINDS:
        message = f"{path}/kind is '{own}'"
        raise config.error(f"{path}/kind", message, f"one of: {', '.join(KINDS)}")
    space = config.get_str(f"{path}/skillspace", default="") or None
    return SkillerSettings(name, own, space, skiller_mode(config, f"{path}/mode", mode))


class SkillerGroup(SkillerBackend):
    """Several Skillers as one component.

    :param skillers: they take their steps in this order.
    """

    def __init__(self, skillers: Sequence[SkillerBackend]) -> None:
        super().__init__(", ".join(skiller.name for skiller in skillers))
        self.skillers = tuple(skillers)

    @property
    def known_by_name(self) -> dict[str, frozenset[str] | None]:
        """The skills of each, by its name; None: unknown."""
        return {skiller.name: skiller.known_skills for skiller in self.skillers}

    @property
    def running(self) -> bool:
        """Whether any of them executes a skill string."""
        return any(skiller.running for skiller in self.skillers)

    @property
    def is_quiet(self) -> bool:
        """Whether all of them are."""
        return all(skiller.is_quiet for skiller in self.skillers)

    def loop(self) -> None:
        """Let each take its step."""
        for skiller in self.skillers:
            skiller.loop()

    def close(self) -> None:
        """Close them, last to first."""
        for skiller in reversed(self.skillers):
            skiller.close()
