"""Skillers of a run or daemon."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import get_args

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.skiller.backend import DEFAULT_SKILLER, INSTANCES, Mode, SkillerBackend

KINDS = ("lua", "simulator")
"""The kinds of Skillers in this process."""

_SPACE = "/skiller/skillspace"
_KEYS = ("kind", "skillspace", "mode")


class SkillerSettings(Struct, frozen=True):
    """The settings of a Skiller.

    :param name: the id of its interfaces.
    :param kind: one of :data:`KINDS`.
    :param space: the skill space; None: as configured for all Skillers.
    :param mode: whether the Skiller imitates Fawkes' oddities.
    """

    name: str
    kind: str
    space: str | None
    mode: Mode


def skiller_mode(config: Configuration, path: str = "/skiller/mode", default: Mode = "strict") -> Mode:
    """Return whether Skillers and action mappings imitate Fawkes' oddities.

    :raises ConfigError: unless the value is a mode.
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
    """Return the settings of the Skillers: those of :data:`INSTANCES`, or of one default Skiller.

    :param kind: the default kind.
    :param served: Skillers that another component makes.
    :raises ConfigError: if an instance is invalid.
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

    :param skillers: the Skillers in the order of their steps.
    """

    def __init__(self, skillers: Sequence[SkillerBackend]) -> None:
        super().__init__(", ".join(skiller.name for skiller in skillers))
        self.skillers = tuple(skillers)

    @property
    def known_by_name(self) -> dict[str, frozenset[str] | None]:
        """The skills of each Skiller by name; None: unknown."""
        return {skiller.name: skiller.known_skills for skiller in self.skillers}

    @property
    def running(self) -> bool:
        return any(skiller.running for skiller in self.skillers)

    @property
    def is_quiet(self) -> bool:
        return all(skiller.is_quiet for skiller in self.skillers)

    def loop(self) -> None:
        for skiller in self.skillers:
            skiller.loop()

    def close(self) -> None:
        """Close the Skillers, last to first."""
        for skiller in reversed(self.skillers):
            skiller.close()
