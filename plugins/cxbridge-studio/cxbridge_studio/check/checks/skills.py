"""Checks of skills and their executors, of Lua files in skill folders, and of mappings to skills.

A skill is a Lua file in the agent's skill space, or belongs to an executor of the skill board: a Python
class, or an action or service of ROS 2.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import CxbridgeError
from cxbridge.file_access import why_unreadable
from cxbridge.lua_syntax import LuaCompiler
from cxbridge.run.skillers import skiller_settings
from cxbridge.skiller.make import DEFAULT_SPACE, SKILL_SPACE
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.lua import read_lua
from cxbridge_studio.agent.names import NameKind
from cxbridge_studio.check.agent import Agent, place_of
from cxbridge_studio.check.executor_text import read_executor_skills
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace, make_error_finding
from cxbridge_studio.check.lua_skills import find_load_mistakes, find_unknown_methods
from cxbridge_studio.check.skill_spaces import find_space_skills

BROKEN_SKILL: Final = Code(
    "CX411",
    Severity.ERROR,
    "a skill does not load",
    "A Lua file of the skill space has a mistake, or an executor in Python does not load: the "
    "Skiller does not start.",
)
UNKNOWN_SKILL: Final = Code(
    "CX412",
    Severity.ERROR,
    "a mapping names a skill that does not exist",
    "Neither the skill space nor an executor provides the skill: the action fails.",
)

UNKNOWN_ARGUMENT: Final = Code(
    "CX413",
    Severity.WARNING,
    "an unknown argument of a skill",
    "The mapping gives the skill an argument that is neither in its documentation (@param) nor anywhere in "
    "its text: the skill never reads the argument.",
)

UNKNOWN_ROS_NAME: Final = Code(
    "CX415",
    Severity.ERROR,
    "a skill of ROS 2 names an unknown type or field",
    "There is no such action or service, or its messages have no such field: the executor does not start, or "
    "reports no progress and no reason.",
)
UNCOMPILED_FILE: Final = Code(
    "CX414",
    Severity.WARNING,
    "a Lua file does not compile",
    "The file is in a folder of skills. A skill space that loads the file does not start.",
)
UNKNOWN_METHOD: Final = Code(
    "CX416",
    Severity.ERROR,
    "a skill calls a method that its interface lacks",
    "The interface has no field, message or method of this name: the skill fails when it comes to the call.",
)

CODES: Final = (
    UNKNOWN_ROS_NAME,
    BROKEN_SKILL,
    UNKNOWN_SKILL,
    UNKNOWN_ARGUMENT,
    UNCOMPILED_FILE,
    UNKNOWN_METHOD,
)

# The parts of a skill string such as goto{place="?(to)S"}: the arguments and the name.
_SKILL_ARGUMENT = re.compile(r"[{,]\s*([A-Za-z_]\w*)\s*=")
_SKILL_NAME = re.compile(r"\s*([A-Za-z_][\w-]*)\s*[{(]")


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the mistakes in skills and mappings; none if the skills are unknown before a run."""
    try:
        skills = _find_skills(agent)
    except CxbridgeError as error:
        yield make_error_finding(error, BROKEN_SKILL)
        yield from _check_files(agent, error.file or "")
        return  # mappings cannot be checked without the skills
    if skills is None:
        return
    yield from _check_files(agent)
    yield from _check_executors(agent)
    yield from _check_texts(agent, skills)
    yield from _check_arguments(agent, skills)
    for action, template, place in agent.action_mappings():
        match = _SKILL_NAME.match(template)
        if match is not None and match[1] not in skills and place is not None:
            message = f"'{action}' is mapped to the skill '{match[1]}', which does not exist"
            hint = did_you_mean(match[1], skills, f"there are: {', '.join(sorted(skills))}")
            yield Finding(UNKNOWN_SKILL, place, message, hint)


