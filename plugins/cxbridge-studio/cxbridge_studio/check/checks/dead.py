"""Checks for rules, facts, goal classes and functions that are never used.

Only the agent's own files are checked, because a core is a library, and no agent uses all of it. If in doubt,
the check reports nothing, since a text or a computed word may name anything.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent import sub_types
from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity
from cxbridge_studio.check.usage import OF_PROGRAM, Construct, FactUse, Usage

RULE: Final = Code(
    "CX501",
    Severity.WARNING,
    "a rule that nothing can match",
    "The rule needs a fact that nothing asserts: no rule, function or deffacts has a fact of this template, "
    "and neither the program nor an interface does. The rule never fires.",
)
FACT: Final = Code(
    "CX502",
    Severity.WARNING,
    "a fact that no rule matches",
    "Rules assert facts of this template, and no pattern or query in any file reads the facts.",
)
NOT_FORMULATED: Final = Code(
    "CX503",
    Severity.WARNING,
    "a goal class that nothing formulates",
    "Rules wait for goals of this class, and no action of a rule or function names the class: no goal ever "
    "has this class.",
)
NOT_SELECTED: Final = Code(
    "CX504",
    Severity.WARNING,
    "a goal class that nothing selects",
    "No rule that matches goals of this class selects the goals: they stay FORMULATED.",
)
NOT_EXPANDED: Final = Code(
    "CX505",
    Severity.WARNING,
    "a goal class that nothing expands",
    "Goals of this class are formulated, and no rule handles a SELECTED goal of the class: no rule gives "
    "the goal a plan or another mode, calls a planner, or calls a function. The goal stays SELECTED without "
    "end.",
)
FUNCTION: Final = Code(
    "CX506",
    Severity.WARNING,
    "a function that is never called",
    "No file calls the function, and no text or list of words contains its name.",
)
SUB_TYPE: Final = Code(
    "CX508",
    Severity.WARNING,
    "a sub-type that no rule handles",
    "A goal has this sub-type, literally or from a function of the core, and no loaded rule commits goals of "
    "this sub-type to a sub-goal: the name is misspelt, or the spec lacks the file with the rules. The goal "
    "stays EXPANDED.",
)

CODES: Final = (RULE, FACT, NOT_FORMULATED, NOT_SELECTED, NOT_EXPANDED, FUNCTION, SUB_TYPE)

# Facts that CLIPS 6.30 asserts at the start and CLIPS 6.4 does not.
_INITIAL: Final = ("initial-fact", "initial-object")
_TIME: Final = "time"
_CLASS: Final = "class"
# The default values of the goal slots by which rules select goals to expand.
_DEFAULTS: Final = {"sub-type": "nil", "type": "ACHIEVE"}
_GOAL: Final = "goal"
_SELECTING_SLOTS: Final = frozenset({"class", "type", "sub-type"})
_AFTER_EXPANDED: Final = ("COMMITTED", "DISPATCHED", "FINISHED")  # modes that can follow EXPANDED
_CHANGES: Final = frozenset({"modify", "duplicate", "cx-modify-goal"})
# Functions that do not change a goal.
_WITHOUT_EFFECT: Final = frozenset({"printout", "format", "println", "bind", "str-cat", "sym-cat", "create$"})


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the unused rules, facts, goal classes and functions."""
    usage = agent.usage
    # A dropped construct has a finding of another check, and the end of an unclosed construct is a guess.
    own_constructs = [
        construct
        for construct in agent.own_constructs
        if construct.placed.piece.closed
        and (construct.file.path, construct.keyword, construct.name) not in agent.dropped
    ]
    yield from _rules(agent, usage, own_constructs)
    yield from _facts(agent, usage, own_constructs)
    yield from _goals(agent, usage, own_constructs)
    yield from _functions(usage, own_constructs)


# ---- rules and facts


