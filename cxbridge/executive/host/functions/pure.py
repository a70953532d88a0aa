"""Which deffunctions depend on nothing but their arguments, on globals and on facts.

As long as none of these changes, such a function gives the same answer again. It calls only built-ins without
effects and functions of the same kind. It reads facts only by queries whose deftemplates are written down.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import SyntaxNode

_WITHOUT_EFFECT: Final = frozenset(
    (
        *("+", "-", "*", "/", "div", "mod", "abs", "min", "max", "float", "integer", "round", "sqrt"),
        *("=", "<>", "<", "<=", ">", ">=", "eq", "neq", "and", "or", "not"),
        *("integerp", "floatp", "numberp", "symbolp", "stringp", "lexemep", "multifieldp", "evenp", "oddp"),
        *("create$", "nth$", "member$", "subsetp", "delete$", "insert$", "replace$", "subseq$", "first$"),
        *(
            "rest$",
            "length$",
            "length",
            "expand$",
            "implode$",
            "explode$",
            "delete-member$",
            "replace-member$",
        ),
        *("str-cat", "sym-cat", "str-index", "sub-string", "str-length", "str-compare", "upcase", "lowcase"),
        *("progn", "if", "while", "return", "break", "switch", "case", "default"),
    )
)
"""Built-ins of CLIPS whose answer depends on their arguments alone; words that steer an evaluation."""

_QUERIES: Final = frozenset(
    (
        *("any-factp", "find-fact", "find-all-facts", "do-for-fact", "do-for-all-facts"),
        "delayed-do-for-all-facts",
    )
)
_LOOPS: Final = frozenset(("progn$", "foreach", "loop-for-count"))


class PureFunction(Struct, frozen=True):
    """A deffunction whose answer depends on its arguments, on globals and on facts alone.

    :param parameters: with their question marks, a last ``$?rest`` as it is written.
    :param variables: the globals that it reads, those of the functions that it calls included: ``?*name*``.
    :param templates: the deftemplates whose facts it reads, likewise.
    :param calls: the functions that it calls, and those that they call.
    """

    name: str
    parameters: tuple[str, ...]
    variables: frozenset[str]
    templates: frozenset[str]
    calls: frozenset[str]


class _ImpureError(Exception):
    """Something in a function whose answer or effect is not known."""


class _Reading(Struct):
    """What has been found in a function so far."""

    variables: set[str]
    templates: set[str]
    calls: set[str]


class PureFunctions:
    """The pure functions of an environment, in the order in which they are defined."""

    def __init__(self) -> None:
        self._known: dict[str, PureFunction | None] = {}
        self._texts: dict[str, str] = {}

    def learn(self, node: SyntaxNode) -> PureFunction | None:
        """Look at a deffunction, defmethod or defgeneric that is to be defined; None when it is not pure."""
        name = node.arguments[0].text if node.arguments else ""
        self._known[name] = None
        found = self._read(name, node) if node.head == "deffunction" else None
        self._known[name], self._texts[name] = found, node.text
        return found

    def is_same(self, node: SyntaxNode) -> bool:
        """Whether a function that is to be defined is the one that is known by its name, or is new."""
        name = node.arguments[0].text if node.arguments else ""
        return self._texts.get(name, node.text) == node.text

    def _read(self, name: str, node: SyntaxNode) -> PureFunction | None:
        parts = node.arguments[1:]
        if parts and parts[0].items is None and parts[0].text.startswith('"'):
            parts = parts[1:]
        if not parts or parts[0].items is None:
            return None
        parameters = tuple(each.text for each in parts[0].items)
        reading = _Reading(set(), set(), set())
        try:
            self._see_all(parts[1:], frozenset(), reading)
        except _ImpureError:
            return None
        return PureFunction(
            name,
            parameters,
            frozenset(reading.variables),
            frozenset(reading.templates),
            frozenset(reading.calls),
        )

    def _see_all(self, nodes: Iterable[SyntaxNode], facts: frozenset[str], reading: _Reading) -> None:
        for node in nodes:
            self._see(node, facts, reading)

    def _see(self, node: SyntaxNode, facts: frozenset[str], reading: _Reading) -> None:
        """Look at an expression.

        :param facts: the variables of the queries around it.
        """
        if node.items is None:
            _see_word(node.text, facts, reading)
        elif node.head in _QUERIES:
            self._see_query(node.arguments, facts, reading)
        elif node.head in _LOOPS:
            self._see_loop(node.arguments, facts, reading)
        else:
            self._see_call(node, facts, reading)

    def _see_query(self, parts: tuple[SyntaxNode, ...], facts: frozenset[str], reading: _Reading) -> None:
        variables = set()
        for each in parts[0].items or () if parts else ():
            words = [word.text for word in each.items or ()]
            if len(words) < 2 or any(not _is_plain(word) for word in words[1:]):  # noqa: PLR2004
                raise _ImpureError
            variables.add(words[0])
            reading.templates.update(words[1:])
        self._see_all(parts[1:], facts | variables, reading)

    def _see_loop(self, parts: tuple[SyntaxNode, ...], facts: frozenset[str], reading: _Reading) -> None:
        if not parts:
            raise _ImpureError
        bounds = parts[0].items
        if bounds is None or not bounds or not bounds[0].text.startswith("?"):
            self._see(parts[0], facts, reading)
        else:
            self._see_all(bounds[1:], facts, reading)
        self._see_all(parts[1:], facts, reading)

    def _see_call(self, node: SyntaxNode, facts: frozenset[str], reading: _Reading) -> None:
        name = node.head
        if name == "bind":
            if not node.arguments or node.arguments[0].text.startswith("?*"):
                raise _ImpureError
        elif name in self._known:
            called = self._known[name]
            if called is None:
                raise _ImpureError
            reading.variables |= called.variables
            reading.templates |= called.templates
            reading.calls |= called.calls | {name}
        elif name not in _WITHOUT_EFFECT:
            raise _ImpureError
        self._see_all(node.arguments, facts, reading)


def _see_word(word: str, facts: frozenset[str], reading: _Reading) -> None:
    if word.startswith("?*"):
        reading.variables.add(word)
    elif word.startswith("?") and ":" in word and word.partition(":")[0] not in facts:
        raise _ImpureError  # a slot of a fact that came from somewhere else


def _is_plain(word: str) -> bool:
    return word[0] not in '?$("' and "::" not in word
