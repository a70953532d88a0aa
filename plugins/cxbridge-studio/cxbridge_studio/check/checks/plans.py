"""Check for mismatches between CLIPS files and the domain: predicates, plan-actions, executors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal, read
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.executive import action_mapping
from cxbridge.executive.features.pddl_parser import reads_as_fawkes
from cxbridge.executive.pddl import Domain, domain_facts, load_domain, names_of, pairs_of
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.check.agent import Agent, ClipsFile
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace
from cxbridge_studio.check.plan_actions import SourceAction, count, source_actions
from cxbridge_studio.check.usage import Construct

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
UNSAYABLE: Final = Code(
    "CX306",
    Severity.ERROR,
    "the executive cannot take this part of the domain",
    "A precondition or an effect that facts cannot say, such as a quantifier. Planners take it; "
    "the domain does not load into the executive.",
)
TYPE: Final = Code(
    "CX308",
    Severity.WARNING,
    "a domain object of a type that the domain lacks",
    "The type is neither in the domain nor made by a rule: no parameter of an action takes the object, and "
    "formulas do not see it.",
)
NOT_EXECUTED: Final = Code(
    "CX404",
    Severity.WARNING,
    "an action without an executor",
    "A plan has the action, the action mapping has no entry for it, and no rule waits for it: the plan waits "
    "forever.",
)

FORMULA: Final = Code(
    "CX309",
    Severity.WARNING,
    "a planner's goal names something unknown",
    "The formula of a planner's call names a predicate, or an object, that neither the domain nor a rule "
    "declares: the planner finds no plan.",
)
_CONNECTIVES: Final = frozenset(
    {"and", "or", "not", "imply", "forall", "exists", "when", "=", ">", "<", ">=", "<=", "+", "-", "*", "/"}
)
_PLANNERS: Final = ("planner-plan", "planner-plan-with", "planner-plan-part")

CODES: Final = (FORMULA, PREDICATE, PARAMETERS, UNSAYABLE, TYPE, NOT_EXECUTED)


@dataclass(frozen=True, slots=True)
class _Parsed:
    """A domain and the call that parses it."""

    domain: Domain
    file: ClipsFile
    call: SyntaxNode


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the mismatches; none if a domain cannot be read."""
    parsed: list[_Parsed] = []
    for file in agent.own_files:
        for call in file.calls("parse-pddl-domain"):
            name = agent.text_of(call.arguments[0]) if call.arguments else ""
            path = agent.find(name) if name else None
            if path is None:
                return
            try:
                compat = reads_as_fawkes(agent.config)
                parsed.append(_Parsed(load_domain(path, fawkes_compat=compat), file, call))
            except CxbridgeError:
                return  # reported by the check of domains
    for each in parsed:
        yield from _check_facts(each.domain)
    if parsed:
        yield from _check_predicates(agent, [each.domain for each in parsed])
        yield from _check_types(agent, [each.domain for each in parsed])
        yield from _check_parameters(agent, [each.domain for each in parsed])
        yield from _check_executed(agent, parsed)
        yield from _check_formulas(agent, [each.domain for each in parsed])


def _check_facts(domain: Domain) -> Iterator[Finding]:
    try:
        domain_facts(domain)
    except PddlError as error:
        place = SourcePlace(domain.file, error.line or 0, error.column or 0)
        yield Finding(UNSAYABLE, place, error.message, error.hint or "")


