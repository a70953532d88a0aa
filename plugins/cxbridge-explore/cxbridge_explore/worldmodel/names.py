"""Checks that a scenario has the skills, interfaces and agents that its world names.

An event with a misspelt name would never occur, and the result of an exploration would look better than the
agent is.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from typing import Final

from cxbridge.blackboard import parse_uid
from cxbridge.config.documents import Mark
from cxbridge.errors import CxbridgeError
from cxbridge.run.agent import Run
from cxbridge.run.skillers import skiller_settings
from cxbridge.run.team import Team
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.worldmodel.model import SensedField, WorldModel
from cxbridge_studio.check.executor_text import read_executor_skills

_SKILL_NAME: Final = re.compile(r"\w+")


def check_world_of_run(world: WorldModel, run: Run | Team) -> None:
    """Check the names in a world against the scenario of a run.

    :raises ConfigError: if the scenario lacks a name, or has a single agent that the world kills.
    """
    agent_names = [agent.name for agent in run.agents] if isinstance(run, Team) else []
    check_world_of_agents(world, list(run.agents), agent_names)


def check_world_of_agents(
    world: WorldModel, agents: Iterable[Run], agent_names: Collection[str], *, reads_source_code: bool = False
) -> None:
    """Check the names in a world against a scenario.

    :param agent_names: the names of the agents; empty for a single agent.
    :param reads_source_code: whether to read the skills of executors from their source code, without
        importing the executors.
    :raises ConfigError: if the scenario lacks a name, or has a single agent that the world kills.
    """
    for agent in agents:
        _check_agent(world, agent, find_known_skills(agent, reads_source_code=reads_source_code))
    for kill in world.kills if agent_names else ():
        _check_name("agent", kill.agent, (*agent_names, "*"), kill.mark)
    if not agent_names and world.kills:
        hint = "see docs/several-agents.md"
        raise world.kills[0].mark.error("the scenario has one agent: the world cannot kill an agent", hint)


def _check_agent(world: WorldModel, agent: Run, skills: Collection[str]) -> None:
    """Check the names of skills, interfaces and Skillers in a world against an agent.

    :param skills: the known skills; empty if they are unknown.
    """
    for skill in world.skills if skills else ():
        _check_name("skill", skill.pattern.name, (*skills, "*"), skill.mark)
    for sensed in world.sensed:
        _check_sensed(sensed, agent)
        for name in sensed.skills if skills else ():
            _check_name("skill", name, skills, sensed.mark)
    for loss in world.message_losses:
        _check_interface(loss.uid, agent, loss.mark)
    for absence in world.absences:
        _check_name("Skiller or executor", absence.name, _find_performers(agent), absence.mark)


def find_known_skills(agent: Run, *, reads_source_code: bool) -> set[str]:
    """Return the names of the skills in action mappings, and of the executors on the skill board.

    :param reads_source_code: see :func:`check_world_of_agents`.
    :returns: an empty set if the skills of an executor are unknown without importing the executor.
    """
    skills = {
        name_match.group()
        for item in agent.config.search("/clips-executive/specs")
        if "/action-mapping/" in item.path
        and not item.is_list
        and (name_match := _SKILL_NAME.match(item.text))
    }
    board = agent.skill_board
    for member in () if board is None else board.agents:
        for executor in member.executors:
            executor_skills = read_executor_skills(executor) if reads_source_code else executor.skills()
            if executor_skills is None:
                return set()
            skills.update(executor_skills)
    return skills


def _find_performers(agent: Run) -> set[str]:
    """Return the names of the local Skillers and of the executors on the skill board."""
    board = agent.skill_board
    served_skillers = frozenset[str]() if board is None else board.skillers
    # The names do not depend on the kind: without configured Skillers, the only one has the default name.
    names = {item.name for item in skiller_settings(agent.config, "simulator", served_skillers)}
    for member in () if board is None else board.agents:
        names.update(executor.name for executor in member.executors)
    return names


def _check_name(noun: str, name: str, known_names: Collection[str], mark: Mark) -> None:
    if name not in known_names:
        hint = did_you_mean(name, known_names, f"use one of: {', '.join(sorted(set(known_names) - {'*'}))}")
        raise mark.error(f"there is no {noun} '{name}'", hint)


def _check_interface(uid: str, agent: Run, mark: Mark) -> None:
    try:
        interface_type, _ = parse_uid(uid)
        agent.registry.get(interface_type)
    except CxbridgeError as error:
        raise mark.error(error.message, error.hint) from None


def _check_sensed(sensed: SensedField, agent: Run) -> None:
    _check_interface(sensed.uid, agent, sensed.mark)
    interface_type, _ = parse_uid(sensed.uid)
    field_names = [field.name for field in agent.registry.schema(interface_type).fields]
    _check_name(f"field of {interface_type}", sensed.field_name, field_names, sensed.mark)
