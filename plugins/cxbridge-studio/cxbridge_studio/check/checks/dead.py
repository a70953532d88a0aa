"""Checks for rules, facts, goal classes and functions that are never used, and for unhandled sub-types.

Only the agent's own files are checked, because a core is a library, and no agent uses all of it. A text or a
computed word may name anything, so the check reports nothing if in doubt.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.printing import format_count
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent import sub_types
from cxbridge_studio.agent.clips import CHANGE_FUNCTIONS
from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.agent import Agent, read_first_argument
from cxbridge_studio.check.findings import Code, Finding, Severity
from cxbridge_studio.check.usage import PROGRAM_TEMPLATES, Construct, FactUse, Usage

UNMATCHED_RULE: Final = Code(
    "CX501",
    Severity.WARNING,
    "a rule that nothing can match",
    "The rule needs a fact that nothing asserts: no rule, function or deffacts has a fact of this template, "
    "or only facts with another number of fields, and neither the program nor an interface makes one. The "
    "rule never fires.",
)
UNREAD_FACT: Final = Code(
    "CX502",
    Severity.WARNING,
    "a fact that no rule matches",
    "Rules assert facts of this template, and no pattern or query in any file reads the facts.",
)
UNFORMULATED_GOAL: Final = Code(
    "CX503",
    Severity.WARNING,
    "a goal class that nothing formulates",
    "Rules wait for goals of this class, and no action of a rule or function names the class: no goal ever "
    "has this class.",
)
UNSELECTED_GOAL: Final = Code(
    "CX504",
    Severity.WARNING,
    "a goal class that nothing selects",
    "No rule that matches goals of this class selects the goals: they stay FORMULATED.",
)
UNEXPANDED_GOAL: Final = Code(
    "CX505",
    Severity.WARNING,
    "a goal class that nothing expands",
    "Goals of this class are formulated, and no rule handles a SELECTED goal of the class: no rule gives "
    "the goal a plan or another mode, calls a planner, or calls a function. The goal stays SELECTED "
    "forever.",
)
UNCALLED_FUNCTION: Final = Code(
    "CX506",
    Severity.WARNING,
    "a function that is never called",
    "No file calls the function, and no text or list of words contains its name.",
)
UNHANDLED_SUB_TYPE: Final = Code(
    "CX508",
    Severity.WARNING,
    "a sub-type that no rule handles",
    "A goal has this sub-type, literally or from a function of the core, and no loaded rule commits goals of "
    "this sub-type to a sub-goal: the name is misspelt, or the spec lacks the file with the rules. The goal "
    "stays EXPANDED.",
)

CODES: Final = (
    UNMATCHED_RULE,
    UNREAD_FACT,
    UNFORMULATED_GOAL,
    UNSELECTED_GOAL,
    UNEXPANDED_GOAL,
    UNCALLED_FUNCTION,
    UNHANDLED_SUB_TYPE,
)

# The facts that CLIPS 6.30 asserts at the start, and CLIPS 6.4 does not.
_INITIAL_FACTS: Final = ("initial-fact", "initial-object")
# The defaults of the slots by which rules choose the goals that they expand.
_SLOT_DEFAULTS: Final = {"sub-type": "nil", "type": "ACHIEVE"}
_SELECTING_SLOTS: Final = frozenset({"class", "type", "sub-type"})
_MODES_AFTER_EXPANDED: Final = ("COMMITTED", "DISPATCHED", "FINISHED")  # modes that can follow EXPANDED
# Functions whose call does not change a goal.
_HARMLESS_FUNCTIONS: Final = frozenset(
    {"printout", "format", "println", "bind", "str-cat", "sym-cat", "create$"}
)


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the unused rules, facts, goal classes and functions, and the unhandled sub-types."""
    usage = agent.usage
    own_constructs = [construct for construct in agent.own_constructs if agent.is_loaded(construct)]
    yield from _check_rules(agent, usage, own_constructs)
    yield from _check_facts(agent, usage, own_constructs)
    yield from _check_goals(agent, usage, own_constructs)
    yield from _check_functions(usage, own_constructs)


# ---- rules and facts


