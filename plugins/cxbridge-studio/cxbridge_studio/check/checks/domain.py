"""Checks PDDL domains for errors, and plan-actions and action mappings for actions that no domain has.

Of action mappings, it also checks the skill strings and their parameters.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from cxbridge.clipstext.syntax import literal
from cxbridge.errors import SkillError
from cxbridge.executive.pddl import names_of
from cxbridge.lua_syntax import LuaCompiler
from cxbridge.skiller.skillstring import parse_skill_string
from cxbridge.skiller.templates import (
    PLACEHOLDER_FORM,
    Placeholder,
    find_suspected_placeholders,
    parse_template,
)
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.condition import PatternCE, find_patterns
from cxbridge_studio.check.agent import Agent, ClipsFile
from cxbridge_studio.check.domain_calls import DomainCall, find_domain_calls
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace, make_error_finding
from cxbridge_studio.check.plan_actions import find_source_actions
from cxbridge_studio.check.usage import Construct, Usage

WRONG_DOMAIN: Final = Code(
    "CX301",
    Severity.ERROR,
    "the PDDL domain is wrong",
    "The domain does not parse, or uses names that it does not declare. No plan-action can be executed.",
)
DUBIOUS_DOMAIN: Final = Code(
    "CX310",
    Severity.WARNING,
    "the PDDL domain is read in spite of a mistake",
    "Other planners and Fawkes refuse the domain, or read the domain in another way.",
)
MISSING_DOMAIN: Final = Code(
    "CX302",
    Severity.ERROR,
    "there is no PDDL domain",
    "The file that a rule parses as a domain does not exist. No plan-action can be executed.",
)
UNKNOWN_ACTION: Final = Code(
    "CX303",
    Severity.WARNING,
    "a plan-action has no operator",
    "A rule asserts a plan-action with a name that is neither an action of the domain nor a domain-operator "
    "of a rule, and no rule executes the plan-action without matching (executable TRUE). The plan-action "
    "never becomes executable: its goal waits forever.",
)
UNUSED_MAPPING: Final = Code(
    "CX401",
    Severity.WARNING,
    "a mapping of an action that does not exist",
    "The action mapping has an entry for a name that no domain and no rule defines: the entry is never used.",
)
UNKNOWN_PARAMETER: Final = Code(
    "CX402",
    Severity.ERROR,
    "a mapping uses a parameter that the action lacks",
    "The skill string cannot be formed: the action fails.",
)
DOUBTFUL_PLACEHOLDER: Final = Code(
    "CX403",
    Severity.WARNING,
    "a text that looks like a placeholder but is not",
    "The text is copied into the skill string unchanged.",
)
UNREADABLE_TEMPLATE: Final = Code(
    "CX405",
    Severity.ERROR,
    "a mapping that is not a skill string",
    "The text of the mapping is not a call of a skill, for any values of the parameters: the action fails.",
)

CODES: Final = (
    UNREADABLE_TEMPLATE,
    WRONG_DOMAIN,
    DUBIOUS_DOMAIN,
    MISSING_DOMAIN,
    UNKNOWN_ACTION,
    UNUSED_MAPPING,
    UNKNOWN_PARAMETER,
    DOUBTFUL_PLACEHOLDER,
)


@dataclass
class _KnownActions:
    """The actions that an agent's domains and rules define.

    :param parameters: the names of the parameters by action; None for operators that only rules name.
    :param is_complete: whether all actions are known: every domain was read, and no operator has a computed
        name.
    """

    parameters: dict[str, tuple[str, ...] | None] = field(default_factory=dict)
    is_complete: bool = True


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the errors in domains and in references to the actions of domains."""
    actions = _KnownActions()
    for call in find_domain_calls(agent):
        yield from _add_domain(call, actions)
    _add_operators(agent.usage, actions)
    # With an unreadable domain or a computed operator, any name of an action may exist.
    if actions.parameters and actions.is_complete:
        yield from _check_plan_actions(agent.own_files, actions)
    yield from _check_mapping(agent, actions)


def _add_domain(call: DomainCall, actions: _KnownActions) -> Iterator[Finding]:
    """Add the actions of the domain that a call parses, and yield the mistakes in the domain."""
    if call.domain is None:
        actions.is_complete = False
        if call.error is not None:
            yield make_error_finding(call.error, WRONG_DOMAIN)
        elif call.name:
            yield Finding(MISSING_DOMAIN, call.file.place(call.node), f"there is no file {call.name}")
        return
    for warning in call.warnings:
        yield make_error_finding(warning, DUBIOUS_DOMAIN)
    for action in call.domain.actions:
        actions.parameters[action.name] = tuple(
            name.removeprefix("?") for name in names_of(action.parameters)
        )


