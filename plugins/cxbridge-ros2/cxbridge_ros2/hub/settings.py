"""The configuration of performers: ``/ros2/performers/NAME``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.executor import OF_NODE, NodeSettings, nested, typed
from cxbridge_ros2.hub.performer import PerformerSettings, ServedAction
from cxbridge_ros2.hub.words import HubProtocol
from cxbridge_ros2.plansys2 import PlanSys2Protocol
from cxbridge_ros2.skill_execution import SkillExecutionProtocol
from cxbridge_ros2.trees import placed, values_below

if TYPE_CHECKING:
    from cxbridge.config import Configuration

TREE: Final = "/ros2/performers"

PROTOCOLS: Final[Mapping[str, HubProtocol]] = {
    each.name: each for each in (PlanSys2Protocol(), SkillExecutionProtocol())
}

_KNOWN: Final = ("protocol", "agent", "agent-id", "name", "actions", *OF_NODE)


def performer_settings(
    config: Configuration, agents: Sequence[str], folder: Path
) -> dict[str, PerformerSettings]:
    """Return the configured performers by key.

    :param agents: the agents of the skill board.
    :param folder: the base of relative paths.
    :raises CxbridgeError: if a setting is invalid; with file and line.
    """
    settings_of_performers = {}
    for key in config.keys(TREE):
        tree = f"{TREE}/{key}"
        with placed(config, tree):
            settings_of_performers[key] = _performer(key, nested(values_below(config, tree)), agents, folder)
    return settings_of_performers


def _performer(key: str, values: Mapping[str, Any], agents: Sequence[str], folder: Path) -> PerformerSettings:
    whose = f"the performer {key}"
    for name in values:
        if name not in _KNOWN:
            raise ConfigError(f"{whose} has no setting '{name}'", hint=did_you_mean(name, _KNOWN))
    protocol = PROTOCOLS.get(called := typed(values, "protocol", "", whose))
    if protocol is None:
        hint = did_you_mean(called, PROTOCOLS, f"there are: {', '.join(PROTOCOLS)}")
        raise ConfigError(f"{whose} has no protocol '{called}'", hint=hint)
    agent = str(values.get("agent", agents[0] if len(agents) == 1 else ""))
    if agent not in agents:
        problem = f"serves the agent '{agent}', which there is not" if agent else "names no agent"
        hint = did_you_mean(agent, agents, f"the skill board has: {', '.join(agents) or 'none'}")
        raise ConfigError(f"{whose} {problem}", hint=hint)
    if "agent-id" in values and not protocol.has_agents:
        raise ConfigError(f"{whose} has no setting 'agent-id': messages of {called} name no robot")
    actions = values.get("actions", [])
    if not isinstance(actions, Mapping):
        actions = {str(each): {} for each in (actions if isinstance(actions, list) else [actions])}
    if not actions:
        raise ConfigError(f"{whose} has no actions", hint="name them: actions: [move]")
    return PerformerSettings(
        protocol=protocol,
        agent=agent,
        agent_id=str(values.get("agent-id", "")),
        name=str(values.get("name", f"cxbridge_{agent}")),
        actions=tuple(ServedAction.of(name, value, protocol) for name, value in actions.items()),
        node=NodeSettings.of(values, folder, whose),
    )
