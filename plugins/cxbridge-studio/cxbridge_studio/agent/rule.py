"""Parses the conditions of rules, and finds their dependencies on functions and global variables.

``cxbridge why`` and the debugger match a condition in an isolated environment, which needs only these
definitions and the deftemplates.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from cxbridge.clipstext.syntax import SyntaxNode, compact, read_nodes, without_module
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.condition import CE, PatternCE, parse_elements, split_rule

_GLOBAL = re.compile(r"\$?\?\*(.+)\*\Z")
# Prefixes of functions that query facts of any template.
_QUERY_PREFIXES = ("do-for-", "delayed-do-for-", "find-fact", "find-all-facts", "any-factp", "get-fact-list")


class Prefix:
    """The conditional elements at the start of a condition, with a variable for the fact of each pattern.

    :ivar texts: the texts of the conditional elements.
    :ivar fact_variables: the names of the fact variables, in the order of the patterns.
    :ivar binding_ce_numbers: by variable, the number of the first conditional element that binds it, from 1.
    """

    def __init__(self, ces: Sequence[CE]) -> None:
        self.texts: list[str] = []
        self.fact_variables: list[str] = []
        self.binding_ce_numbers: dict[str, int] = {}
        for number, ce in enumerate(ces, 1):
            if not isinstance(ce, PatternCE):
                self.texts.append(ce.text)
                continue
            variable = ce.variable or f"cx-why-{number}"
            self.texts.append(f"?{variable} <- {ce.text_without_variable()}")
            self.fact_variables.append(variable)
            for name in (*ce.bound_variables, *filter(None, [ce.variable])):
                self.binding_ce_numbers.setdefault(name, number)

    @property
    def bound_variables(self) -> frozenset[str]:
        """The variables bound by these conditional elements."""
        return frozenset(self.binding_ce_numbers)


@dataclass(frozen=True, slots=True)
class Condition:
    """The left-hand side of a rule.

    :param rule: the name of the rule, without its module.
    :param salience: the salience expression; empty if the rule declares none.
    :param functions: the first words of all lists in the condition, which include the called functions.
    :param globals: the global variables that the condition reads, without ``?*`` and ``*``.
    """

    rule: str
    salience: str
    ces: tuple[CE, ...]
    functions: frozenset[str]
    globals: frozenset[str]


def parse_rule(text: str) -> Condition:
    """Parse a defrule.

    :raises ClipsError: if the text is not a defrule, lacks the arrow, or has a condition that is nested too
        deeply.
    """
    nodes = read_nodes(text)
    if len(nodes) != 1 or nodes[0].head != "defrule" or not nodes[0].arguments:
        raise ClipsError("this is not a defrule")
    name = without_module(nodes[0].arguments[0].text)
    if not any(node.text == "=>" for node in nodes[0].arguments):
        raise ClipsError(f"the rule {name} has no =>")
    condition = tuple(split_rule(nodes[0])[0])
    declarations = (item for node in condition if node.head == "declare" for item in node.arguments)
    saliences = [item.arguments[0] for item in declarations if item.head == "salience" and item.arguments]
    try:
        ces = tuple(parse_elements(condition))
    except RecursionError:
        raise ClipsError(f"the condition of {name} is nested too deeply") from None
    salience = compact(saliences[-1].text) if saliences else ""
    return Condition(name, salience, ces, find_called_names(condition), find_global_names(condition))


@dataclass(frozen=True, slots=True)
class Dependencies:
    """The dependencies of a condition on definitions other than templates.

    :param functions: the texts of the deffunctions that the condition calls, directly or not; callees first.
    :param globals: the global variables in the condition and in the functions.
    :param needs_all_facts: whether a function may query facts of any template.
    """

    functions: tuple[str, ...]
    globals: frozenset[str]
    needs_all_facts: bool


def find_dependencies(condition: Condition, find_function_text: Callable[[str], str | None]) -> Dependencies:
    """Return the dependencies of a condition.

    :param find_function_text: returns the text of a deffunction; None if no deffunction has the name.
    :raises ClipsError: if the calls are nested too deeply.
    """
    texts: dict[str, str] = {}
    function_names, global_names = set(condition.functions), set(condition.globals)

    def add_callees(names: frozenset[str]) -> None:
        for name in sorted(names):
            text = None if name in texts else find_function_text(name)
            if text is None:
                continue
            texts[name] = ""  # so that a recursive function is visited only once
            nodes = tuple(read_nodes(text))
            callees = find_called_names(nodes)
            function_names.update(callees)
            global_names.update(find_global_names(nodes))
            add_callees(callees)
            del texts[name]  # the new key comes after those of the callees
            texts[name] = text

    try:
        add_callees(condition.functions)
    except RecursionError:
        raise ClipsError(f"the functions of '{condition.rule}' call one another too deeply") from None
    queries_facts = any(word.startswith(_QUERY_PREFIXES) for word in function_names)
    return Dependencies(tuple(filter(None, texts.values())), frozenset(global_names), queries_facts)


def find_called_names(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the first words of all lists: the called functions, and the heads of other lists."""
    return frozenset(node.head for root in nodes for node in root.walk() if node.head)


def find_global_names(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    matches = (_GLOBAL.match(node.text) for root in nodes for node in root.walk() if node.items is None)
    return frozenset(match[1] for match in matches if match)