def _add_operators(usage: Usage, actions: _KnownActions) -> None:
    """Add the operators that rules assert or match; their parameters are unknown."""
    operators: set[str] = set()
    for _, fact in usage.asserted_facts.get("domain-operator", ()):
        operators |= fact.words_by_slot.get("name", frozenset())
        if "name" in fact.slot_names and "name" not in fact.words_by_slot:
            actions.is_complete = False  # the operator's name is computed at run time
    for construct in usage.constructs:
        for ce in find_patterns(construct.condition):
            operators |= _find_operators(construct, ce)
    # The known parameters of actions in a domain are kept.
    actions.parameters = dict.fromkeys(operators) | actions.parameters


def _find_operators(construct: Construct, ce: PatternCE) -> frozenset[str]:
    """Return the actions that a pattern names as operators, or that its rule executes without an operator.

    A rule executes an action without an operator if it matches the plan-action by name, without the slot
    ``executable``, which only an operator sets, and changes the state of the plan-action.
    """
    if ce.template == "domain-operator":
        return ce.words_by_slot.get("name", frozenset())
    if ce.template != "plan-action" or "executable" in {constraint.slot for constraint in ce.constraints}:
        return frozenset()
    changes_state = any(
        node.head == "modify"
        and node.arguments[0].text == f"?{ce.variable}"
        and any(slot.head == "state" for slot in node.arguments)
        for node in construct.action_nodes
        if node.arguments
    )
    return ce.words_by_slot.get("action-name", frozenset()) if changes_state else frozenset()


def _check_plan_actions(files: list[ClipsFile], actions: _KnownActions) -> Iterator[Finding]:
    for action in find_source_actions(files):
        name = literal(action.name_node)
        if name not in actions.parameters:
            place, hint = action.file.place(action.name_node), did_you_mean(name, actions.parameters)
            yield Finding(UNKNOWN_ACTION, place, f"no domain has an action '{name}'", hint)


def _check_mapping(agent: Agent, actions: _KnownActions) -> Iterator[Finding]:
    """Yield the mistakes in the action mapping: skill strings, unknown actions, parameters, placeholders."""
    for action, template, position in agent.action_mappings():
        place = position or SourcePlace("")  # a mapping of a plug-in has no file
        yield from _check_skill_string(action, template, place)
        if action not in actions.parameters:
            if actions.parameters and actions.is_complete:
                hint = did_you_mean(action, actions.parameters)
                yield Finding(UNUSED_MAPPING, place, f"no domain has an action '{action}'", hint)
            continue
        parameters = actions.parameters[action]
        placeholders = (part for part in parse_template(template) if isinstance(part, Placeholder))
        for name in (placeholder.name for placeholder in placeholders):
            if parameters is not None and name not in parameters:
                hint = did_you_mean(name, parameters, f"it has: {', '.join(parameters) or 'none'}")
                yield Finding(UNKNOWN_PARAMETER, place, f"'{action}' has no parameter '{name}'", hint)
        for word in find_suspected_placeholders(template):
            message = f"'{word}' is not a placeholder: write {PLACEHOLDER_FORM}"
            yield Finding(DOUBTFUL_PLACEHOLDER, place, message)


def _check_skill_string(action: str, template: str, place: SourcePlace) -> Iterator[Finding]:
    """Yield the error of a template that makes neither a skill string nor a Lua text.

    Fawkes evaluates a skill string as Lua.
    """
    if not template.strip() or find_suspected_placeholders(template):
        return  # an empty mapping, and a doubtful placeholder of a known action, has another finding
    # A value without quotes may be a number or a word.
    for sample in ("1", "a"):
        values = {"s": f'"{sample}"', "S": f'"{sample}"'}  # by kind of placeholder: these two write strings
        skill_string = "".join(
            part if isinstance(part, str) else values.get(part.kind, sample)
            for part in parse_template(template)
        )
        try:
            parse_skill_string(skill_string)
        except SkillError as error:
            # The column belongs to the skill string of the sample, which the user does not see.
            reason = re.sub(r"^column \d+: ", "", error.message)
        else:
            return
        if LuaCompiler().find_error(skill_string.encode("utf-8")) is None:
            return
    yield Finding(
        UNREADABLE_TEMPLATE,
        place,
        f"the skill string of '{action}' is wrong: {reason}",
        "write a call such as goto{place=?(to)s}",
    )
