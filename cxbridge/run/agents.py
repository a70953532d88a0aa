"""The agents of a scenario and their configurations; the clock and the main loop of a run."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from cxbridge.clock import Clock, make_clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import EventBus
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.mainloop import MainLoop
from cxbridge.plugins import Table, package_hint
from cxbridge.process.loop_times import LoopTimes

AGENTS = "/cxbridge/agents"
"""Where the agents of a scenario are configured, by name; without it there is one that needs no name."""

AGENT_NAME = "/fawkes/agent/name"
"""Where an agent of several finds its name: rules have it as the wm-fact /config/agent/name."""

_NAME = re.compile(r"[A-Za-z0-9_-]+")
_KEYS = ("config", "spec")


CLOCKS: Final[Table[Callable[[Configuration, Path], Clock]]] = Table(
    "CLOCKS", callable, "a function that makes a clock from a configuration and its folder"
)
"""The clocks of plug-ins, by the names that --clock has."""


def clock_of(name: str, config: Configuration, folder: Path) -> Clock:
    """Make a clock: ``virtual``, ``real``, ``scaled:N``, or a clock of a plug-in.

    :param config: has the settings of clocks of plug-ins.
    :param folder: what relative folders of the configuration are seen from.
    :raises CxbridgeError: when the name is none of these, or the configuration is wrong.
    """
    row = next((row for row in CLOCKS.rows if row.name == name), None)
    if row is not None:
        return CLOCKS.load(row)(config, folder)
    if hint := package_hint(name):
        raise ConfigError(f"unknown clock '{name}'", hint=hint)
    return make_clock(name)


def make_main_loop(period_us: int, bus: EventBus) -> MainLoop:
    """Make the main loop; on a clock that is not virtual the loop reports its durations.

    :param period_us: the desired duration of a loop, in microseconds.
    """
    loop = MainLoop(bus.clock, period_us)
    if not bus.clock.is_virtual:
        LoopTimes(loop, bus)
    return loop


def agent_names(config: Configuration) -> list[str]:
    """Return the names of the agents of a scenario; none when it has just one without a name.

    :raises ConfigError: when the configuration of agents is wrong.
    """
    names = config.keys(AGENTS)
    if _is_value(config, AGENTS):
        raise config.error(AGENTS, f"{AGENTS} must be a map", "write agents: {robot1: {}, robot2: {}}")
    for name in names:
        path = f"{AGENTS}/{name}"
        if not _NAME.fullmatch(name) or name == ENVIRONMENT:
            hint = f"use letters, digits, _ and -; not '{ENVIRONMENT}', which is who has no name"
            raise config.error(path, f"{path} is not a name of an agent", hint)
        if _is_value(config, path):
            raise config.error(path, f"{path} must be a map", f"with: {', '.join(_KEYS)}")
        for key in config.keys(path):
            if key not in _KEYS:
                message = f"{path}/{key} means nothing"
                raise config.error(f"{path}/{key}", message, f"use: {', '.join(_KEYS)}")
        below = f"{path}/config"
        if _is_value(config, below):
            raise config.error(
                below, f"{below} must be a map", "it is laid over the configuration for this agent"
            )
    return names


def choose_agent(config: Configuration, name: str) -> Configuration:
    """Return an agent's own configuration.

    :raises CxbridgeError: when there is no such agent.
    """
    names = agent_names(config)
    if name not in names:
        hint = f"it has: {', '.join(names)}" if names else f"it has no {AGENTS[1:]}"
        raise CxbridgeError(f"the scenario has no agent '{name}'", hint=hint)
    own = Configuration()
    own.overlay(config)
    own.overlay(config.below(f"{AGENTS}/{name}/config"))
    if not own.exists(AGENT_NAME):
        own.set(AGENT_NAME, name)
    spec = config.get_str(f"{AGENTS}/{name}/spec", default="")
    if spec:
        own.set("/clips-executive/spec", spec)
    return own


def _is_value(config: Configuration, path: str) -> bool:
    """Whether there is something that is not a map; nothing at all may stand for an empty one."""
    return config.exists(path) and (config.is_list(path) or bool(config.get(path).text))
