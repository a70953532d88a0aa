"""Checks the names in a world against its scenario; errors have file and line."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from typing import Final

from cxbridge.blackboard import parse_uid
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.run.agent import Run
from cxbridge.run.skillers import skiller_settings
from cxbridge.run.team import Team
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.worldmodel.model import SensedValue, WorldModel, WorldPlace

_SKILL: Final = re.compile(r"\w+")


def check_world(world: WorldModel, run: Run | Team) -> None:
    """Check the names in a world against the scenario of a run."""
    names = [agent.name for agent in run.agents] if isinstance(run, Team) else []
    check_world_of(world, list(run.agents), names)


def check_world_of(
    world: WorldModel, agents: Iterable[Run], names: Collection[str], *, as_written: bool = False
) -> None:
    """Check the names in a world against a scenario.

    :param names: the names of the agents; empty for a single agent.
    :param as_written: read the skills of executors from text, without importing them.
    """
    for agent in agents:
        _check_agent(world, agent, known_skills(agent, as_written=as_written))
    for kill in world.kills if names else ():
        _must_be_known("agent", kill.agent, (*names, "*"), kill.place)
    if not names and (world.kills or world.order):
        position = world.kills[0].place if world.kills else WorldPlace()
        change = "kill one" if world.kills else "let them take turns in another order"
        hint = "see docs/several-agents.md"
        raise _error(position, f"the scenario has one agent: the world cannot {change}", hint)


def _check_agent(world: WorldModel, agent: Run, skills: Collection[str]) -> None:
    for skill in world.skills:
        if skills:
            _must_be_known("skill", skill.pattern.name, (*skills, "*"), skill.place)
    for sensed in world.sensed:
        _check_sensed(sensed, agent)
        for name in sensed.after if skills else ():
            _must_be_known("skill", name, skills, sensed.place)
    for message in world.messages:
        _check_interface(message.uid, agent, message.place)
    for absence in world.absences:
        _must_be_known("Skiller or executor", absence.name, _executing(agent), absence.place)


def known_skills(agent: Run, *, as_written: bool) -> set[str]:
    """Return the skills in action mappings and of executors on the skill board.

    :param as_written: see :func:`check_world_of`.
    :returns: empty if an executor computes its skills and only its text is read.
    """
    skill_names = {
        name.group()
        for item in agent.config.search("/clips-executive/specs")
        if "/action-mapping/" in item.path and not item.is_list and (name := _SKILL.match(item.text))
    }
    board = agent.skill_board
    for each in () if board is None else board.agents:
        for executor in each.executors:
            skills = executor.written_skills() if as_written else executor.skills()
            if skills is None:
                return set()
            skill_names.update(skills)
    return skill_names


def _executing(agent: Run) -> set[str]:
    """Return the names of the local Skillers and of the executors on the skill board."""
    board = agent.skill_board
    served = frozenset[str]() if board is None else board.skillers
    executors = {item.name for item in skiller_settings(agent.config, "simulator", served)}
    for each in () if board is None else board.agents:
        executors.update(executor.name for executor in each.executors)
    return executors


def _must_be_known(kind: str, name: str, known: Collection[str], position: WorldPlace) -> None:
    if name not in known:
        otherwise = f"there are: {', '.join(sorted(set(known) - {'*'}))}"
        raise _error(position, f"there is no {kind} '{name}'", did_you_mean(name, known, otherwise))


def _check_interface(uid: str, agent: Run, position: WorldPlace) -> None:
    try:
        agent.registry.get(parse_uid(uid)[0])
    except (CxbridgeError, ValueError) as error:
        message = error.message if isinstance(error, CxbridgeError) else f"'{uid}' is no TYPE::ID"
        hint = error.hint if isinstance(error, CxbridgeError) else "e.g. BatteryInterface::Robot"
        raise _error(position, message, hint) from None


def _check_sensed(sensed: SensedValue, agent: Run) -> None:
    _check_interface(sensed.uid, agent, sensed.place)
    kind = parse_uid(sensed.uid)[0]
    fields = [field.name for field in agent.registry.schema(kind).fields]
    _must_be_known(f"field of {kind}", sensed.name, fields, sensed.place)


def _error(position: WorldPlace, message: str, hint: str | None) -> ConfigError:
    return ConfigError(message, file=position.file, line=position.line, hint=hint)
