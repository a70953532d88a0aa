"""The settings of performers, in the section ``/ros2/performers/NAME`` of a configuration.

A performer executes the actions that other nodes request, with the skills of an agent on the skill board.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import ConfigError
from cxbridge_ros2.hub.performer import PerformedActionSettings, PerformerSettings
from cxbridge_ros2.hub.protocol import HubProtocol
from cxbridge_ros2.plansys2 import PROTOCOL as PLANSYS2
from cxbridge_ros2.settings import (
    NODE_KEYS,
    NodeSettings,
    check_choice,
    check_keys,
    locate_errors,
    nest_settings,
    read_section,
    settings_by_name,
    typed_setting,
)
from cxbridge_ros2.skill_execution import PROTOCOL as SKILL_EXECUTION

if TYPE_CHECKING:
    from cxbridge.config import Configuration

SECTION: Final = "/ros2/performers"

PROTOCOLS: Final[Mapping[str, HubProtocol]] = {
    protocol.name: protocol for protocol in (PLANSYS2, SKILL_EXECUTION)
}

_KEYS: Final = ("protocol", "agent", "name", "actions", *NODE_KEYS)


def read_performer_settings(
    config: Configuration, agents: Sequence[str], folder: Path
) -> dict[str, PerformerSettings]:
    """Return the settings of the configured performers by NAME.

    :param agents: the names of the skill board's agents.
    :param folder: the base of relative paths.
    :raises CxbridgeError: if a setting is invalid; the error has the file and line.
    """
    performers = {}
    for key in config.keys(SECTION):
        section = f"{SECTION}/{key}"
        with locate_errors(config, section):
            values = nest_settings(read_section(config, section))
            performers[key] = _parse_performer(f"the performer {key}", values, agents, folder)
    return performers


def _parse_performer(
    subject: str, values: Mapping[str, Any], agents: Sequence[str], folder: Path
) -> PerformerSettings:
    check_keys(values, _KEYS, subject)
    protocol = typed_setting(values, "protocol", "", subject)
    check_choice(protocol, PROTOCOLS, f"{subject} has the unknown protocol '{protocol}'")
    # the only agent of a skill board is the default
    agent = str(values.get("agent", agents[0] if len(agents) == 1 else ""))
    problem = f"serves the unknown agent '{agent}'" if agent else "must name an agent"
    check_choice(agent, agents, f"{subject} {problem}")
    actions = settings_by_name(values.get("actions", []))
    if not actions:
        raise ConfigError(f"{subject} has no actions", hint="write actions: [move]")
    return PerformerSettings(
        protocol=PROTOCOLS[protocol],
        agent=agent,
        name=str(values.get("name", f"cxbridge_{agent}")),
        actions=tuple(PerformedActionSettings.parse(name, settings) for name, settings in actions.items()),
        node=NodeSettings.parse(values, folder, subject),
    )
