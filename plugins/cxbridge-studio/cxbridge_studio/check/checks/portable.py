"""Checks for code that cxbridge accepts and Fawkes does not: functions, interfaces, Lua and PDDL domains.

Only ``cxbridge check --portable`` reports these findings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Final

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.host.shims import ADDED, CLIPS630_NAMES
from cxbridge.executive.pddl import load_domain
from cxbridge.resources import shipped_dir
from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.agent import Agent, ClipsFile, read_first_argument
from cxbridge_studio.check.domain_calls import find_domain_files
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace, make_error_finding

REFUSED_CALL: Final = Code(
    "CX601",
    Severity.WARNING,
    "not in Fawkes: a call that CLIPS 6.30 refuses",
    "In CLIPS 6.30, the first argument of modify and duplicate must be a variable, and max and min need two "
    "numbers or more. CLIPS 6.30 drops a construct with a call that breaks these rules.",
)
ADDED_FUNCTION: Final = Code(
    "CX602",
    Severity.WARNING,
    "not in Fawkes: a function that only cxbridge has",
    "Neither CLIPS 6.30 nor a feature of Fawkes has the function: a construct that calls it is dropped.",
)
REDEFINED_FUNCTION: Final = Code(
    "CX603",
    Severity.WARNING,
    "not in Fawkes: an agent's function with the name of a built-in function",
    "CLIPS 6.30 has a function of this name, and drops a deffunction that would replace the function.",
)
READ_AND_WRITTEN_TYPE: Final = Code(
    "CX604",
    Severity.WARNING,
    "not in Fawkes: an interface type that is read and written",
    "One environment opens interfaces of one type for reading and for writing. Fawkes builds the type's "
    "deftemplate for both, and CLIPS refuses the second deftemplate.",
)
WRONG_INTERFACE_NAME: Final = Code(
    "CX605",
    Severity.WARNING,
    "not in Fawkes: a wrong name of an interface",
    "The name is not TYPE::ID. In cxbridge, the function has no effect; in Fawkes, an exception ends the "
    "process.",
)
LUA_SECONDS: Final = Code(
    "CX606",
    Severity.WARNING,
    "not in Fawkes: exact seconds from Time:in_sec()",
    "Time:in_sec() returns a 32-bit float in Fawkes: the time of day is off by up to 64 seconds, and "
    "differences of two such numbers are 0 or multiples of 128 seconds.",
)
FUNCTION_ARGUMENT: Final = Code(
    "CX607",
    Severity.WARNING,
    "not in Fawkes: a function as an argument of a skill",
    "Fawkes converts the arguments of a skill to strings; a function cannot be converted.",
)
REFUSED_DOMAIN: Final = Code(
    "CX608",
    Severity.WARNING,
    "not in Fawkes: a PDDL domain that its parser refuses",
    "Fawkes' parser refuses the domain: it supports fewer operators, and requires all sections in a fixed "
    "order. docs/evidence/planning.md lists the differences.",
)

CODES: Final = (
    REFUSED_CALL,
    ADDED_FUNCTION,
    REDEFINED_FUNCTION,
    READ_AND_WRITTEN_TYPE,
    WRONG_INTERFACE_NAME,
    LUA_SECONDS,
    FUNCTION_ARGUMENT,
    REFUSED_DOMAIN,
)

_ADDED_FEATURES: Final = ("planner", "problem-expert", "skill-board")  # features that Fawkes lacks
_READING_FUNCTIONS: Final = ("blackboard-open", "blackboard-open-reading")
_UID_FUNCTIONS: Final = ("blackboard-write", "blackboard-set", "blackboard-set-multifield")
# The form of names that Fawkes' Interface::parse_uid accepts, apart from its limits of length.
_UID: Final = re.compile(r"[a-zA-Z0-9]+::[a-zA-Z0-9 _/.-]+")
# The code, the pattern and the hint of each mistake in Lua files.
_LUA_MISTAKES: Final = (
    (LUA_SECONDS, re.compile(r":\s*in_sec\s*\("), "use in_msec()"),
    (
        FUNCTION_ARGUMENT,
        re.compile(r"\b(?:args|skills)\s*=\s*\{[^\n]*?=\s*function\b"),
        "pass a string or a number, by which the skill chooses the function",
    ),
)
_LUA_LINE_COMMENT: Final = re.compile(r"--[^\n]*")


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the code in the agent's own files that Fawkes does not accept."""
    agent_files = [file for file in agent.own_files if not agent.is_core_path(str(file.path))]
    for file in agent_files:
        yield from _check_expressions(file)
        yield from _check_names(file)
    yield from _check_functions(agent)
    yield from _check_opened_types(agent_files)
    yield from _check_domains(agent)
    fawkes_dir = agent.options.fawkes_dir
    # The skills of cxbridge and of a Fawkes checkout do not belong to the agent.
    for folder in agent.context.paths.skill_dirs:
        is_own = folder != shipped_dir("luaskills") and not (
            fawkes_dir and folder.is_relative_to(fawkes_dir.resolve())
        )
        for path in sorted(folder.rglob("*.lua")) if is_own else ():
            yield from _check_lua(str(path), path.read_text("utf-8", "surrogateescape"))