def _check_rules(agent: Agent, usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    """Yield the rules with a pattern that no fact can match."""
    for construct in own_constructs:
        for pattern in construct.patterns:
            if (problem := _find_pattern_problem(agent, usage, pattern)) is not None:
                reason, hint = problem
                message = f"defrule {construct.name} can never match: {reason}"
                yield Finding(UNMATCHED_RULE, construct.place(pattern.start), message, hint)
                break  # a single unmatched pattern disables the rule


def _find_pattern_problem(agent: Agent, usage: Usage, pattern: FactUse) -> tuple[str, str] | None:
    """Return the reason why no fact can match a pattern, and a hint; None if a fact may match."""
    name = pattern.template
    if name not in usage.asserted_facts:
        if name in _INITIAL_FACTS:
            hint = f"omit ({name}): a rule without a pattern fires at the start"
            return f"CLIPS 6.4 has no '{name}'", hint
        if not usage.is_made_elsewhere(name):
            return f"nothing asserts a fact '{name}'", did_you_mean(name, set(usage.asserted_facts) - {name})
    counts = _count_fields(agent, usage, name)
    if pattern.field_counts is None or not counts:
        return None
    minimum, maximum = pattern.field_counts
    if any(minimum <= most_fields and fewest_fields <= maximum for fewest_fields, most_fields in counts):
        return None
    counts_text = " or ".join(str(fewest_fields) for fewest_fields, _ in sorted(set(counts)))
    needed_text = f"{minimum} or more fields" if maximum > minimum else format_count(minimum, "field")
    first_count, _ = counts[0]
    return (
        f"({name} ...) needs {needed_text}, but facts '{name}' have {counts_text}",
        f"write ({name}{' ?' * first_count}), or $? for any number of fields",
    )


def _count_fields(agent: Agent, usage: Usage, template: str) -> list[tuple[int, float]]:
    """Return the minimum and the maximum number of fields of each asserted ordered fact of a template.

    The list is empty if the numbers are unknown.
    """
    assertion_counts = [
        fact.field_counts
        for _, fact in usage.asserted_facts.get(template, ())
        if fact.field_counts is not None
    ]
    if template in agent.deftemplates or template in usage.list_heads_in_strings:
        return []
    if template == "time":
        # A time is a multifield of two numbers in Fawkes, and a single number in the ROS 2 CX.
        time_field_count = len(agent.eval_words("(now)")) or 1
        return [*assertion_counts, (time_field_count, time_field_count)]
    return [] if usage.is_made_elsewhere(template) else assertion_counts


def _check_facts(agent: Agent, usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    """Yield the facts that no rule matches and no query reads."""
    read_templates = usage.model.find_names(NameKind.TEMPLATE, Use.MATCHED, Use.QUERIED)
    reported_names: set[str] = set()
    for construct in own_constructs:
        for fact in construct.facts:
            name = fact.template
            if (
                name in reported_names | read_templates
                or name in usage.list_heads_in_strings
                or PROGRAM_TEMPLATES.fullmatch(name)
            ):
                continue
            asserting_pieces = {
                asserting_construct.placed_piece
                for asserting_construct, _ in usage.asserted_facts.get(name, ())
            }
            if usage.literal_counts[name] > len(asserting_pieces):
                continue  # the word is also an argument, perhaps of a function that queries such facts
            if not agent.model.is_defined(Name(NameKind.TEMPLATE, name)) and name in agent.deftemplates:
                continue  # a feature defines the deftemplate, and may read the facts
            reported_names.add(name)
            hint = did_you_mean(name, read_templates - {name})
            yield Finding(
                UNREAD_FACT, construct.place(fact.start), f"no rule matches the fact '{name}'", hint
            )


# ---- goals


def _check_goals(agent: Agent, usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    """Yield the goal classes that nothing formulates, selects or expands, and the unhandled sub-types."""
    words_in_use = {word for construct in usage.constructs for word in construct.action_words}
    words_in_use |= usage.configured_words
    reported_names: set[str] = set()
    findings_by_goal = dict(_find_unhandled_sub_types(agent, usage, own_constructs))
    yield from findings_by_goal.values()
    for construct in own_constructs:
        for pattern in construct.patterns:
            names = pattern.words_by_slot.get("class", ()) if pattern.template == "goal" else ()
            # Each class of a constraint such as (class A|B) needs a goal.
            for name in sorted({*names} - words_in_use - reported_names):
                reported_names.add(name)
                asserted_goals = usage.asserted_facts.get("goal", ())
                classes = {word for _, goal in asserted_goals for word in goal.words_by_slot.get("class", ())}
                yield Finding(
                    UNFORMULATED_GOAL,
                    construct.place(pattern.start),
                    f"nothing formulates a goal of class {name}, which defrule {construct.name} needs",
                    did_you_mean(name, classes),
                )
        for fact in construct.facts:
            name = next(iter(fact.words_by_slot.get("class", ())), "")
            if fact.template == "goal" and name and name not in reported_names:
                reported_names.add(name)
                if (construct, fact.start) not in findings_by_goal:
                    yield from _check_life_cycle(agent, usage, construct, fact, name)


def _check_life_cycle(
    agent: Agent, usage: Usage, construct: Construct, goal: FactUse, goal_class: str
) -> Iterator[Finding]:
    """Yield a finding if an asserted goal is never selected, or never expanded after its selection.

    :param construct: the construct that asserts the goal.
    """
    if "mode" in goal.words_by_slot and "FORMULATED" not in goal.words_by_slot["mode"]:
        return  # the rule that asserts the goal has done the steps up to this mode
    setter_functions = {
        function.name
        for function in usage.constructs
        if function.keyword == "deffunction" and function.sets_mode("SELECTED")
    }
    place = construct.place(goal.start)
    if not any(
        _can_advance(rule, goal, "FORMULATED", "SELECTED", setter_functions) for rule in usage.constructs
    ):
        yield Finding(UNSELECTED_GOAL, place, f"nothing selects goals of class {goal_class}")
    elif not any(_can_expand(agent, rule, goal, goal_class) for rule in usage.constructs):
        yield Finding(UNEXPANDED_GOAL, place, f"nothing expands goals of class {goal_class}")


def _can_expand(agent: Agent, construct: Construct, goal: FactUse, goal_class: str) -> bool:
    """Return whether a construct may expand a goal with these slots after its selection.

    A pattern of the core without class, type and sub-type does not count, because the core's rules for all
    goals wait for the agent's rules.
    """
    # A rule that compares the class may handle the goal in a way that its patterns do not show.
    if goal_class in construct.compared_words:
        return True
    if not any(node.head and node.head not in _HARMLESS_FUNCTIONS for node in construct.action_nodes):
        return False
    is_core_path = agent.is_core_path(construct.file.path)
    return any(
        _matches_goal(pattern, goal, "SELECTED")
        for pattern in construct.patterns
        if not is_core_path or pattern.words_by_slot.keys() & _SELECTING_SLOTS
    )


def _can_advance(
    rule: Construct,
    goal: FactUse,
    mode: str,
    next_mode: str,
    setter_functions: set[str],
    *,
    needs_class: bool = False,
) -> bool:
    """Return whether a rule matches a goal with these slots in a mode, and may set the next mode.

    :param setter_functions: the functions that set the next mode.
    :param needs_class: whether the rule must match the class of the goal.
    """
    if not rule.sets_mode(next_mode) and not rule.action_literals & setter_functions:
        return False
    return any(
        _matches_goal(pattern, goal, mode)
        and (not needs_class or "class" in pattern.words_by_slot.keys() & goal.words_by_slot)
        for pattern in rule.patterns
    )


def _matches_goal(pattern: FactUse, goal: FactUse, mode: str) -> bool:
    """Return whether a pattern matches a goal with these slots in a mode."""
    if pattern.template != "goal" or mode not in pattern.words_by_slot.get("mode", {mode}):
        return False
    # A computed sub-type may be any word; an omitted sub-type has the default value.
    defaults = _SLOT_DEFAULTS if "sub-type" not in goal.slot_names else {"type": _SLOT_DEFAULTS["type"]}
    slots = {slot: words for slot, words in pattern.words_by_slot.items() if slot in _SELECTING_SLOTS}
    return FactUse("goal", 0, slots, pattern.slot_names).can_match(goal, defaults)


# ---- sub-types


def _find_unhandled_sub_types(
    agent: Agent, usage: Usage, own_constructs: list[Construct]
) -> Iterator[tuple[tuple[Construct, int], Finding]]:
    """Yield the construct, the offset and a finding for each goal with a sub-type that no rule handles."""
    handled_sub_types = frozenset().union(
        *(sub_types.find_handled_sub_types(rule.condition) for rule in usage.constructs)
    )
    compared_words = usage.configured_words.union(*(rule.compared_words for rule in usage.constructs))
    files = sub_types.find_core_files(*agent.context.paths.override_dirs, agent.context.paths.core_dir)
    for construct, goal, start in _find_sub_type_uses(
        agent, usage, own_constructs, handled_sub_types | files.keys()
    ):
        for name in goal.words_by_slot[sub_types.SUB_TYPE_SLOT].difference(
            handled_sub_types, compared_words, {sub_types.NO_SUB_TYPE}
        ):
            hint = sub_types.make_hint(name, handled_sub_types, files)
            # A hint means that the name is a likely mistake. Then only a rule for the class of the goal shows
            # that the name is no mistake.
            is_handled = any(
                _can_advance(rule, goal, "EXPANDED", mode, set(), needs_class=bool(hint))
                for rule in usage.constructs
                for mode in _MODES_AFTER_EXPANDED
            )
            if not is_handled:
                message = f"no rule handles goals of the sub-type {name}"
                yield (construct, start), Finding(UNHANDLED_SUB_TYPE, construct.place(start), message, hint)


def _find_sub_type_uses(
    agent: Agent, usage: Usage, own_constructs: list[Construct], names: frozenset[str]
) -> Iterator[tuple[Construct, FactUse, int]]:
    """Yield the goals with a literal sub-type: asserted, modified, or made by functions of the core.

    Each result has the construct, the goal, and the offset of the assertion or call in the construct.

    :param names: the sub-types that functions of the core may assign.
    """
    core_functions = {
        function.name: assigned_sub_types
        for function in usage.constructs
        if function.keyword == "deffunction" and agent.is_core_path(function.file.path)
        if (assigned_sub_types := function.action_literals & names)
    }
    # A `modify` does not name its template. The slot tells that a goal is modified only if no other template
    # has a slot of this name.
    is_goal_slot = not any(
        sub_types.SUB_TYPE_SLOT in slots for name, slots in agent.slots.items() if name != "goal"
    )
    for construct in own_constructs:
        for fact in construct.facts:
            if fact.template == "goal" and sub_types.SUB_TYPE_SLOT in fact.words_by_slot:
                yield construct, fact, fact.start
        for node in construct.action_nodes:
            if node.head in CHANGE_FUNCTIONS and is_goal_slot:
                slots = {
                    argument.head: frozenset({name})
                    for argument in node.arguments
                    if argument.head == sub_types.SUB_TYPE_SLOT and (name := read_first_argument(argument))
                }
            elif node.head in core_functions:
                slots = {sub_types.SUB_TYPE_SLOT: core_functions[node.head]}
                if name := read_first_argument(node):
                    slots["class"] = frozenset({name})
            else:
                continue
            if slots:
                yield construct, FactUse("goal", node.start, slots, frozenset(slots)), node.start


# ---- functions


def _check_functions(usage: Usage, own_constructs: list[Construct]) -> Iterator[Finding]:
    """Yield the functions that nothing calls."""
    called_names = usage.model.find_names(NameKind.FUNCTION, Use.CALLED) | usage.configured_words
    for construct in own_constructs:
        name = construct.name
        if construct.keyword != "deffunction" or name in called_names:
            continue
        # An occurrence of the name in another construct may be an argument of funcall, apply or eval.
        occurrences_elsewhere = usage.literal_counts[name] - (name in construct.action_literals)
        if not occurrences_elsewhere and name not in usage.list_heads_in_strings:
            place = construct.place(construct.node.arguments[0].start)
            yield Finding(UNCALLED_FUNCTION, place, f"nothing calls the function '{name}'")
