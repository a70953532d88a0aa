"""Checks for code that cxbridge accepts and Fawkes does not: in CLIPS 6.30, features and PDDL.

Only ``cxbridge check --portable`` reports these findings.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Final

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.host.shims import ADDED, CLIPS630_NAMES
from cxbridge.executive.pddl import load_domain
from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.agent import Agent, ClipsFile
from cxbridge_studio.check.domain_calls import find_domain_calls
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace, make_error_finding

REFUSED_CALL: Final = Code(
    "CX601",
    Severity.WARNING,
    "not in Fawkes: a call that CLIPS 6.30 refuses",
    "CLIPS 6.30 takes a variable as the first argument of modify and duplicate, and two numbers or more for "
    "max and min. It drops a construct with another call.",
)
ADDED_FUNCTION: Final = Code(
    "CX602",
    Severity.WARNING,
    "not in Fawkes: a function",
    "Neither CLIPS 6.30 nor a feature of Fawkes has the function: a construct that calls it is dropped.",
)
REDEFINED_FUNCTION: Final = Code(
    "CX603",
    Severity.WARNING,
    "not in Fawkes: an agent's function with the name of a built-in function",
    "CLIPS 6.30 has a function of this name, and drops a deffunction that would replace the function.",
)
REFUSED_DOMAIN: Final = Code(
    "CX608",
    Severity.WARNING,
    "not in Fawkes: a PDDL domain",
    "Fawkes' parser refuses the domain: it supports fewer operators, and requires all sections in a fixed "
    "order. docs/evidence/planning.md lists the differences.",
)

CODES: Final = (
    REFUSED_CALL,
    ADDED_FUNCTION,
    REDEFINED_FUNCTION,
    REFUSED_DOMAIN,
)

_ADDED_FEATURES: Final = ("planner", "problem-expert", "skill-board")  # features that Fawkes lacks
_CHANGE_FUNCTIONS: Final = ("modify", "duplicate")
_MULTI_ARGUMENT_FUNCTIONS: Final = ("max", "min")


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the code in the agent's own files that Fawkes does not accept."""
    agent_files = [file for file in agent.own_files if not agent.is_core_path(str(file.path))]
    for file in agent_files:
        yield from _check_expressions(file)
        yield from _check_names(file)
    yield from _check_functions(agent)
    yield from _check_domains(agent)


def _check_expressions(file: ClipsFile) -> Iterator[Finding]:
    """Yield the calls with arguments that CLIPS 6.30 refuses."""
    for call in file.find_calls(*_CHANGE_FUNCTIONS):
        fact = call.arguments[0] if call.arguments else None
        if fact is not None and (fact.items is not None or fact.text.isdecimal()):
            argument = fact.text if fact.items is None else "(...)"
            message = f"CLIPS 6.30 refuses ({call.head} {argument} ...)"
            hint = f"first bind the fact to a variable: (bind ?fact {argument}) ({call.head} ?fact ...)"
            yield Finding(REFUSED_CALL, file.place(fact), message, hint)
    for call in file.find_calls(*_MULTI_ARGUMENT_FUNCTIONS):
        if len(call.arguments) == 1:
            message = f"CLIPS 6.30 refuses ({call.head} ...) with one argument"
            yield Finding(REFUSED_CALL, file.place(call), message, "give it two numbers or more")


def _check_names(file: ClipsFile) -> Iterator[Finding]:
    """Yield the functions with the name of a built-in function."""
    for construct in file.constructs:
        if construct.kind == "deffunction" and construct.name in CLIPS630_NAMES:
            place = file.place(construct.node.arguments[0])
            yield Finding(
                REDEFINED_FUNCTION, place, f"CLIPS 6.30 has a function '{construct.name}'", "rename it"
            )


def _check_functions(agent: Agent) -> Iterator[Finding]:
    """Yield the calls of functions that only CLIPS 6.4 or a feature of cxbridge provides."""
    feature_functions = agent.manager.feature_functions(agent.env.name)
    features = {name: feature for feature in _ADDED_FEATURES for name in feature_functions.get(feature, ())}
    defined_functions = agent.model.find_names(NameKind.FUNCTION, Use.DEFINED)
    for name in sorted((ADDED | features.keys()) - defined_functions):
        for call in agent.model.find_mentions(Name(NameKind.FUNCTION, name), Use.CALLED):
            if agent.is_core_path(call.file.path):
                continue
            place = SourcePlace.at(call.file.path, call.file.lines, call.mention.start)
            reason = (
                f"only cxbridge has the feature {features[name]}"
                if name in features
                else "CLIPS 6.30 lacks it"
            )
            yield Finding(ADDED_FUNCTION, place, f"Fawkes has no function '{name}': {reason}")


def _check_domains(agent: Agent) -> Iterator[Finding]:
    """Yield the valid domains that Fawkes' parser rejects."""
    for path in dict.fromkeys(call.path for call in find_domain_calls(agent) if call.path is not None):
        with suppress(CxbridgeError):
            load_domain(path)  # an invalid domain is a finding of another check
            try:
                load_domain(path, fawkes_compat=True)
            except PddlError as error:
                yield make_error_finding(error, REFUSED_DOMAIN)