def _check_files(agent: Agent, reported_file: str = "") -> Iterator[Finding]:
    """Yield the Lua files in the skill folders that cannot be read or do not compile.

    :param reported_file: a file that already has a finding, or empty.
    """
    compiler = LuaCompiler()
    for folder in agent.context.paths.skill_dirs:
        for path in sorted(folder.rglob("*.lua")):
            if str(path) == reported_file:
                continue
            if reason := why_unreadable(path):
                yield Finding(UNCOMPILED_FILE, SourcePlace(str(path)), f"the file {reason}")
            elif (problem := compiler.find_file_error(path.read_bytes())) is not None:
                line, message = problem
                yield Finding(UNCOMPILED_FILE, SourcePlace(str(path), line), message)


def _check_texts(agent: Agent, skills: Mapping[str, Path | None]) -> Iterator[Finding]:
    """Yield the mistakes in the texts of Lua skills: those that prevent loading, and unknown methods."""
    for path in filter(None, skills.values()):
        text, find_schema = path.read_text("utf-8", "surrogateescape"), agent.context.registry.schema
        for code, mistakes in (
            (BROKEN_SKILL, find_load_mistakes(text, find_schema)),
            (UNKNOWN_METHOD, find_unknown_methods(text, find_schema)),
        ):
            for offset, message, hint in mistakes:
                yield Finding(code, SourcePlace.at(str(path), Lines(text), offset), message, hint)


def _check_executors(agent: Agent) -> Iterator[Finding]:
    """Yield the unknown types and fields in the settings of executors."""
    board = agent.context.skill_board
    for board_agent in () if board is None else board.agents:
        for executor in board_agent.executors:
            place = SourcePlace("") if executor.place is None else place_of(executor.place)
            for error in executor.mistakes():
                yield Finding(UNKNOWN_ROS_NAME, place, error.message, error.hint or "")


def _check_arguments(agent: Agent, skills: Mapping[str, Path | None]) -> Iterator[Finding]:
    """Yield the named arguments that a Lua skill does not have."""
    skill_files = {
        name: read_lua(str(path), path.read_text("utf-8", "surrogateescape"))
        for name, path in skills.items()
        if path is not None
    }
    for _, template, place in agent.action_mappings():
        match = _SKILL_NAME.match(template)
        if match is None or match[1] not in skill_files or place is None:
            continue
        file = skill_files[match[1]]
        documented_arguments = {
            mention.name.text for mention in file.mentions if mention.name.kind is NameKind.ARGUMENT
        }
        for name in _SKILL_ARGUMENT.findall(template[match.end(1) :]):
            # The skill may read an argument without documentation, but only if its text contains the name.
            if name not in documented_arguments and not re.search(rf"\b{name}\b", file.text):
                names_text = f"it has: {', '.join(sorted(documented_arguments)) or 'none'}"
                yield Finding(
                    UNKNOWN_ARGUMENT,
                    place,
                    f"the skill '{match[1]}' has no argument '{name}'",
                    did_you_mean(name, documented_arguments, names_text),
                )


def _find_skills(agent: Agent) -> dict[str, Path | None] | None:
    """Return the file of each skill by name; a skill of an executor has None in place of a file.

    The result is None if the skills are unknown before a run: if they are computed, if executors are in other
    processes, if a Skiller does not use Lua, or if the agent has no Fawkes configuration.
    """
    context = agent.context
    board = context.skill_board
    # Executors in other processes announce their skills only at run time.
    is_known = agent.options.skiller == "lua" and (board is None or board.in_process)
    if not is_known or not context.source.has_fawkes_configuration:
        return None
    skill_files: dict[str, Path | None] = {}
    for board_agent in () if board is None else board.agents:
        for executor in board_agent.executors:
            skills = read_executor_skills(executor)
            if skills is None:
                return None
            skill_files.update(dict.fromkeys(skills))
    for settings in skiller_settings(context.config, "lua", () if board is None else board.skillers):
        if settings.kind != "lua":
            return None  # the skills of other Skillers have no files
        space: str = context.config.get_str(SKILL_SPACE, default=DEFAULT_SPACE)
        space_files = find_space_skills(settings.space or space, context.paths.skill_dirs, LuaCompiler())
        if space_files is None:
            return None
        skill_files.update(space_files)
    return skill_files
