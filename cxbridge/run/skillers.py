"""The settings of the Skillers of a run or daemon, and the deciders of plug-ins for simulated Skillers.

A decider chooses the duration and the outcome of a simulated skill.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any, Final, get_args

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.plugins import Table
from cxbridge.skiller.backend import DEFAULT_SKILLER, INSTANCES, Mode

if TYPE_CHECKING:
    from cxbridge.skiller.simulation.deciders import Decider

KINDS = ("lua", "simulator")
"""The kinds of Skillers in this process."""

_INSTANCE_KEYS = ("kind", "skillspace", "mode")


class SkillerSettings(Struct, frozen=True):
    """The settings of a Skiller.

    :param name: the id of its interfaces.
    :param kind: one of :data:`KINDS`.
    :param space: the skill space; None: the skill space of all Skillers.
    :param mode: decides whether the Skiller imitates Fawkes' oddities.
    """

    name: str
    kind: str
    space: str | None
    mode: Mode


def skiller_mode(config: Configuration, path: str = "/skiller/mode", default: Mode = "strict") -> Mode:
    """Return the mode, which decides whether Skillers and action mappings imitate Fawkes' oddities.

    :raises ConfigError: unless the value is a mode.
    """
    value = config.get_str(path, default=default)
    modes: tuple[Mode, ...] = get_args(Mode)
    for mode in modes:
        if value == mode:
            return mode
    raise config.error(path, f"{path} cannot be '{value}'", f"one of: {', '.join(modes)}")


def skiller_settings(
    config: Configuration, kind: str, made_elsewhere: Collection[str] = ()
) -> tuple[SkillerSettings, ...]:
    """Return the settings of the Skillers in :data:`INSTANCES`; without instances, of one default Skiller.

    :param kind: the default kind.
    :param made_elsewhere: the names of Skillers that another component makes; they are left out.
    :raises ConfigError: if the mode or an instance is invalid.
    """
    mode = skiller_mode(config)
    names = config.keys(INSTANCES)
    for name in names:
        for key in config.keys(f"{INSTANCES}/{name}"):
            if key not in _INSTANCE_KEYS:
                path = f"{INSTANCES}/{name}/{key}"
                raise config.error(path, f"{path} is unknown", f"use: {', '.join(_INSTANCE_KEYS)}")
    skillers = [_read_settings(config, name, kind, mode) for name in names]
    skillers = skillers or [SkillerSettings(DEFAULT_SKILLER, kind, None, mode)]
    return tuple(settings for settings in skillers if settings.name not in made_elsewhere)


def _read_settings(
    config: Configuration, name: str, default_kind: str, default_mode: Mode
) -> SkillerSettings:
    path = f"{INSTANCES}/{name}"
    kind = config.get_str(f"{path}/kind", default=default_kind)
    if kind not in KINDS:
        raise config.error(f"{path}/kind", f"{path}/kind cannot be '{kind}'", f"one of: {', '.join(KINDS)}")
    return SkillerSettings(
        name,
        kind,
        config.get_str(f"{path}/skillspace", default="") or None,
        skiller_mode(config, f"{path}/mode", default_mode),
    )


DECIDERS: Final[Table[Callable[[Any, str], Decider]]] = Table(
    "DECIDERS",
    callable,
    "a function that makes a decider from the context of a run and the name of a Skiller or an agent",
)
"""The deciders of plug-ins for simulated skills. ``make_simulator`` makes the deciders of cxbridge."""


def make_deciders(context: Any, skiller: str) -> list[Decider]:
    """Return the plug-ins' deciders for a simulated Skiller, or for an agent on the skill board.

    :param context: the run.
    """
    return [DECIDERS.load_target(row)(context, skiller) for row in DECIDERS.rows if row.needed(context)]
