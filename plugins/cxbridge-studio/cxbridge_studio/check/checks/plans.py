"""Checks for mismatches between CLIPS files and the domain: predicates, objects, plan-actions, executors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import literal, read_nodes
from cxbridge.errors import PddlError
from cxbridge.executive.executive import read_action_mapping
from cxbridge.executive.pddl import Domain, domain_facts, names_of, pairs_of
from cxbridge.executive.pddl.ast import ARITHMETIC, FORMULA_WORDS, NumericChange
from cxbridge.run.specs import find_key_mistakes
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.domain_calls import (
    find_domain_calls,
    find_objects,
    find_planner_goals,
    read_domains,
)
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace
from cxbridge_studio.check.plan_actions import SourceAction, count_values, find_source_actions
from cxbridge_studio.check.usage import Construct

UNKNOWN_PREDICATE: Final = Code(
    "CX304",
    Severity.WARNING,
    "a predicate that the domain lacks",
    "A rule matches a fact of the domain, (wm-fact (key domain fact NAME ...)) or (domain-fact (name "
    "NAME)), but no domain declares the predicate, and no rule makes such a fact: its name may be wrong.",
)
WRONG_PARAMETERS: Final = Code(
    "CX305",
    Severity.WARNING,
    "a plan-action with wrong parameters",
    "The names or the number of the parameters are not those of the action. The precondition is never "
    "grounded, or the skill string lacks a value.",
)
INEXPRESSIBLE_DOMAIN: Final = Code(
    "CX306",
    Severity.ERROR,
    "the executive cannot take this part of the domain",
    "The executive's facts cannot express this precondition or effect, e.g. a quantifier. Planners accept "
    "the domain, but the executive cannot load it.",
)
UNKNOWN_TYPE: Final = Code(
    "CX308",
    Severity.WARNING,
    "a domain object of a type that the domain lacks",
    "Neither the domain nor a rule declares the type: no parameter of an action takes the object, and "
    "formulas ignore the object.",
)
UNEXECUTED_ACTION: Final = Code(
    "CX404",
    Severity.WARNING,
    "an action without an executor",
    "A plan contains the action, or a planner may plan it, but the action mapping has no entry for it, and "
    "no rule executes it: the plan waits forever.",
)

UNKNOWN_GOAL_NAME: Final = Code(
    "CX309",
    Severity.WARNING,
    "a planner's goal names something unknown",
    "The goal of a planner's call names a predicate, or an object, that neither the domain nor a rule "
    "declares: the planner finds no plan.",
)
# The first words of conditions and terms that are not predicates; a predicate may be called `increase`.
_NON_PREDICATES: Final = ARITHMETIC.union(FORMULA_WORDS).difference(NumericChange.KIND.words)

CODES: Final = (
    UNKNOWN_GOAL_NAME,
    UNKNOWN_PREDICATE,
    WRONG_PARAMETERS,
    INEXPRESSIBLE_DOMAIN,
    UNKNOWN_TYPE,
    UNEXECUTED_ACTION,
)


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the mismatches; none if a domain is missing, has a computed name, or cannot be read."""
    domains = read_domains(agent)
    if not domains:
        return
    for domain in domains:
        yield from _check_expressible(domain)
    yield from _check_predicates(agent, domains)
    yield from _check_types(agent, domains)
    yield from _check_parameters(agent, domains)
    yield from _check_executors(agent, domains)
    yield from _check_planner_goals(agent, domains)


def _check_expressible(domain: Domain) -> Iterator[Finding]:
    """Yield the first part of a domain that the executive's facts cannot express."""
    try:
        domain_facts(domain)
    except PddlError as error:
        place = SourcePlace(domain.file, error.line or 0, error.column or 0)
        yield Finding(INEXPRESSIBLE_DOMAIN, place, error.message, error.hint or "")


def _find_predicates(agent: Agent, domains: list[Domain]) -> set[str]:
    """Return the predicates and functions of the domains, and the predicates of facts that rules make."""
    return {
        declaration.name for domain in domains for declaration in (*domain.predicates, *domain.functions)
    } | agent.model.find_names(NameKind.PREDICATE, Use.ASSERTED, Use.CHANGED)