def _rules(agent: Agent, usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    for construct in own_constructs:
        for pattern in construct.patterns:
            problem = _pattern_problem(agent, usage, pattern)
            if problem is not None:
                reason, hint = problem
                message = f"defrule {construct.name} can never match: {reason}"
                yield Finding(RULE, construct.place(pattern.start), message, hint)
                break  # a single unmatched pattern disables the rule


def _pattern_problem(agent: Agent, usage: Usage, pattern: FactUse) -> tuple[str, str] | None:
    """Return the reason why no fact can match a pattern, and a hint; None if a fact can match."""
    name = pattern.template
    if name not in usage.asserted and name in _INITIAL:
        return (
            f"CLIPS 6.4 has no '{name}'",
            f"leave ({name}) out: a rule without a pattern fires at the start",
        )
    if name not in usage.asserted and not usage.is_made_elsewhere(name):
        return f"nothing asserts a fact '{name}'", did_you_mean(name, set(usage.asserted) - {name})
    counts = _field_counts(agent, usage, name)
    if pattern.count is None or not counts:
        return None
    minimum, maximum = pattern.count
    if any(minimum <= most_fields and fewest_fields <= maximum for fewest_fields, most_fields in counts):
        return None
    numbers = " or ".join(str(fewest_fields) for fewest_fields, _ in sorted(set(counts)))
    plural = "" if minimum == 1 else "s"
    expected_fields = f"{minimum} or more fields" if maximum > minimum else f"{minimum} field{plural}"
    example = f"({name}{' ?' * counts[0][0]})"
    return (
        f"({name} ...) asks for {expected_fields} here, and facts '{name}' have {numbers}",
        f"write {example}, or $? for any number of fields",
    )


def _field_counts(agent: Agent, usage: Usage, template: str) -> list[tuple[int, float]]:
    """Return the minimum and the maximum number of fields of each asserted ordered fact of a template.

    The list is empty if the numbers are unknown.
    """
    assertion_counts = [fact.count for _, fact in usage.asserted.get(template, ()) if fact.count is not None]
    if template in agent.deftemplates or template in usage.templates_in_texts:
        return []
    if template == _TIME:
        return [*assertion_counts, (agent.time_fields, agent.time_fields)]
    return [] if usage.is_made_elsewhere(template) else assertion_counts


def _facts(agent: Agent, usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    read = usage.model.names(NameKind.TEMPLATE, Use.MATCHED, Use.QUERIED)
    reported: set[str] = set()
    for construct in own_constructs:
        for fact in construct.facts:
            name = fact.template
            if name in reported | read or name in usage.templates_in_texts or OF_PROGRAM.fullmatch(name):
                continue
            asserting_constructs = {asserting.placed for asserting, _ in usage.asserted.get(name, ())}
            if usage.symbols[name] > len(asserting_constructs):
                continue  # the word is also an argument, perhaps of a function that queries such facts
            if not agent.model.is_defined(Name(NameKind.TEMPLATE, name)) and name in agent.deftemplates:
                continue  # a feature defines the deftemplate, and may read the facts
            reported.add(name)
            message = f"no rule matches the fact '{name}'"
            yield Finding(FACT, construct.place(fact.start), message, did_you_mean(name, read - {name}))


# ---- goals


def _goals(agent: Agent, usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    words_in_use = {word for construct in usage.constructs for word in construct.words}
    words_in_use |= usage.configured_words
    reported: set[str] = set()
    unhandled = dict(_sub_types(agent, usage, own_constructs))
    yield from unhandled.values()
    for construct in own_constructs:
        for pattern in construct.patterns:
            # Each class of a constraint such as (class A|B) needs a goal.
            for name in sorted(pattern.slots.get(_CLASS, ()) if pattern.template == _GOAL else ()):
                if name not in words_in_use | reported:
                    reported.add(name)
                    asserted_goals = usage.asserted.get(_GOAL, ())
                    classes = {word for _, goal in asserted_goals for word in goal.slots.get(_CLASS, ())}
                    message = (
                        f"nothing formulates a goal of class {name}, which defrule {construct.name} needs"
                    )
                    place = construct.place(pattern.start)
                    yield Finding(NOT_FORMULATED, place, message, did_you_mean(name, classes))
        for fact in construct.facts:
            name = next(iter(fact.slots.get(_CLASS, ())), "")
            if fact.template == _GOAL and name and name not in reported:
                reported.add(name)
                if (construct, fact.start) not in unhandled:
                    yield from _life_cycle(agent, usage, construct, fact, name)


def _life_cycle(
    agent: Agent, usage: Usage, construct: Construct, fact: FactUse, name: str
) -> Iterator[Finding]:
    """Yield a finding if an asserted goal is never selected, or never expanded after its selection."""
    if "mode" in fact.slots and "FORMULATED" not in fact.slots["mode"]:
        return  # the rule that asserts the goal also takes the steps up to this mode
    functions = (construct for construct in usage.constructs if construct.keyword == "deffunction")
    setters = {function.name for function in functions if function.sets_mode("SELECTED")}
    if not any(_leads(rule, fact, "FORMULATED", "SELECTED", setters) for rule in usage.constructs):
        yield Finding(NOT_SELECTED, construct.place(fact.start), f"nothing selects goals of class {name}")
    elif not any(_expands(agent, rule, fact, name) for rule in usage.constructs):
        yield Finding(NOT_EXPANDED, construct.place(fact.start), f"nothing expands goals of class {name}")


def _expands(agent: Agent, construct: Construct, goal: FactUse, name: str) -> bool:
    """Return whether a construct may change a goal like this goal after its selection.

    Rules of the core for goals of any class do not count, because they wait for the agent's rules.

    :param name: the class of the goal.
    """
    if name in construct.compared:
        return True
    if not any(node.head and node.head not in _WITHOUT_EFFECT for node in construct.action_nodes):
        return False
    is_of_core = agent.is_of_core(construct.file.path)
    return any(
        _fits(pattern, goal, "SELECTED")
        for pattern in construct.patterns
        if not is_of_core or pattern.slots.keys() & _SELECTING_SLOTS
    )


def _leads(
    rule: Construct, goal: FactUse, mode: str, next_mode: str, setters: set[str], *, by_class: bool = False
) -> bool:
    """Return whether a rule matches a goal like this goal in a mode, and can set the next mode.

    :param setters: the functions that set the next mode.
    :param by_class: whether the rule must match the class of the goal.
    """
    if not rule.sets_mode(next_mode) and not rule.symbols & setters:
        return False
    return any(
        _fits(pattern, goal, mode) and (not by_class or _CLASS in pattern.slots.keys() & goal.slots)
        for pattern in rule.patterns
    )


def _fits(pattern: FactUse, goal: FactUse, mode: str) -> bool:
    """Return whether a pattern matches a goal like this goal in a mode."""
    if pattern.template != _GOAL or mode not in pattern.slots.get("mode", {mode}):
        return False
    # A computed sub-type may be any word; an omitted sub-type has the default value.
    defaults = _DEFAULTS if "sub-type" not in goal.slot_names else {"type": _DEFAULTS["type"]}
    slots = {slot: words for slot, words in pattern.slots.items() if slot in _SELECTING_SLOTS}
    return FactUse(_GOAL, 0, slots, pattern.slot_names).fits(goal, defaults)


# ---- sub-types


def _sub_types(
    agent: Agent, usage: Usage, own_constructs: list[Construct]
) -> Iterator[tuple[tuple[Construct, int], Finding]]:
    """Yield the construct and offset of each goal with a sub-type that no rule handles, and the finding."""
    handled = frozenset().union(*(sub_types.handled(rule.condition) for rule in usage.constructs))
    compared = usage.configured_words.union(*(rule.compared for rule in usage.constructs))
    files = sub_types.files_of_core(*agent.context.paths.before, agent.context.paths.cx)
    for construct, goal, start in _with_sub_type(agent, usage, own_constructs, handled | files.keys()):
        for name in goal.slots[sub_types.SLOT] - handled - compared - {sub_types.NONE}:
            hint = sub_types.advice(name, handled, files)
            # If the name is a likely mistake, only a rule for the class of the goal shows that it is meant.
            is_led = any(
                _leads(rule, goal, "EXPANDED", mode, set(), by_class=bool(hint))
                for rule in usage.constructs
                for mode in _AFTER_EXPANDED
            )
            if not is_led:
                message = f"no rule handles goals of the sub-type {name}"
                yield (construct, start), Finding(SUB_TYPE, construct.place(start), message, hint)


def _with_sub_type(
    agent: Agent, usage: Usage, own_constructs: list[Construct], names: frozenset[str]
) -> Iterator[tuple[Construct, FactUse, int]]:
    """Yield the goals with a literal sub-type: asserted, modified, or made by functions of the core.

    :param names: the sub-types that functions of the core may assign.
    """
    core_functions = {
        function.name: assigned
        for function in usage.constructs
        if function.keyword == "deffunction" and agent.is_of_core(function.file.path)
        if (assigned := function.symbols & names)
    }
    # A `modify` does not name its template, so only a slot that no other template has identifies goals.
    is_of_goals = not any(sub_types.SLOT in agent.slots[name] for name in agent.slots.keys() - {_GOAL})
    for construct in own_constructs:
        for fact in construct.facts:
            if fact.template == _GOAL and sub_types.SLOT in fact.slots:
                yield construct, fact, fact.start
        for node in construct.action_nodes:
            if node.head in _CHANGES and is_of_goals:
                slots = {
                    item.head: frozenset({name})
                    for item in node.arguments
                    if item.head == sub_types.SLOT and (name := _first_word(item))
                }
            elif node.head in core_functions:
                slots = {sub_types.SLOT: core_functions[node.head]}
                if name := _first_word(node):
                    slots[_CLASS] = frozenset({name})
            else:
                continue
            if slots:
                yield construct, FactUse(_GOAL, node.start, slots, frozenset(slots)), node.start


def _first_word(node: SyntaxNode) -> str:
    """Return the first argument of a list; empty if it is missing or a list."""
    return literal(node.arguments[0]) if node.arguments else ""


# ---- functions


def _functions(usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    called = usage.model.names(NameKind.FUNCTION, Use.CALLED) | usage.configured_words
    for construct in own_constructs:
        name = construct.name
        if construct.keyword != "deffunction" or name in called:
            continue
        # Any other occurrence of the name may be an argument of funcall, apply or eval.
        occurrences_elsewhere = usage.symbols[name] - (name in construct.symbols)
        if not occurrences_elsewhere and name not in usage.templates_in_texts:
            place = construct.place(construct.node.arguments[0].start)
            yield Finding(FUNCTION, place, f"nothing calls the function '{name}'")
