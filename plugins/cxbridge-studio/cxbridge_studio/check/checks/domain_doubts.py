"""Check for absurd parts of a domain: impossible actions, goals that no action achieves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import literal
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.features.pddl_parser import reads_as_fawkes
from cxbridge.executive.pddl import Domain, load_domain, parse_formula
from cxbridge.executive.pddl.ast import And
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.doubts import DoubtKind, doubts, unachieved
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace

PREDICATE: Final = Code(
    "CX311",
    Severity.WARNING,
    "a predicate that is never true",
    "No action has the predicate as an effect, and no rule makes such a fact: conditions that want it never "
    "hold.",
)
ACTION: Final = Code(
    "CX312",
    Severity.WARNING,
    "an action that can never be done",
    "Its precondition wants a predicate that nothing makes true before it: neither a rule, nor an action "
    "that can be done.",
)
EFFECT: Final = Code(
    "CX313",
    Severity.WARNING,
    "an action that takes its own effect back",
    "The action makes an atom true and false at the same time. In PDDL it is true then.",
)
OBJECT: Final = Code(
    "CX314",
    Severity.WARNING,
    "an object without a type",
    "All parameters of actions have a type, and the object has none: no action takes it.",
)
GOAL: Final = Code(
    "CX315",
    Severity.WARNING,
    "a planner's goal that no action achieves",
    "The formula of a planner's call wants a predicate that no action has as an effect and that no rule "
    "makes: there is no plan.",
)

CODES: Final = (PREDICATE, ACTION, EFFECT, OBJECT, GOAL)

# The code of each kind of doubt.
BY_KIND: Final = {
    DoubtKind.PREDICATE: PREDICATE,
    DoubtKind.ACTION: ACTION,
    DoubtKind.EFFECT: EFFECT,
    DoubtKind.OBJECT: OBJECT,
    DoubtKind.GOAL: GOAL,
}

_PARSE: Final = "parse-pddl-domain"
_PLANNERS: Final = ("planner-plan", "planner-plan-with", "planner-plan-part")
_FACT: Final = "domain-fact"
_FACT_KEY: Final = "domain/fact/"


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the doubts about each domain; with a single domain, also about the goals of planner calls."""
    domains = list(_domains(agent))
    made_predicates = _made(agent)
    for domain in domains:
        for doubt in doubts(domain, made_predicates if len(domains) == 1 else None):
            place = SourcePlace(domain.file, doubt.position.line, doubt.position.column)
            yield Finding(BY_KIND[doubt.kind], place, doubt.message)
    if len(domains) == 1 and made_predicates is not None:
        yield from _goals(agent, domains[0], made_predicates)


def _domains(agent: Agent) -> Iterator[Domain]:
    for file in agent.own_files:
        for call in file.calls(_PARSE):
            name = agent.text_of(call.arguments[0]) if call.arguments else ""
            path = agent.find(name) if name else None
            if path is None:
                continue
            try:
                yield load_domain(path, fawkes_compat=reads_as_fawkes(agent.config))
            except CxbridgeError:
                continue  # reported by the check of domains


def _made(agent: Agent) -> frozenset[str] | None:
    """Return the predicates of the facts that the agent asserts; None if they are unknown."""
    own_constructs = [
        fact
        for construct, fact in agent.usage.made.get(_FACT, ())
        if not agent.is_of_core(construct.file.path)
    ]
    if not own_constructs or any("name" not in fact.slots for fact in own_constructs):
        return None
    if any(_FACT_KEY in file.text for file in agent.own_files):
        return None
    names = {word for fact in own_constructs for word in fact.slots["name"]}
    return frozenset(names | agent.model.names(NameKind.PREDICATE, Use.ASSERTED, Use.CHANGED))


def _goals(agent: Agent, domain: Domain, made_predicates: frozenset[str]) -> Iterator[Finding]:
    for file in agent.own_files:
        for call in file.calls(*_PLANNERS):
            text = literal(call.arguments[1]) if len(call.arguments) > 1 else ""
            try:
                goal = parse_formula(text) if text else And(())
                goal_doubts = list(unachieved(domain, goal, made_predicates))
            except PddlError:
                continue
            for doubt in goal_doubts:
                yield Finding(GOAL, file.place(call.arguments[1]), doubt.message)
