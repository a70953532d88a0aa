"""Evaluates expressions and patterns while a run is stopped.

CLIPS cannot evaluate an expression that has variables of a rule. Therefore the values of the variables
replace the variables in the text.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cxbridge.clipstext.syntax import SyntaxNode, read
from cxbridge.clipstext.values import FactRef, Value, quoted, show, show_alone
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.events import FactChange
from cxbridge_studio.dap.agent import StoppedEnvironment
from cxbridge_studio.dap.bindings import find_bindings, match_pattern
from cxbridge_studio.explain.rules.snapshot import Snapshot

_BINDERS = ("bind", "foreach")  # the functions whose first argument is a variable that they bind


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
    """Return the variables of the stopped rule, by their names without ``?``."""
    firing, variables = stopped_env.firing, stopped_env.read_local_variables()
    if variables is not None:
        return dict(variables)
    if firing is None:
        return {}
    return find_bindings(stopped_env.take_rule_snapshot(firing.rule), firing.basis, stopped_env.find_fact)


def evaluate(stopped_env: StoppedEnvironment, text: str) -> ExpressionResult:
    """Evaluate an expression, or find the facts that match a pattern."""
    text = text.strip()
    nodes = read(text)
    if len(nodes) == 1 and nodes[0].items is None and text.startswith(("?", "$?")) and "*" not in text:
        # a single local variable; a global variable, `?*name*`, is an expression
        name = text.lstrip("$?")
        variables = find_variables(stopped_env)
        if name in variables:
            return ExpressionResult(show_alone(variables[name]))
        if ":" not in name:  # ?fact:slot is an expression
            names = ", ".join(f"?{name}" for name in variables) or "none"
            raise ClipsError(f"there is no variable {text} here", hint=f"there are: {names}")
    head = nodes[0].head if len(nodes) == 1 else ""
    is_template = bool(head) and stopped_env.find_template(head) is not None
    if is_template and not stopped_env.has_function(head):
        return _find_matches(stopped_env, head, text)
    try:
        result = stopped_env.evaluate(expand_known_variables(text, stopped_env))
    except CxbridgeError:
        if is_template:  # a deftemplate that has the name of a function, e.g. time
            return _find_matches(stopped_env, head, text)
        raise
    return ExpressionResult(result.text, result.output)


def _find_matches(stopped_env: StoppedEnvironment, template: str, pattern: str) -> ExpressionResult:
    """Return the facts of a deftemplate that match a pattern."""
    fact_template, facts = stopped_env.find_template(template), stopped_env.read_facts(template)
    assert fact_template is not None
    snapshot = Snapshot(stopped_env.agent, 0, "", {template: fact_template}, ())
    matching_indices = set(
        match_pattern(snapshot, expand_known_variables(pattern, stopped_env), {template: facts})
    )
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
    nodes = read(text)
    bound_names = {name for node in nodes for name in _find_bound_names(node)}
    pieces: list[str] = []
    position = 0
    for root in nodes:
        for node in root.walk():
            if node.items is not None or not node.text.startswith(("?", "$?")):
                continue
            name, _, slot = node.text.lstrip("$?").partition(":")
            if name in variables and name not in bound_names:
                value = _format_value(variables[name], slot)
                pieces += (text[position : node.start], value)
                position = node.end
    return "".join((*pieces, text[position:]))


def _find_bound_names(root: SyntaxNode) -> set[str]:
    """Return the variables that a list binds."""
    names = set()
    for node in root.walk():
        if node.items:
            first = node.items[1] if node.head in _BINDERS and len(node.items) > 1 else node.items[0]
            if first.items is None and first.text.startswith(("?", "$?")):
                names.add(first.text.lstrip("$?"))
    return names


def _format_value(value: Value, slot: str = "") -> str:
    """Return a value in CLIPS syntax."""
    if isinstance(value, FactRef):
        return f"(fact-slot-value {value.index} {slot})" if slot else str(value.index)
    if isinstance(value, tuple):
        return f"(create$ {' '.join(_format_value(field) for field in value)})"
    # not isinstance(): a symbol is a subclass of str
    return quoted(value) if type(value) is str else show(value)