def _check_predicates(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    """Yield the predicates in patterns that neither a domain nor a rule declares."""
    predicates = _find_predicates(agent, domains)
    predicates |= {  # the predicates that rules declare
        literal(value)
        for file in agent.files
        for call in file.find_calls("domain-predicate")
        for slot in call.arguments
        if slot.head == "name"
        for value in slot.arguments
    }
    reported_names: set[str] = set()
    for construct in agent.own_constructs:
        for mention in construct.placed_piece.piece.mentions:
            name = mention.name.text
            is_matched = mention.name.kind is NameKind.PREDICATE and mention.use is Use.MATCHED
            # A rule may assert the fact of the world model by its id, a text with the name of the predicate.
            if (
                not is_matched
                or name in predicates | reported_names
                or any(f"domain/fact/{name}" in file.text for file in agent.files)
            ):
                continue
            reported_names.add(name)
            place, hint = construct.place(mention.start), did_you_mean(name, predicates)
            yield Finding(UNKNOWN_PREDICATE, place, f"no domain has a predicate '{name}'", hint)


def _check_planner_goals(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    """Yield the predicates and objects in planner goals that neither a domain nor a fact of a rule has."""
    predicates = _find_predicates(agent, domains)
    objects = find_objects(agent, domains)
    for file, call, goal_text in find_planner_goals(agent):
        place = file.place(call.arguments[1]) if goal_text else file.place(call)
        for node in (node for top_node in read_nodes(goal_text, close=True) for node in top_node.walk()):
            if not node.head or node.head in _NON_PREDICATES or node.head.startswith("?"):
                continue
            used_objects = set(map(literal, node.arguments)) - {""}
            # If any object is possible, no object is unknown.
            for kind, names, known_names in (
                ("predicate", {node.head}, predicates),
                ("object", used_objects, used_objects if objects is None else objects),
            ):
                for name in sorted(names - known_names):
                    message = f"the planner's goal has the unknown {kind} '{name}'"
                    yield Finding(UNKNOWN_GOAL_NAME, place, message, did_you_mean(name, known_names))


def _check_types(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    """Yield the types of asserted objects that neither a domain nor a rule declares."""
    types_with_parents = [pair for domain in domains for pair in pairs_of(domain.types)]
    types = {"object"}.union(*types_with_parents) - {""}  # the parent may be empty
    asserted_facts = agent.usage.asserted_facts
    for _, fact in asserted_facts.get("domain-object-type", ()):
        if "name" not in fact.words_by_slot:
            return  # the type is computed: any type is possible
        types |= fact.words_by_slot["name"]
    for construct, fact in asserted_facts.get("domain-object", ()):
        name = next(iter(fact.words_by_slot.get("type", ())), "")
        if name and name not in types and not agent.is_core_path(construct.file.path):
            place, hint = construct.place(fact.start), did_you_mean(name, types)
            yield Finding(UNKNOWN_TYPE, place, f"no domain has a type '{name}'", hint)


# ---- plan-actions


def _check_parameters(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    parameters_by_action = {
        action.name: [name.removeprefix("?") for name in names_of(action.parameters)]
        for domain in domains
        for action in domain.actions
    }
    agent_files = [file for file in agent.own_files if not agent.is_core_path(str(file.path))]
    for action in find_source_actions(agent_files):
        if (parameters := parameters_by_action.get(literal(action.name_node))) is not None:
            yield from _check_plan_action(action, parameters)


def _check_plan_action(action: SourceAction, parameter_names: list[str]) -> Iterator[Finding]:
    """Yield the first mistake in the parameters: further mistakes are often consequences."""
    name, file = literal(action.name_node), action.file
    parameters_text = f"it has: {', '.join(parameter_names) or 'none'}"
    for node in action.names or ():
        if (parameter := literal(node)) and parameter not in parameter_names:
            message = f"the action '{name}' has no parameter '{parameter}'"
            hint = did_you_mean(parameter, parameter_names, parameters_text)
            yield Finding(WRONG_PARAMETERS, file.place(node), message, hint)
            return
    for slot, values in (("param-names", action.names), ("param-values", action.values)):
        count = None if values is None else count_values(values)
        if count not in (None, len(parameter_names)):
            yield Finding(
                WRONG_PARAMETERS,
                file.place(values[0] if values else action.node),
                f"the action '{name}' has {len(parameter_names)} parameters, but {slot} has {count} values",
                parameters_text,
            )
            return


# ---- executors


def _check_executors(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    """Yield the actions in plans that neither a skill nor a rule executes."""
    if agent.context.skill_board is not None:
        return  # the executors of a skill board announce their actions at run time
    mapped_actions = set(read_action_mapping(agent.config, agent.spec))
    # The mapping may be below a misspelt key, which another check reports, or a rule may execute all actions.
    if not mapped_actions and (
        find_key_mistakes(agent.config, agent.spec) or any(map(_executes_any_action, agent.own_constructs))
    ):
        return
    # The actions that rules match or compare in their conditions: such a rule may execute the action.
    handled_actions = {
        word
        for construct in agent.usage.constructs
        if construct.keyword == "defrule"
        for node in construct.node.walk()
        if node.head == "action-name" or node.head in ("eq", "member$", "test")
        for value in node.arguments
        if (word := literal(value)) and not any(node.start >= action.start for action in construct.actions)
    }
    domain_actions = {action.name for domain in domains for action in domain.actions}
    reported_names = mapped_actions | handled_actions
    for construct in agent.own_constructs:
        for mention in construct.placed_piece.piece.mentions:
            name = mention.name.text
            is_planned = mention.name.kind is NameKind.ACTION and mention.use in (Use.ASSERTED, Use.NAMED)
            if is_planned and name in domain_actions - reported_names:
                reported_names.add(name)
                hint = did_you_mean(name, mapped_actions - domain_actions)
                place = construct.place(mention.start)
                yield Finding(UNEXECUTED_ACTION, place, f"the action '{name}' has no executor", hint)
    has_planner = next(find_planner_goals(agent), None) is not None
    for call in find_domain_calls(agent) if has_planner else ():
        actions = () if call.domain is None else call.domain.actions
        for name in sorted({action.name for action in actions} - reported_names):
            reported_names.add(name)
            message = f"the action '{name}', which a planner may plan, has no executor"
            hint = did_you_mean(name, mapped_actions - domain_actions)
            yield Finding(UNEXECUTED_ACTION, call.file.place(call.node), message, hint)


def _executes_any_action(construct: Construct) -> bool:
    """Return whether a rule matches plan-actions of any name and modifies a fact, perhaps the plan-action."""
    return any(
        pattern.template == "plan-action" and "action-name" not in pattern.words_by_slot
        for pattern in construct.patterns
    ) and any(node.head == "modify" for node in construct.action_nodes)