def _check_predicates(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    known = {each.name for domain in domains for each in domain.predicates}
    known |= {each.name for domain in domains for each in domain.functions}
    model = agent.model
    # facts that the agent maintains itself
    known |= model.names(NameKind.PREDICATE, Use.ASSERTED, Use.CHANGED)
    known |= {  # predicates that rules declare
        literal(value)
        for file in agent.files
        for call in file.calls("domain-predicate")
        for slot in call.arguments
        if slot.head == "name"
        for value in slot.arguments
    }
    reported: set[str] = set()
    for file in model.files:
        if agent.is_of_core(file.path):
            continue
        for mention in file.mentions:
            name = mention.name
            if (
                name.kind is not NameKind.PREDICATE
                or mention.use is not Use.MATCHED
                or name.text in known | reported
            ):
                continue
            reported.add(name.text)
            if any(f"domain/fact/{name.text}" in each.text for each in agent.files):
                continue  # the fact is named by its id
            position = SourcePlace(file.path, file.lines.at(mention.start), file.lines.column(mention.start))
            message = f"no domain has a predicate '{name.text}'"
            yield Finding(PREDICATE, position, message, did_you_mean(name.text, known))


def _check_formulas(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    """Yield the predicates and objects in planner goals that nothing declares."""
    predicates = {each.name for domain in domains for each in domain.predicates}
    predicates |= {each.name for domain in domains for each in domain.functions}
    predicates |= agent.model.names(NameKind.PREDICATE, Use.ASSERTED, Use.CHANGED)
    objects = {name for domain in domains for name, _ in pairs_of(domain.constants)}
    objects_made = agent.usage.made.get("domain-object", ())
    assertions = [fact for construct, fact in objects_made if not _is_core(agent, construct)]
    objects |= {word for fact in assertions for word in fact.slots.get("name", ())}
    objects_known = assertions != [] and all("name" in fact.slots for fact in assertions)
    for file, call in _planner_calls(agent):
        text = literal(call.arguments[1]) if len(call.arguments) > 1 else ""
        place = file.place(call.arguments[1]) if text else None
        for node in (node for top in read(text, close=True) for node in top.walk()):
            if place is None or not node.head or node.head in _CONNECTIVES or node.head.startswith("?"):
                continue
            if node.head not in predicates:
                hint = did_you_mean(node.head, predicates)
                yield Finding(FORMULA, place, f"the planner's goal: no predicate '{node.head}'", hint)
            for item in map(literal, node.arguments) if objects_known else ():
                if item and item not in objects:
                    hint = did_you_mean(item, objects)
                    yield Finding(FORMULA, place, f"the planner's goal: no object '{item}'", hint)


def _check_types(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    """Yield the object types in facts that no domain declares."""
    known = {"object"} | {name for domain in domains for name, _ in pairs_of(domain.types)}
    known |= {above for domain in domains for _, above in pairs_of(domain.types) if above}
    assertions = agent.usage.made
    for _, fact in assertions.get("domain-object-type", ()):
        if "name" not in fact.slots:
            return  # the type is computed: any type is possible
        known |= fact.slots["name"]
    for construct, fact in assertions.get("domain-object", ()):
        name = next(iter(fact.slots.get("type", ())), "")
        if name and name not in known and not agent.is_of_core(construct.file.path):
            at, lines = construct.placed.start + fact.start, construct.file.lines
            place = SourcePlace(construct.file.path, lines.at(at), lines.column(at))
            yield Finding(TYPE, place, f"no domain has a type '{name}'", did_you_mean(name, known))


# ---- plan-actions


def _check_parameters(agent: Agent, domains: list[Domain]) -> Iterator[Finding]:
    actions = {
        action.name: [name.removeprefix("?") for name in names_of(action.parameters)]
        for domain in domains
        for action in domain.actions
    }
    agent_files = [file for file in agent.own_files if not agent.is_of_core(str(file.path))]
    for planned in source_actions(agent_files):
        if literal(planned.name) in actions:
            yield from _check_plan_action(planned, actions[literal(planned.name)])


def _check_plan_action(planned: SourceAction, parameter_names: list[str]) -> Iterator[Finding]:
    name, file = literal(planned.name), planned.file
    it_has = f"it has: {', '.join(parameter_names) or 'none'}"
    for argument_name in planned.names or ():
        if literal(argument_name) and literal(argument_name) not in parameter_names:
            message = f"the action '{name}' has no parameter '{literal(argument_name)}'"
            yield Finding(
                PARAMETERS,
                file.place(argument_name),
                message,
                did_you_mean(literal(argument_name), parameter_names, it_has),
            )
            return
    for slot, values in (("param-names", planned.names), ("param-values", planned.values)):
        number = None if values is None else count(values)
        if number is not None and number != len(parameter_names):
            message = (
                f"the action '{name}' has {len(parameter_names)} parameters, and here are {number} in {slot}"
            )
            yield Finding(PARAMETERS, file.place(values[0] if values else planned.node), message, it_has)
            return


# ---- executors


def _check_executed(agent: Agent, parsed: list[_Parsed]) -> Iterator[Finding]:
    if agent.context.skill_board is not None:
        return  # Executors announce their actions at run time.
    mapped = set(action_mapping(agent.config, agent.spec))
    usage = agent.usage
    if not mapped and any(_takes_any_action(each) for each in usage.constructs if not _is_core(agent, each)):
        return  # all actions are executed by rules
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
    reported = mapped | named
    for file in agent.model.files:
        for mention in () if agent.is_of_core(file.path) else file.mentions:
            name = mention.name.text
            is_planned = mention.name.kind is NameKind.ACTION and mention.use in (Use.ASSERTED, Use.NAMED)
            if is_planned and name in operators - reported:
                reported.add(name)
                at = SourcePlace(file.path, file.lines.at(mention.start), file.lines.column(mention.start))
                hint = did_you_mean(name, mapped - operators)
                yield Finding(NOT_EXECUTED, at, f"the action '{name}' has no executor", hint)
    planner = next((call for call in _planner_calls(agent)), None)
    for each in parsed if planner is not None else ():
        for action in each.domain.actions:
            if action.name not in reported:
                reported.add(action.name)
                message = f"the action '{action.name}', which a planner may plan, has no executor"
                hint = did_you_mean(action.name, mapped - operators)
                yield Finding(NOT_EXECUTED, each.file.place(each.call), message, hint)


def _is_core(agent: Agent, construct: Construct) -> bool:
    return agent.is_of_core(construct.file.path)


def _takes_any_action(construct: Construct) -> bool:
    """Return whether a rule matches plan-actions of any name and modifies them."""
    return any(
        pattern.template == "plan-action" and "action-name" not in pattern.slots
        for pattern in construct.patterns
    ) and any(node.head == "modify" for action in construct.actions for node in action.walk())


def _planner_calls(agent: Agent) -> Iterator[tuple[ClipsFile, SyntaxNode]]:
    for file in agent.own_files:
        for call in file.calls(*_PLANNERS):
            yield file, call
