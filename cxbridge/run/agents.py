"""Agents of a scenario, their configuration, clock and main loop."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from cxbridge.clock import Clock, make_clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import EventBus, LoopTime
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.mainloop import Hook, MainLoop
from cxbridge.plugins import Table, package_hint

AGENTS = "/cxbridge/agents"
"""The path of a scenario's agents by name. A scenario without this path has one unnamed agent."""

AGENT_NAME = "/fawkes/agent/name"
"""The path of an agent's name in a team; rules read the name as wm-fact ``/config/agent/name``."""

_VALID_NAME = re.compile(r"[A-Za-z0-9_-]+")
_AGENT_KEYS = ("config", "spec")


CLOCKS: Final[Table[Callable[[Configuration, Path], Clock]]] = Table(
    "CLOCKS", callable, "a function that makes a clock from a configuration and its folder"
)
"""The clocks of plug-ins, by their name for ``--clock``."""


def make_configured_clock(name: str, config: Configuration, folder: Path) -> Clock:
    """Make a clock: ``virtual``, ``real``, ``scaled:N``, or the clock of a plug-in.

    :param config: the settings for clocks of plug-ins.
    :param folder: the base of relative paths in the configuration.
    :raises ConfigError: if the name is unknown or the configuration is wrong.
    :raises PluginError: if the clock of a plug-in cannot be loaded.
    """
    for row in CLOCKS.rows:
        if row.name == name:
            return CLOCKS.load_target(row)(config, folder)
    if hint := package_hint(name):
        raise ConfigError(f"unknown clock '{name}'", hint=hint)
    return make_clock(name)


def make_main_loop(period_us: int, bus: EventBus) -> MainLoop:
    """Make the main loop. On a clock with real pace, the loop reports its durations.

    :param period_us: the target period in microseconds.
    """
    loop = MainLoop(bus.clock, period_us)
    if not bus.clock.is_virtual:
        _report_durations(loop, bus)
    return loop


def _report_durations(loop: MainLoop, bus: EventBus) -> None:
    """Emit :class:`LoopTime` for each cycle while the event has a subscriber."""
    start_ns = 0

    def record_start() -> None:
        nonlocal start_ns
        start_ns = time.perf_counter_ns() if bus.wants(LoopTime) else 0

    def emit_duration() -> None:
        if start_ns:
            bus.emit(
                LoopTime(
                    bus.clock.now_us(),
                    loop=loop.cycle_count + 1,
                    duration_us=(time.perf_counter_ns() - start_ns) // 1000,
                )
            )

    # added before all other steps: the measurement lacks only the other steps of POST_LOOP
    loop.add(Hook.PRE_LOOP, record_start)
    loop.add(Hook.POST_LOOP, emit_duration)


def agent_names(config: Configuration) -> list[str]:
    """Return the agent names of a scenario; empty for a single unnamed agent.

    :raises ConfigError: if the section of agents is malformed.
    """
    names = config.keys(AGENTS)
    for name in names:
        path = f"{AGENTS}/{name}"
        # the name also names the CLIPS environment, and is part of interface ids and file names
        if not _VALID_NAME.fullmatch(name) or name == ENVIRONMENT:
            hint = f"use letters, digits, _ and -; '{ENVIRONMENT}' is the environment of an unnamed agent"
            raise config.error(path, f"{path} is not a valid name of an agent", hint)
        if _is_value(config, path):
            raise config.error(path, f"{path} must be a map", f"with: {', '.join(_AGENT_KEYS)}")
        for key in config.keys(path):
            if key not in _AGENT_KEYS:
                raise config.error(
                    f"{path}/{key}", f"{path}/{key} is unknown", f"use: {', '.join(_AGENT_KEYS)}"
                )
    return names


def choose_agent(config: Configuration, name: str) -> Configuration:
    """Return the configuration of one agent: the scenario's configuration, overlaid with the agent's part.

    :raises CxbridgeError: if the scenario has no such agent, or the section of agents is malformed.
    """
    names = agent_names(config)
    if name not in names:
        hint = f"it has: {', '.join(names)}" if names else f"it has no {AGENTS[1:]}"
        raise CxbridgeError(f"the scenario has no agent '{name}'", hint=hint)
    # a copy: the agents of a team share the scenario's configuration
    agent_config = Configuration()
    agent_config.overlay(config)
    agent_config.overlay(config.below(f"{AGENTS}/{name}/config"))
    if not agent_config.exists(AGENT_NAME):
        agent_config.set(AGENT_NAME, name)
    spec = config.get_str(f"{AGENTS}/{name}/spec", default="")
    if spec:
        agent_config.set("/clips-executive/spec", spec)
    return agent_config


def _is_value(config: Configuration, path: str) -> bool:
    """Return whether a path has a value other than a map; an empty value counts as an empty map."""
    return config.exists(path) and (config.is_list(path) or bool(config.get(path).text))