def _check_expressions(file: ClipsFile) -> Iterator[Finding]:
    """Yield the calls with arguments that CLIPS 6.30 refuses."""
    for call in file.find_calls("modify", "duplicate"):
        fact = call.arguments[0] if call.arguments else None
        if fact is not None and (fact.items is not None or fact.text.isdecimal()):
            argument = fact.text if fact.items is None else "(...)"
            yield Finding(
                REFUSED_CALL,
                file.place(fact),
                f"CLIPS 6.30 refuses ({call.head} {argument} ...)",
                f"first bind the fact to a variable: (bind ?fact {argument}) ({call.head} ?fact ...)",
            )
    for call in file.find_calls("max", "min"):
        if len(call.arguments) == 1:
            message = f"CLIPS 6.30 refuses ({call.head} ...) with one argument"
            yield Finding(REFUSED_CALL, file.place(call), message, "give it two numbers or more")


def _check_names(file: ClipsFile) -> Iterator[Finding]:
    """Yield the functions with the name of a built-in function, and the wrong names of interfaces."""
    for construct in file.constructs:
        if construct.kind == "deffunction" and construct.name in CLIPS630_NAMES:
            yield Finding(
                REDEFINED_FUNCTION,
                file.place(construct.node.arguments[0]),
                f"CLIPS 6.30 has a function '{construct.name}'",
                "rename it",
            )
    for call in file.find_calls(*_UID_FUNCTIONS):
        uid = read_first_argument(call)
        if uid and not _UID.fullmatch(uid):
            yield Finding(
                WRONG_INTERFACE_NAME,
                file.place(call.arguments[0]),
                f"'{uid}' is not the name of an interface",
                'write "TYPE::ID"',
            )


def _check_functions(agent: Agent) -> Iterator[Finding]:
    """Yield the calls of functions that only CLIPS 6.4 or a feature of cxbridge provides."""
    feature_functions = agent.manager.feature_functions(agent.env.name)
    features = {name: feature for feature in _ADDED_FEATURES for name in feature_functions.get(feature, ())}
    defined_functions = agent.model.find_names(NameKind.FUNCTION, Use.DEFINED)
    for name in sorted((ADDED | features.keys()) - defined_functions):
        for call in agent.model.find_mentions(Name(NameKind.FUNCTION, name), Use.CALLED):
            if not agent.is_core_path(call.file.path):
                place = SourcePlace.at(call.file.path, call.file.lines, call.mention.start)
                feature_text = f"only cxbridge has the feature {features.get(name)}"
                reason = feature_text if name in features else "CLIPS 6.30 lacks it"
                yield Finding(ADDED_FUNCTION, place, f"Fawkes has no function '{name}': {reason}")


def _check_opened_types(files: list[ClipsFile]) -> Iterator[Finding]:
    """Yield the interface types that the agent opens for reading and for writing."""
    read_types = {
        read_first_argument(call) for file in files for call in file.find_calls(*_READING_FUNCTIONS)
    } - {""}
    for file in files:
        for call in file.find_calls("blackboard-open-writing"):
            if (name := read_first_argument(call)) in read_types:
                yield Finding(
                    READ_AND_WRITTEN_TYPE,
                    file.place(call.arguments[0]),
                    f"interfaces of type {name} are opened for reading and for writing",
                    "open it for writing in another environment or program",
                )


def _check_domains(agent: Agent) -> Iterator[Finding]:
    """Yield the valid domains that Fawkes' parser rejects."""
    for path in find_domain_files(agent):
        with suppress(CxbridgeError):
            load_domain(path)  # an invalid domain is a finding of another check
            try:
                load_domain(path, fawkes_compat=True)
            except PddlError as error:
                yield make_error_finding(error, REFUSED_DOMAIN)


def _check_lua(path: str, text: str) -> Iterator[Finding]:
    """Yield the mistakes of :data:`_LUA_MISTAKES` in a Lua file."""
    # Blanks take the place of line comments, so that offsets stay the same.
    text_without_comments, lines = _LUA_LINE_COMMENT.sub(lambda match: " " * len(match[0]), text), Lines(text)
    for code, pattern, hint in _LUA_MISTAKES:
        for match in pattern.finditer(text_without_comments):
            message = code.title.removeprefix("not in Fawkes: ")
            yield Finding(code, SourcePlace.at(path, lines, match.start()), message, hint)
