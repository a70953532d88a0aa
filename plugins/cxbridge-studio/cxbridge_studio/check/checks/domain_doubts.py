"""Checks for useless parts of a domain, such as impossible actions and goals that no action achieves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, parse_formula
from cxbridge.suggestions import nearest_names
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.check import doubts
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.domain_calls import MIN_PREDICATE_LIKENESS, find_domain_calls, find_planner_goals
from cxbridge_studio.check.findings import Finding

CODES: Final = doubts.CODES


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the doubts about each domain; with a single domain, also about the goals of planner calls."""
    domains = [call.domain for call in find_domain_calls(agent) if call.domain is not None]
    predicates = _find_asserted_predicates(agent)
    declared_names = {predicate.name for domain in domains for predicate in domain.predicates}
    if predicates and any(
        nearest_names(name, declared_names, MIN_PREDICATE_LIKENESS) for name in predicates - declared_names
    ):
        predicates = None  # another check reports the misspelt predicate, from which doubts would follow
    for domain in domains:
        # With several domains, the facts of one domain say nothing about another domain.
        yield from doubts.make_findings(
            domain.file, doubts.find_domain_doubts(domain, predicates if len(domains) == 1 else None)
        )
    if len(domains) == 1 and predicates is not None:
        yield from _check_goals(agent, domains[0], predicates)


def _find_asserted_predicates(agent: Agent) -> frozenset[str] | None:
    """Return the predicates of the facts that the agent asserts; None if they are unknown."""
    facts = agent.own_facts("domain-fact")
    if not facts or any("name" not in fact.words_by_slot for fact in facts):
        return None
    if any("domain/fact/" in file.text for file in agent.own_files):
        return None  # rules assert such facts by ids of the world model, which they may compute
    names = {word for fact in facts for word in fact.words_by_slot["name"]}
    return frozenset(names | agent.model.find_names(NameKind.PREDICATE, Use.ASSERTED, Use.CHANGED))


def _check_goals(agent: Agent, domain: Domain, predicates: frozenset[str]) -> Iterator[Finding]:
    """Yield the goals of planner calls that no action achieves."""
    for file, call, goal_text in find_planner_goals(agent):
        if not goal_text:
            continue
        with suppress(PddlError):  # the planner reports a mistake in the formula
            for doubt in doubts.find_goal_doubts(domain, parse_formula(goal_text), predicates):
                yield Finding(doubt.code, file.place(call.arguments[1]), doubt.message)
