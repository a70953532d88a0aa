"""Finds skills that do not load, and mappings to skills that there are not."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from typing import Final

from cxbridge.check.agent import Agent, place_of
from cxbridge.check.findings import Code, Finding, Severity, of_error
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import action_mapping
from cxbridge.run.skillers import skiller_settings
from cxbridge.skiller.lua.limits import limits_of
from cxbridge.skiller.make import make_lua_skiller, skills_see_navgraph

BROKEN: Final = Code(
    "CX411",
    Severity.ERROR,
    "a skill does not load",
    "A Lua file of the skill space has a mistake, or an executor in Python does not load: the "
    "Skiller does not start.",
)
UNKNOWN: Final = Code(
    "CX412",
    Severity.ERROR,
    "a mapping names a skill that there is not",
    "Neither the skill space nor an executor has the skill: the action fails.",
)

CODES: Final = (BROKEN, UNKNOWN)

_NAME = re.compile(r"\s*([A-Za-z_][\w-]*)\s*[{(]")


def check(agent: Agent) -> Iterator[Finding]:
    """Yield what is wrong with the skills."""
    try:
        skills = _skills(agent)
    except CxbridgeError as error:
        yield of_error(error, BROKEN)
        return
    if skills is None:
        return
    base = f"/clips-executive/specs/{agent.spec}/action-mapping"
    for action, template in action_mapping(agent.config, agent.spec).items():
        match = _NAME.match(template)
        if match is None or match[1] in skills or not agent.config.exists(f"{base}/{action}"):
            continue
        close = difflib.get_close_matches(match[1], sorted(skills), 1)
        hint = f"did you mean {close[0]}?" if close else f"there are: {', '.join(sorted(skills))}"
        place = place_of(agent.config.get(f"{base}/{action}"))
        yield Finding(
            UNKNOWN, place, f"'{action}' is mapped to the skill '{match[1]}', which there is not", hint
        )


def _skills(agent: Agent) -> set[str] | None:
    """Return the skills that the agent can use; None when somebody elsewhere has them.

    :raises CxbridgeError: when one does not load.
    """
    context = agent.context
    if agent.options.skiller != "lua" or context.paths.ros2cx is not None:
        return None
    board = context.skill_board
    if board is not None and not board.in_process:
        return None
    found: set[str] = set()
    for member in () if board is None else board.agents:
        for executor in member.executors:
            found.update(executor.load().skills)
    for item in skiller_settings(context.config, "lua", () if board is None else board.skillers):
        if item.kind != "lua":
            return None
        sees = skills_see_navgraph(context.config)
        with make_lua_skiller(
            context.board,
            context.clock,
            context.bus,
            folders=context.paths.skill_dirs,
            config=context.config,
            space=item.space,
            name=item.name,
            mode=item.mode,
            limits=limits_of(context.config),
            navgraph=context.navgraph.get(context.config, context.paths, context.bus) if sees else None,
        ) as skiller:
            found.update(skiller.skills)
    return found
