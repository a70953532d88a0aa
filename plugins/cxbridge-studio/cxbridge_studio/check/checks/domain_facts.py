"""Checks for asserted facts with an unknown predicate or a wrong number of parameters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge.executive.pddl import names_of
from cxbridge.suggestions import did_you_mean, nearest_names
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.domain_calls import MIN_PREDICATE_LIKENESS, read_domains
from cxbridge_studio.check.findings import Code, Finding, Severity
from cxbridge_studio.check.plan_actions import ValueNodes, count_values
from cxbridge_studio.check.usage import Construct

WRONG_FACT: Final = Code(
    "CX316",
    Severity.WARNING,
    "an asserted fact that the domain lacks",
    "A rule asserts a (domain-fact ...) or a (wm-fact (key domain fact ...)) of a predicate that no domain "
    "declares and no rule matches, or with a wrong number of parameters: actions ignore the fact, or a "
    "planner refuses it.",
)

CODES: Final = (WRONG_FACT,)

_COMPARISONS: Final = frozenset({"eq", "neq", "member$"})


class _Fact(NamedTuple):
    """A fact of the domain that a construct asserts.

    :param name_node: the node of the literal predicate.
    :param values: the nodes of the parameters.
    :param is_pddl: whether the fact is a ``domain-fact``, not a fact of the world model.
    """

    name_node: SyntaxNode
    values: ValueNodes
    is_pddl: bool


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the wrong facts; none if a domain cannot be read, which another check reports."""
    domains = read_domains(agent)
    if not domains or agent.own_facts("domain-predicate"):
        return  # rules with such facts declare predicates
    parameter_counts = {
        declaration.name: len(names_of(declaration.parameters))
        for domain in domains
        for declaration in (*domain.predicates, *domain.functions)
    }
    matched_names = agent.model.find_names(NameKind.PREDICATE, Use.MATCHED, Use.CHANGED)
    names_in_rules = matched_names | _find_compared_words(agent)
    for construct in agent.own_constructs:
        skipped_names = set(names_in_rules)  # and the names that have a finding
        for fact in _find_facts(construct):
            name, place = literal(fact.name_node), construct.place(fact.name_node.start)
            count, expected_count = count_values(fact.values), parameter_counts.get(name)
            if expected_count is None:
                # The world model may have facts that the domain lacks: only a likely misspelling counts.
                is_likely = fact.is_pddl or nearest_names(name, parameter_counts, MIN_PREDICATE_LIKENESS)
                if is_likely and name not in skipped_names:
                    skipped_names.add(name)
                    hint = did_you_mean(name, parameter_counts)
                    yield Finding(WRONG_FACT, place, f"no domain has a predicate '{name}'", hint)
            elif count not in (None, expected_count):
                message = f"the predicate '{name}' has {expected_count} parameters, but this fact has {count}"
                yield Finding(WRONG_FACT, place, message)


def _find_compared_words(agent: Agent) -> set[str]:
    """Return the words with which rules compare values, e.g. the predicates in queries of facts."""
    nodes = (node for construct in agent.own_constructs for node in construct.node.walk())
    return {
        word for node in nodes if node.head in _COMPARISONS for word in map(literal, node.arguments) if word
    }


def _find_facts(construct: Construct) -> Iterator[_Fact]:
    """Yield the asserted facts of the domain with a literal predicate."""
    for node in construct.asserted_nodes:
        slots = {slot.head: slot.arguments for slot in node.arguments if slot.head}
        if node.head == "domain-fact" and len(names := slots.get("name", ())) == 1 and literal(names[0]):
            yield _Fact(names[0], slots.get("param-values", ()), is_pddl=True)
        key = slots.get("key", ())
        # A key with a computed number of values has no count.
        is_domain_key = count_values(key) and list(map(literal, key[:2])) == ["domain", "fact"]
        has_no_list = all(item.text != "[" for item in key)  # an argument may be a list, [ VALUE ... ]
        if node.head == "wm-fact" and is_domain_key and has_no_list and any(map(literal, key[2:3])):
            # (key domain fact NAME args? PARAMETER VALUE ...)
            yield _Fact(key[2], key[5::2], is_pddl=False)
