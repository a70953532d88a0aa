"""Items to formulas: conditions and effects."""

from __future__ import annotations

import re
from typing import Final

from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Position,
    Quantified,
    Term,
    TermComparison,
    Timed,
    TypedList,
    TypedNames,
    Variable,
    When,
)
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error

NAME: Final = re.compile(r"[a-zA-Z0-9][a-zA-Z0-9_-]*")
_TIMES: Final = {("at", "start"), ("at", "end"), ("over", "all")}
_COMPARISONS: Final = frozenset({"=", "<", ">", "<=", ">="})
_CHANGES: Final = frozenset({"increase", "decrease", "assign", "scale-up", "scale-down"})
_FAWKES_CHANGES: Final = frozenset({"increase", "decrease"})
_KEYWORDS: Final = frozenset({"and", "or", "not", "imply", "exists", "forall", "when"})
_FAWKES_PREFIXES: Final = ("exists", "forall")
_FAWKES_EFFECT_PREFIXES: Final = ("when", "increase", "decrease")
_TWO: Final = 2


class FormulaParser:
    """Makes formulas of items.

    :param file: the file to name in errors.
    :param fawkes_compat: refuse what Fawkes' parser refuses, see docs/pddl.md.
    """

    def __init__(self, file: str = "", *, fawkes_compat: bool = False) -> None:
        self.file = file
        self.fawkes_compat = fawkes_compat

    def error(self, message: str, position: Position, hint: str | None = None) -> PddlSyntaxError:
        """Return a syntax error in this file."""
        return syntax_error(message, position, self.file, hint)

    # ---- names and typed lists

    def name(self, item: Item, what: str) -> str:
        """Return the text of an item that must be a name."""
        if isinstance(item, Group):
            raise self.error(f"{what} is expected, not a bracket", item.position)
        if not NAME.fullmatch(item.text):
            raise self.error(
                f"'{item.text}' is not {what}",
                item.position,
                "a name has letters, digits, '-' and '_', and starts with a letter or digit",
            )
        return item.text

    def variable(self, item: Item, what: str) -> str:
        """Return the name of an item that must be a variable, without its question mark."""
        if isinstance(item, BracketWord) and item.text.startswith("?") and NAME.fullmatch(item.text, 1):
            return item.text[1:]
        text = f"'{item.text}'" if isinstance(item, BracketWord) else "a bracket"
        raise self.error(f"{text} is not {what}", item.position, "write a variable such as ?x")

    def typed_list(self, items: tuple[Item, ...], what: str, *, variables: bool) -> TypedList:
        """Return the groups of a typed list: ``a b - c d``."""
        read = self.variable if variables else self.name
        groups: list[TypedNames] = []
        names: list[str] = []
        start: Position | None = None
        rest = iter(items)
        for item in rest:
            start = start or item.position
            if not (isinstance(item, BracketWord) and item.text == "-"):
                names.append(read(item, what))
                continue
            type_item = next(rest, None)
            if not names or type_item is None:
                raise self.error(f"'-' must be between {what} and its type", item.position)
            groups.append(TypedNames(tuple(names), self._types(type_item), start))
            names, start = [], None
        if names:
            groups.append(TypedNames(tuple(names), (), start or Position()))
        return tuple(groups)

    def _types(self, item: Item) -> tuple[str, ...]:
        if isinstance(item, BracketWord):
            return (self.name(item, "a type"),)
        if item.head != "either" or len(item.items) == 1:
            raise self.error("a type is expected", item.position, "write a name, or (either TYPE TYPE)")
        return tuple(self.name(each, "a type") for each in item.items[1:])

    # ---- formulas

    def condition(self, item: Item) -> Formula:
        """Return the formula of a condition."""
        return self._formula(item, effect=False)

    def effect(self, item: Item) -> Formula:
        """Return the formula of an effect."""
        return self._formula(item, effect=True)

    def _formula(self, item: Item, *, effect: bool) -> Formula:
        if isinstance(item, BracketWord):
            raise self.error(
                f"a formula is expected, not '{item.text}'",
                item.position,
                f"write ({item.text}), in brackets",
            )
        head, position = item.head, item.position
        if not item.items and not self.fawkes_compat:
            return And((), position)
        if not head:
            raise self.error("a formula must start with a word", position, "such as 'and' or a predicate")
        if self.fawkes_compat:
            self._refuse_like_fawkes(item, effect=effect)
        if head in _KEYWORDS:
            return self._keyword(item, effect=effect)
        if head in _COMPARISONS or (effect and head in _CHANGES):
            left, right = (self.term(each) for each in self._two(item, "arguments"))
            if head in _COMPARISONS:
                return TermComparison(head, left, right, position)
            return NumericChange(head, left, right, position)
        timed = self._timed(item)
        if timed is not None:
            return Timed(timed, self._formula(item.items[2], effect=effect), position)
        return self._atom(item)

    def _keyword(self, item: Group, *, effect: bool) -> Formula:
        head, position = item.head, item.position
        if head in ("and", "or"):
            parts = tuple(self._formula(part, effect=effect) for part in item.items[1:])
            return And(parts, position) if head == "and" else Or(parts, position)
        if head == "not":
            if len(item.items) != _TWO:
                raise self.error("'not' takes one formula", position, "write (not (and ...)) for several")
            return Not(self._formula(item.items[1], effect=effect), position)
        first, second = self._two(item, "parts")
        if head == "imply":
            return Imply(self._formula(first, effect=effect), self._formula(second, effect=effect), position)
        if head == "when":
            if not effect:
                raise self.error("'when' may only be in an effect", position, "use (imply ...)")
            return When(self._formula(first, effect=False), self._formula(second, effect=True), position)
        return self._quantified(head, first, second, position, effect=effect)

    def _quantified(
        self, head: str, variables: Item, part: Item, position: Position, *, effect: bool
    ) -> Quantified:
        if not isinstance(variables, Group) or not variables.items:
            hint = f"({head} (?x - TYPE) FORMULA)"
            raise self.error(f"'{head}' needs its variables in brackets", position, hint)
        typed = self.typed_list(variables.items, "a variable", variables=True)
        return Quantified(head, typed, self._formula(part, effect=effect), position)

    def _two(self, item: Group, what: str) -> tuple[Item, Item]:
        if len(item.items) != 1 + _TWO:
            raise self.error(f"'{item.head}' takes two {what}, but has {len(item.items) - 1}", item.position)
        return item.items[1], item.items[2]

    def _timed(self, item: Group) -> str | None:
        """Return the time, when this is a formula at a time and not a predicate that is called ``at``."""
        if len(item.items) != 3:  # noqa: PLR2004 - at, start, formula
            return None
        first, second, part = item.items
        if not (
            isinstance(first, BracketWord) and isinstance(second, BracketWord) and isinstance(part, Group)
        ):
            return None
        if (first.text, second.text) not in _TIMES:
            return None
        return f"{first.text} {second.text}"

    def _atom(self, item: Group) -> Atom:
        head, position = item.head, item.position
        if head.lower() in _KEYWORDS:
            raise self.error(
                f"'{head}' must be written '{head.lower()}'", position, "keywords are in lower case"
            )
        if head.startswith("?"):
            raise self.error(f"the variable {head} cannot be a predicate", position)
        return Atom(head, tuple(self.term(each) for each in item.items[1:]), position)

    def term(self, item: Item) -> Term:
        """Return the term that an item is."""
        if isinstance(item, Group):
            if not item.head:
                raise self.error("a function is expected", item.position)
            return FunctionTerm(item.head, tuple(self.term(each) for each in item.items[1:]), item.position)
        if item.text.startswith("?"):
            if len(item.text) == 1:
                raise self.error("this variable has no name", item.position, "write it right after the '?'")
            return Variable(item.text[1:], item.position)
        return Constant(item.text, item.position)

    def _refuse_like_fawkes(self, item: Group, *, effect: bool) -> None:
        """Refuse what the grammar of Fawkes' parser cannot read although it is PDDL.

        Its keywords match prefixes and are not taken back, ``<`` hides ``<=``, and the words of a time must
        be one blank apart.
        """
        head, position = item.head, item.position
        prefixes = _FAWKES_PREFIXES + (_FAWKES_EFFECT_PREFIXES if effect else ())
        reason = None
        if head not in prefixes and head.startswith(prefixes):
            reason = f"it takes '{head}' for a keyword"
        elif head in ("<=", ">=", "imply") or (head in _CHANGES and head not in _FAWKES_CHANGES):
            reason = f"it does not know '{head}'"
        elif len(item.items) == 1 and head in _KEYWORDS:
            reason = f"Unknown predicate: {head}"
        elif self._timed(item) is not None:
            first, second = item.items[0].position, item.items[1].position
            if second != (first.line, first.column + len(head) + 1):
                reason = f"there must be exactly one blank after '{head}'"
        if reason:
            raise self.error(f"Fawkes' parser refuses this: {reason}", position)
