"""Evaluates expressions and patterns while a run is stopped.

CLIPS cannot evaluate an expression that has variables of a rule. Therefore the values of the variables
replace the variables in the text.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, read_nodes
from cxbridge.clipstext.values import FactRef, Value, lone_value_text, quoted, value_text
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.events import FactChange
from cxbridge.executive.host.facts.copying import FactTemplate
from cxbridge_studio.dap.agent import StoppedEnvironment
from cxbridge_studio.dap.bindings import find_bindings, match_pattern
from cxbridge_studio.dap.rule_lines import read_variable_name
from cxbridge_studio.debugger.evaluating import evaluate as evaluate_text
from cxbridge_studio.explain.rules.environment import take_snapshot
from cxbridge_studio.explain.rules.snapshot import Snapshot

_BINDERS: Final = ("bind", "foreach")  # the functions whose first argument is a variable that they bind


@dataclass(frozen=True, slots=True)
class ExpressionResult:
    """The result of an evaluation.

    :param text: the value, or the number of facts that match a pattern.
    :param output: the printed lines.
    :param facts: the facts that match a pattern.
    """

    text: str
    output: tuple[str, ...] = ()
    facts: tuple[FactChange, ...] = ()


def find_variables(stopped_env: StoppedEnvironment) -> dict[str, Value]:
    """Return the variables of the stopped rule, by their names without ``?``; empty between two loops.

    :raises ClipsError: if the rule or one of its facts is unknown, or the condition cannot be matched.
    """
    firing, probes = stopped_env.firing, stopped_env.agent.probes
    if probes is not None and probes.values is not None:
        return dict(probes.values)
    if firing is None:
        return {}
    rule_without_facts = take_snapshot(stopped_env.env, firing.rule, max_facts=0)
    return find_bindings(rule_without_facts, firing.basis, stopped_env.find_fact)


def evaluate(stopped_env: StoppedEnvironment, text: str) -> ExpressionResult:
    """Evaluate an expression, or find the facts that match a pattern.

    :raises ClipsError: if the text is neither, a variable is unknown, or the evaluation fails.
    """
    text = text.strip()
    nodes = read_nodes(text)
    name = read_variable_name(nodes[0]) if len(nodes) == 1 else ""
    if name and ":" not in name:  # ?fact:slot is an expression
        variables = find_variables(stopped_env)
        if name in variables:
            return ExpressionResult(lone_value_text(variables[name]))
        names = ", ".join(f"?{name}" for name in variables) or "none"
        raise ClipsError(f"there is no variable {text} here", hint=f"there are: {names}")
    expanded_text = expand_known_variables(text, stopped_env)
    try:
        result = evaluate_text(stopped_env.env, expanded_text)
    except CxbridgeError:
        # An expression first, since a deftemplate may have the name of a function, such as time. CLIPS
        # evaluates no part of a pattern: it refuses the deftemplate's name as an unknown function.
        template = stopped_env.find_template(nodes[0].head) if len(nodes) == 1 else None
        if template is None:
            raise
        return _find_matches(stopped_env, template, expanded_text)
    return ExpressionResult(result.text, result.output)


def _find_matches(stopped_env: StoppedEnvironment, template: FactTemplate, pattern: str) -> ExpressionResult:
    """Return the facts of a deftemplate that match a pattern."""
    facts = stopped_env.read_facts(template.name)
    snapshot = Snapshot(stopped_env.env.name, 0, "", {template.name: template}, ())
    matching_indices = match_pattern(snapshot, pattern, facts)
    matching_facts = tuple(fact for fact in facts if fact.index in matching_indices)
    return ExpressionResult(f"{len(matching_facts)} of {len(facts)} facts match", facts=matching_facts)


def expand_known_variables(text: str, stopped_env: StoppedEnvironment) -> str:
    """Replace the variables of the stopped rule by their values; return the text unchanged if that fails."""
    if "?" not in text:
        return text
    try:
        return expand_variables(text, find_variables(stopped_env))
    except CxbridgeError:
        return text


def expand_variables(text: str, variables: Mapping[str, Value]) -> str:
    """Replace variables by their values, except the variables that the expression itself binds.

    ``?fact:slot`` becomes an expression for the value of the slot. CLIPS accepts the index of a fact as the
    fact.
    """
    nodes = read_nodes(text)
    bound_names = {name for node in nodes for name in _find_bound_names(node)}
    pieces: list[str] = []
    position = 0
    for node in (node for root in nodes for node in root.walk()):
        name, _, slot = read_variable_name(node).partition(":")
        if name in variables and name not in bound_names:
            pieces += (text[position : node.start], _format_value(variables[name], slot))
            position = node.end
    return "".join((*pieces, text[position:]))


def _find_bound_names(root: SyntaxNode) -> Iterator[str]:
    """Yield the variables that an expression binds, and ``""`` for each list that binds none.

    A call of ``bind`` or ``foreach`` binds its first argument, another list its first word, such as ``f`` in
    ``((?f goal))``.
    """
    for node in root.walk():
        if node.items:
            binder_arguments = node.arguments if node.head in _BINDERS else ()
            yield read_variable_name((binder_arguments or node.items)[0])


def _format_value(value: Value, slot: str = "") -> str:
    """Return a value in CLIPS syntax.

    :param slot: the slot to read if the value is a fact; empty for the fact itself.
    """
    if isinstance(value, FactRef):
        return f"(fact-slot-value {value.index} {slot})" if slot else str(value.index)
    if isinstance(value, tuple):
        return f"(create$ {' '.join(_format_value(field) for field in value)})"
    # not isinstance(): a symbol is a subclass of str
    return quoted(value) if type(value) is str else value_text(value)
