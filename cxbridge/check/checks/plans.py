"""Finds what CLIPS files and the domain do not agree on: predicates, plan-actions, who executes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.agent.clips import literal
from cxbridge.agent.names import Kind, Use
from cxbridge.check.agent import Agent, ClipsFile
from cxbridge.check.findings import Code, Finding, Place, Severity
from cxbridge.clipstext.syntax import SyntaxNode
from cxbridge.errors import PddlError
from cxbridge.executive.executive import action_mapping
from cxbridge.executive.pddl import Domain, domain_facts, load_domain, names_of
from cxbridge.suggestions import did_you_mean

PREDICATE: Final = Code(
    "CX304",
    Severity.WARNING,
    "a predicate that the domain lacks",
    "A rule matches a fact of the domain, (wm-fact (key domain fact NAME ...)) or (domain-fact (name NAME)): "
    "neither does a domain declare the predicate, nor does a rule make such a fact: its name may be wrong.",
)
PARAMETERS: Final = Code(
    "CX305",
    Severity.WARNING,
    "a plan-action with wrong parameters",
    "The names or the number of the parameters are not those of the action. The precondition is never "
    "grounded, or the skill string gets no value.",
)
NUMBERS: Final = Code(
    "CX306",
    Severity.ERROR,
    "the executive cannot take this part of the domain",
    "A precondition or an effect that facts cannot say, such as a comparison of numbers. Planners take it; "
    "the domain does not load into the executive.",
)
DROPPED: Final = Code(
    "CX307",
    Severity.NOTE,
    "the executive leaves out this part of the domain",
    "Changes of numbers have no fact: planners take them, and the executive goes on without.",
)
NOT_EXECUTED: Final = Code(
    "CX404",
    Severity.WARNING,
    "an action that nobody executes",
    "A plan has the action, the action mapping has no entry for it, and no rule waits for it: the plan waits "
    "forever.",
)

CODES: Final = (PREDICATE, PARAMETERS, NUMBERS, DROPPED, NOT_EXECUTED)


@dataclass(frozen=True, slots=True)
class _Parsed:
    """A domain that a call in a file parses."""

    domain: Domain
    file: ClipsFile
    call: SyntaxNode


def check(agent: Agent) -> Iterator[Finding]:
    """Yield a finding for each disagreement; nothing of names when a domain cannot be read."""
    parsed: list[_Parsed] = []
    for file in agent.own_files:
        for call in file.calls("parse-pddl-domain"):
            name = agent.text_of(call.arguments[0]) if call.arguments else ""
            path = agent.find(name) if name else None
            if path is None:
                return
            try:
                parsed.append(_Parsed(load_domain(path), file, call))
            except PddlError:
                return  # the check of domains has it
    for each in parsed:
        yield from _check_facts(each.domain)
    if parsed:
        yield from _check_predicates(agent, [each.domain for each in parsed])
        yield from _check_parameters(agent, [each.domain for each in parsed])
        yield from _check_executed(agent, parsed)


def _check_facts(domain: Domain) -> Iterator[Finding]:
    dropped: list[PddlError] = []
    try:
        domain_facts(domain, warn=dropped.append)
    except PddlError as error:
        yield _of_error(error, NUMBERS, domain)
        return
    for each in dropped:
        yield _of_error(each, DROPPED, domain)


def _of_error(error: PddlError, code: Code, domain: Domain) -> Finding:
    place = Place(domain.file, error.line or 0, error.column or 0)
    return Finding(code, place, error.message, error.hint or "")


def _check_predicates(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    known = {each.name for domain in domains for each in domain.predicates}
    known |= {each.name for domain in domains for each in domain.functions}
    model = agent.model
    known |= model.names(Kind.PREDICATE, Use.ASSERTED, Use.CHANGED)  # facts that the agent keeps itself
    known |= {  # rules may declare more
        literal(value)
        for file in agent.files
        for call in file.calls("domain-predicate")
        for slot in call.arguments
        if slot.head == "name"
        for value in slot.arguments
    }
    told: set[str] = set()
    for file in model.files:
        if agent.is_of_core(file.path):
            continue
        for mention in file.mentions:
            name = mention.name
            if name.kind is not Kind.PREDICATE or mention.use is not Use.MATCHED or name.text in known | told:
                continue
            told.add(name.text)
            if any(f"domain/fact/{name.text}" in each.text for each in agent.files):
                continue  # a fact by its id
            at = Place(file.path, file.lines.at(mention.start), file.lines.column(mention.start))
            message = f"no domain has a predicate '{name.text}'"
            yield Finding(PREDICATE, at, message, did_you_mean(name.text, known))


# ---- plan-actions


def _check_parameters(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    actions = {
        action.name: [name.removeprefix("?") for name in names_of(action.parameters)]
        for domain in domains
        for action in domain.actions
    }
    for file in agent.own_files:
        if agent.is_of_core(str(file.path)):
            continue
        for call in file.calls("assert"):
            for node in call.arguments:
                if node.head == "plan-action":
                    yield from _check_plan_action(file, node, actions)


def _check_plan_action(file: ClipsFile, node: SyntaxNode, actions: dict[str, list[str]]) -> Iterator[Finding]:
    slots = {item.head: item for item in node.arguments}
    name = next(map(literal, slots["action-name"].arguments), "") if "action-name" in slots else ""
    if name not in actions:
        return
    wanted = actions[name]
    names, values = slots.get("param-names"), slots.get("param-values")
    for given in () if names is None else names.arguments:
        if literal(given) and literal(given) not in wanted:
            hint = did_you_mean(literal(given), wanted, f"it has: {', '.join(wanted) or 'none'}")
            message = f"the action '{name}' has no parameter '{literal(given)}'"
            yield Finding(PARAMETERS, file.place(given), message, hint)
            return
    for slot in (names, values):
        count = _count(slot) if slot is not None else None
        if slot is not None and count is not None and count != len(wanted):
            message = f"the action '{name}' has {len(wanted)} parameters, and here are {count} in {slot.head}"
            yield Finding(PARAMETERS, file.place(slot), message, f"it has: {', '.join(wanted) or 'none'}")
            return


def _count(slot: SyntaxNode) -> int | None:
    """Return how many values a slot gets; None when one of them may be any number."""
    computed = any(value.items is not None or value.text.startswith("$?") for value in slot.arguments)
    variables = any(value.text.startswith("?") for value in slot.arguments) and len(slot.arguments) == 1
    return None if computed or variables else len(slot.arguments)


# ---- who executes


def _check_executed(agent: Agent, parsed: list[_Parsed]) -> Iterator[Finding]:
    if agent.context.paths.ros2cx is not None or agent.context.skill_board is not None:
        return  # executors say themselves which actions they take
    mapped = set(action_mapping(agent.config, agent.spec))
    usage = agent.usage
    if not mapped:
        return  # everything is executed by rules
    named = {
        word
        for construct in usage.constructs
        if construct.keyword == "defrule"
        for node in construct.node.walk()
        if node.head == "action-name" or node.head in ("eq", "member$", "test")
        for value in node.arguments
        if (word := literal(value)) and not any(node.start >= action.start for action in construct.actions)
    }
    operators = {action.name for each in parsed for action in each.domain.actions}
    told = mapped | named
    for file in agent.model.files:
        for mention in () if agent.is_of_core(file.path) else file.mentions:
            name = mention.name.text
            is_planned = mention.name.kind is Kind.ACTION and mention.use in (Use.ASSERTED, Use.NAMED)
            if is_planned and name in operators - told:
                told.add(name)
                at = Place(file.path, file.lines.at(mention.start), file.lines.column(mention.start))
                hint = did_you_mean(name, mapped - operators)
                yield Finding(NOT_EXECUTED, at, f"nobody executes the action '{name}'", hint)
