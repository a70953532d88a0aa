"""Evaluates expressions and patterns while a target is stopped.

CLIPS cannot evaluate an expression with the variables of a rule, so their values are inserted into the text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from cxbridge.clipstext.syntax import SyntaxNode, read
from cxbridge.clipstext.values import FactRef, Value, quoted, show, show_alone
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.events import FactChange
from cxbridge_studio.dap.bindings import bindings, indices_of_matches
from cxbridge_studio.dap.target import StoppedEnvironment
from cxbridge_studio.explain.rules.snapshot import Snapshot

_BINDERS = ("bind", "foreach")  # the functions that bind the variable in their first argument


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


def variables_of(moment: StoppedEnvironment) -> dict[str, Value]:
    """Return the variables of the stopped rule, by name without ``?``."""
    firing, variables = moment.firing, moment.locals()
    if variables is not None:
        return dict(variables)
    if firing is None:
        return {}
    return bindings(moment.rule_without_facts(firing.rule), firing.basis, moment.fact)


def evaluate(moment: StoppedEnvironment, text: str) -> ExpressionResult:
    """Evaluate an expression, or find the facts that match a pattern."""
    text = text.strip()
    nodes = read(text)
    if len(nodes) == 1 and nodes[0].items is None and text.startswith(("?", "$?")) and "*" not in text:
        # A single local variable; a global variable, ``?*name*``, is an expression.
        name = text.lstrip("$?")
        variables = variables_of(moment)
        if name in variables:
            return ExpressionResult(show_alone(variables[name]))
        if ":" not in name:  # ?fact:slot is an expression
            names = ", ".join(f"?{name}" for name in variables) or "none"
            raise ClipsError(f"there is no variable {text} here", hint=f"there are: {names}")
    head = nodes[0].head if len(nodes) == 1 else ""
    is_template = bool(head) and moment.template(head) is not None
    if is_template and not moment.is_function(head):
        return _find_matches(moment, head, text)
    try:
        result = moment.evaluate(expand_known(text, moment))
    except CxbridgeError:
        if is_template:  # a deftemplate with the name of a function, such as time
            return _find_matches(moment, head, text)
        raise
    return ExpressionResult(result.text, result.output)


def _find_matches(moment: StoppedEnvironment, template: str, pattern: str) -> ExpressionResult:
    """Return the facts of a deftemplate that match a pattern."""
    fact_template, facts = moment.template(template), moment.facts(template)
    assert fact_template is not None
    snapshot = Snapshot(moment.agent, 0, "", {template: fact_template}, ())
    matching_indices = set(indices_of_matches(snapshot, expand_known(pattern, moment), {template: facts}))
    matching_facts = tuple(fact for fact in facts if fact.index in matching_indices)
    return ExpressionResult(f"{len(matching_facts)} of {len(facts)} facts match", facts=matching_facts)


def expand_known(text: str, moment: StoppedEnvironment) -> str:
    """Return an expression with the values of the stopped rule's variables inserted, as far as known."""
    if "?" not in text:
        return text
    try:
        return expand(text, variables_of(moment), moment.fact_expression)
    except CxbridgeError:
        return text


def expand(text: str, variables: Mapping[str, Value], fact_expression: Callable[[int], str] = str) -> str:
    """Insert the values of variables into an expression, except variables that the expression binds.

    ``?fact:slot`` becomes the slot's value.

    :param fact_expression: returns the expression for a fact by its index.
    """
    nodes = read(text)
    bound_names = {name for node in nodes for name in _bound_by(node)}
    pieces: list[str] = []
    position = 0
    for top in nodes:
        for node in top.walk():
            if node.items is not None or not node.text.startswith(("?", "$?")):
                continue
            name, _, slot = node.text.lstrip("$?").partition(":")
            if name in variables and name not in bound_names:
                value = _clips_text(variables[name], slot, fact_expression)
                pieces += (text[position : node.start], value)
                position = node.end
    return "".join((*pieces, text[position:]))


def _bound_by(top: SyntaxNode) -> set[str]:
    """Return the variables that a list binds."""
    names = set()
    for node in top.walk():
        if node.items:
            first = node.items[1] if node.head in _BINDERS and len(node.items) > 1 else node.items[0]
            if first.items is None and first.text.startswith(("?", "$?")):
                names.add(first.text.lstrip("$?"))
    return names


def _clips_text(value: Value, slot: str, fact_expression: Callable[[int], str]) -> str:
    """Return a value in CLIPS syntax."""
    if isinstance(value, FactRef):
        fact = fact_expression(value.index)
        return f"(fact-slot-value {fact} {slot})" if slot else fact
    if isinstance(value, tuple):
        return f"(create$ {' '.join(_clips_text(field, '', fact_expression) for field in value)})"
    # A symbol is a subclass of str.
    return quoted(value) if type(value) is str else show(value)
