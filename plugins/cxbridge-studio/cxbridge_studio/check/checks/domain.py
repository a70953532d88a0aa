"""Check for errors in PDDL domains, and for actions that the domain lacks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from cxbridge.clipstext.condition import PatternCE, patterns
from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.executive import action_mapping
from cxbridge.executive.features.pddl_parser import reads_as_fawkes
from cxbridge.executive.pddl import Domain, load_domain, names_of
from cxbridge.skiller.templates import Placeholder, find_doubts, parse_template
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.check.agent import Agent, ClipsFile, place_of
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace, of_error
from cxbridge_studio.check.plan_actions import source_actions
from cxbridge_studio.check.usage import Construct, Usage

DOMAIN: Final = Code(
    "CX301",
    Severity.ERROR,
    "the PDDL domain is wrong",
    "The domain does not parse, or uses what it does not declare. No plan-action can be executed.",
)
DUBIOUS: Final = Code(
    "CX310",
    Severity.WARNING,
    "the PDDL domain is read in spite of a mistake",
    "Other planners and Fawkes refuse the domain, or read it in another way.",
)
NO_DOMAIN: Final = Code(
    "CX302",
    Severity.ERROR,
    "there is no PDDL domain",
    "The file that is parsed as a domain is not there. No plan-action can be executed.",
)
ACTION: Final = Code(
    "CX303",
    Severity.WARNING,
    "a plan-action has no operator",
    "A rule makes a plan-action with a name that is neither an action of the domain nor a "
    "domain-operator of a rule, and no rule executes it without asking whether it is executable. The "
    "action never becomes executable: its goal waits without end.",
)
MAPPED: Final = Code(
    "CX401",
    Severity.WARNING,
    "a mapping of an action that does not exist",
    "The action mapping has an entry for a name that no domain and no rule knows: it is never used.",
)
PARAMETER: Final = Code(
    "CX402",
    Severity.ERROR,
    "a mapping uses a parameter that the action lacks",
    "The skill string cannot be made: the action fails.",
)
DOUBT: Final = Code(
    "CX403",
    Severity.WARNING,
    "a text looks like a placeholder and is none",
    "It goes into the skill string as it is.",
)

CODES: Final = (DOMAIN, DUBIOUS, NO_DOMAIN, ACTION, MAPPED, PARAMETER, DOUBT)

_OPERATOR: Final = "domain-operator"
_ACTION: Final = "plan-action"
_PARSE: Final = "parse-pddl-domain"


@dataclass
class _Actions:
    """The known actions of an agent.

    :param parameters: by action; None for operators that rules assert.
    :param is_complete: whether every domain was read and no operator has a computed name.
    """

    parameters: dict[str, tuple[str, ...] | None] = field(default_factory=dict)
    is_complete: bool = True


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the errors in domains and in references to domains."""
    actions = _Actions()
    for file in agent.own_files:
        for call in file.calls(_PARSE):
            yield from _check_domain(agent, file, call, actions)
    _note_operators(agent.usage, actions)
    if actions.parameters and actions.is_complete:
        yield from _check_plan_actions(agent.own_files, actions)
    yield from _check_mapping(agent, actions)


def _check_domain(agent: Agent, file: ClipsFile, call: SyntaxNode, actions: _Actions) -> Iterator[Finding]:
    name = agent.text_of(call.arguments[0]) if call.arguments else ""
    if not name:
        actions.is_complete = False  # the file name is computed at run time
        return
    path = agent.find(name)
    if path is None:
        actions.is_complete = False
        yield Finding(NO_DOMAIN, file.place(call), f"there is no file {name}")
        return
    try:
        warnings: list[PddlError] = []
        compat = reads_as_fawkes(agent.config)
        domain: Domain = load_domain(path, fawkes_compat=compat, warn=warnings.append)
    except CxbridgeError as error:
        actions.is_complete = False
        yield of_error(error, DOMAIN)
        return
    for warning in warnings:
        yield of_error(warning, DUBIOUS)
    for action in domain.actions:
        actions.parameters[action.name] = tuple(
            name.removeprefix("?") for name in names_of(action.parameters)
        )


def _note_operators(usage: Usage, actions: _Actions) -> None:
    """Add the operators that rules assert or match."""
    for _, fact in usage.made.get(_OPERATOR, ()):
        actions.parameters.update(
            dict.fromkeys(fact.slots.get("name", frozenset()) - actions.parameters.keys())
        )
        if "name" in fact.named and "name" not in fact.slots:
            actions.is_complete = False  # the operator's name is computed at run time
    for construct in usage.constructs:
        for ce in patterns(construct.condition):
            words = _words_of(construct, ce)
            actions.parameters.update(dict.fromkeys(words - actions.parameters.keys()))


def _words_of(construct: Construct, ce: PatternCE) -> frozenset[str]:
    """Return the actions that a pattern names as operators, or executes without an operator.

    The latter match a plan-action by name, not by ``(executable TRUE)``, and change its state.
    """
    if ce.template == _OPERATOR:
        return ce.slots.get("name", frozenset())
    if ce.template != _ACTION or "executable" in {part.slot for part in ce.parts}:
        return frozenset()
    changes = any(
        node.head == "modify"
        and node.arguments[0].text == f"?{ce.variable}"
        and any(slot.head == "state" for slot in node.arguments)
        for action in construct.actions
        for node in action.walk()
        if node.arguments
    )
    return ce.slots.get("action-name", frozenset()) if changes else frozenset()


def _check_plan_actions(files: list[ClipsFile], actions: _Actions) -> Iterator[Finding]:
    for planned in source_actions(files):
        name = literal(planned.name)
        if name not in actions.parameters:
            hint = did_you_mean(name, actions.parameters)
            yield Finding(ACTION, planned.file.place(planned.name), f"no domain has an action '{name}'", hint)


def _check_mapping(agent: Agent, actions: _Actions) -> Iterator[Finding]:
    base = f"/clips-executive/specs/{agent.spec}/action-mapping"
    for action, template in action_mapping(agent.config, agent.spec).items():
        place = (
            place_of(agent.config.get(f"{base}/{action}"))
            if agent.config.exists(f"{base}/{action}")
            else SourcePlace("")
        )
        if action not in actions.parameters:
            if actions.parameters and actions.is_complete:
                hint = did_you_mean(action, actions.parameters)
                yield Finding(MAPPED, place, f"no domain has an action '{action}'", hint)
            continue
        known = actions.parameters[action]
        for part in parse_template(template):
            if isinstance(part, Placeholder) and known is not None and part.name not in known:
                hint = did_you_mean(part.name, known) or f"it has: {', '.join(known) or 'none'}"
                yield Finding(PARAMETER, place, f"'{action}' has no parameter '{part.name}'", hint)
        for doubt in find_doubts(template):
            yield Finding(DOUBT, place, f"'{doubt.text}' is not a placeholder: {doubt.reason}")
