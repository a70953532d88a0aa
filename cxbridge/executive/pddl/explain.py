"""Explanations of syntax errors in terms of their context.

The parser only knows an unexpected token and the permitted terminals. The brackets around the token
(:mod:`.brackets`) show which section, action or formula the author was writing, and so the probable mistake.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item, parse_items, token_words
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error
from cxbridge.executive.pddl.grammar import load_tables
from cxbridge.executive.pddl.reader import UnexpectedToken
from cxbridge.executive.pddl.tokens import SourceText
from cxbridge.executive.pddl.unsupported import unsupported_formula, unsupported_section, unsupported_texts
from cxbridge.suggestions import did_you_mean

# the noun of a text by start symbol of the grammar
_TEXT_NOUNS: Final = {"domain": "domain", "problem": "problem", "condition": "formula"}
_TYPED_SECTIONS: Final = {":types": "a type", ":constants": "a constant", ":objects": "an object"}
_DECLARATIONS: Final = {":predicates": "predicate", ":functions": "function"}
_ACTIONS: Final = frozenset({":action", ":durative-action"})
_QUANTIFIERS: Final = frozenset({"exists", "forall"})
# the heads that take exactly two operands, with the noun of their operands in messages
_OPERAND_NOUNS: Final = {
    "imply": "parts",
    "when": "parts",
    "exists": "parts",
    "forall": "parts",
} | dict.fromkeys(
    ("=", "<", ">", "<=", ">=", "increase", "decrease", "assign", "scale-up", "scale-down"), "arguments"
)
_NAME_HINT: Final = "a name has letters, digits, '-' and '_', and starts with a letter or digit"
_PAIR_LENGTH: Final = 2  # the number of items in `(HEAD PART)`
_OPERAND_COUNT: Final = 2


def unexpected_token_error(text: SourceText, symbol: str, unexpected: UnexpectedToken) -> PddlSyntaxError:
    """Return the error about an unexpected token, explained by the brackets around the token.

    :param symbol: the start symbol of the text.
    """
    try:
        items = parse_items(text)
    except PddlSyntaxError as bracket_error:  # a missing bracket explains the token, too
        return bracket_error
    return _Explainer(text, symbol, items, unexpected).explain()


class _Explainer:
    """The context of one unexpected token.

    Each method explains the error in one kind of context. A parameter ``path`` or ``inner`` has the groups
    around the token, outermost first.
    """

    def __init__(
        self, text: SourceText, symbol: str, items: tuple[Item, ...], unexpected: UnexpectedToken
    ) -> None:
        self._file = text.file
        self._symbol = symbol
        self._items = items
        self._expected = unexpected.expected
        self._position = text.position(unexpected.token.start)
        self._path = _groups_around(items, self._position)
        words = token_words(unexpected.token, text)
        self._word = words[0].text if unexpected.token.text not in ("(", ")") and words else ""
        self._group = next(
            (sibling for sibling in self._siblings() if sibling.position == self._position), None
        )

    def _siblings(self) -> tuple[Item, ...]:
        return self._path[-1].items if self._path else self._items

    def _error(
        self, message: str, position: Position | None = None, hint: str | None = None
    ) -> PddlSyntaxError:
        """Return an error, by default at the unexpected token."""
        return syntax_error(message, position or self._position, self._file, hint)

    def explain(self) -> PddlSyntaxError:
        return self._unsupported_error() or (
            self._formula_error(self._path)
            if self._symbol == "condition" and self._path
            else self._file_error()
        )

    def _unsupported_error(self) -> PddlSyntaxError | None:
        """Explain a section or formula that cxbridge does not support."""
        groups = [*self._path, *([self._group] if isinstance(self._group, Group) else [])]
        parts = [
            (
                unsupported_section(group.head) or (depth > 0 and unsupported_formula(group.head)),
                group.position,
            )
            for depth, group in enumerate(groups)  # the outermost group is (define ...)
        ]
        parts.append((unsupported_section(self._word), self._position))  # :derived without its bracket
        for name, position in parts:
            if name:
                message, hint = unsupported_texts(name)
                return self._error(message, position, hint)
        return None

    def _file_error(self) -> PddlSyntaxError:
        """Explain an error in the outer structure of a domain or problem, or in one of its sections."""
        noun = _TEXT_NOUNS[self._symbol]
        define = self._items[0] if self._items else None
        expected_form = "(PREDICATE ...)" if noun == "formula" else f"(define ({noun} NAME) ...)"
        if define is None:
            return self._error(f"there is no {noun} in this text", Position(), f"write {expected_form}")
        if noun == "formula":
            # a word in place of a formula, e.g. `at r1 home` without its brackets
            if isinstance(define, BracketWord):
                return self._missing_formula_error()
        elif not isinstance(define, Group) or define.head.lower() != "define":
            return self._error(f"a {noun} must start with (define ({noun} NAME)", define.position)
        if not self._path:
            return self._error(f"there is text after the end of the {noun}")
        return self._header_error(noun, self._path[0]) or self._section_error()

    def _header_error(self, noun: str, define: Group) -> PddlSyntaxError | None:
        header = define.items[1] if len(define.items) > 1 else define
        if not isinstance(header, Group) or header.head.lower() != noun or len(header.items) != _PAIR_LENGTH:
            head = header.head.lower() if isinstance(header, Group) else ""
            is_other_file = head in ("domain", "problem")
            return self._error(
                f"({noun} NAME) is expected after 'define'",
                header.position,
                f"this is a {head}: are the files in the other order?" if is_other_file else None,
            )
        if header in self._path:
            return self._error(f"the name of the {noun} is expected", header.items[1].position)
        return None

    def _section_expected_error(self, item: Item | None) -> PddlSyntaxError:
        """Return the error about an item in place of a section; None for the end of the text."""
        if not isinstance(item, Group) or not item.head.startswith(":"):
            position = None if item is None else item.position
            return self._error("a section such as (:action ...) is expected", position)
        sections = sorted(word for word in self._expected_words() if word.startswith(":"))
        hint = did_you_mean(item.head, sections, f"the sections are {', '.join(sections)}")
        return self._error(f"unknown section {item.head}", item.position, hint)

    def _expected_words(self) -> list[str]:
        return [word for word, kind in load_tables().keywords.items() if kind in self._expected]

    def _section_error(self) -> PddlSyntaxError:
        if len(self._path) == 1:
            return self._section_expected_error(self._group)
        section, *inner = self._path[1:]
        head = section.head.lower()
        is_head = bool(section.items) and section.items[0].position == self._position
        if is_head or not head.startswith(":"):
            return self._section_expected_error(section)
        if head in _TYPED_SECTIONS:
            return self._typed_error(_TYPED_SECTIONS[head], inner)
        if head in _DECLARATIONS:
            return self._declaration_error(_DECLARATIONS[head], inner)
        if head in _ACTIONS:
            return self._action_error(section, inner)
        return self._small_section_error(section, head, inner)

    def _declaration_error(self, kind: str, inner: list[Group]) -> PddlSyntaxError:
        # after the name of a declaration, the token is in its typed list of parameters
        if inner and inner[0].items and inner[0].items[0].position != self._position:
            return self._typed_error("a parameter", inner[1:])
        return self._error(f"a {kind} is expected", None, "write it in brackets: (NAME ?x - TYPE)")

    def _small_section_error(self, section: Group, head: str, inner: list[Group]) -> PddlSyntaxError:
        """Explain an error in a section that is neither a typed list, nor declarations, nor an action."""
        if head == ":requirements":
            return self._error("a requirement is expected", None, "such as :strips or :typing")
        if head == ":goal" and inner:
            return self._formula_error(inner)
        if head == ":goal":
            item = next((item for item in section.items if item.position == self._position), None)
            if isinstance(item, BracketWord) and len(section.items) == _PAIR_LENGTH:
                return self._missing_formula_error()
            return self._error(f"({section.head} ...) takes one formula", section.position)
        if head == ":init":
            hint = "such as (at r1 home) or (= (distance a b) 3)"
            return self._error("a fact is expected", inner[0].position if inner else None, hint)
        expected_form = {":metric": "minimize TERM", ":length": "(:serial 5)"}.get(head, "NAME")
        return self._error(f"({section.head} {expected_form}) is expected", section.position)

    def _typed_error(self, kind: str, inner: list[Group]) -> PddlSyntaxError:
        """Explain an error in a typed list.

        :param kind: the noun of the list's names, with its article.
        """
        if inner:
            hint = "write a name, or (either TYPE TYPE)"
            return self._error("a type is expected", inner[0].position, hint)
        previous = self._preceding_item()
        if isinstance(previous, BracketWord) and previous.text == "-":
            if self._word and self._word != "-":
                return self._error(f"'{self._word}' is not a type", None, _NAME_HINT)
            if isinstance(self._group, Group):
                return self._error("a type is expected", None, "write a name, or (either TYPE TYPE)")
            return self._error(f"'-' must be between {kind} and its type", previous.position)
        if not self._word:
            return self._error(f"{kind} is expected, not a bracket")
        hint = "write a variable such as ?x" if kind in ("a parameter", "a variable") else _NAME_HINT
        return self._error(f"'{self._word}' is not {kind}", None, hint)

    def _preceding_item(self) -> Item | None:
        """Return the preceding item in the same brackets."""
        return max(
            (sibling for sibling in self._siblings() if sibling.position < self._position),
            key=lambda sibling: sibling.position,
            default=None,
        )

    def _action_error(self, section: Group, inner: list[Group]) -> PddlSyntaxError:
        words = [item.text for item in section.items[1:2] if isinstance(item, BracketWord)]
        if not words or words[0].startswith(":"):
            return self._error("this action has no name", section.position)
        preceding = [item for item in section.items if item.position < self._position]
        key = next((item.text for item in reversed(preceding) if isinstance(item, BracketWord)), "")
        if inner:
            is_typed = key.lower() == ":parameters"
            return self._typed_error("a parameter", inner[1:]) if is_typed else self._formula_error(inner)
        keywords = [word for word in self._expected_words() if word.startswith(":")]
        if not keywords:
            return self._missing_value_error(key, words[0])
        text = f"({self._group.head} ...)" if isinstance(self._group, Group) else self._word
        # a section within an action: the action lacks its closing bracket
        hint = (
            "a ')' may be missing before it"
            if text.startswith("(:")
            else did_you_mean(text, keywords, f"expected: {', '.join(keywords)}")
        )
        return self._error(f"unexpected '{text}' in action {words[0]}", None, hint)

    def _missing_value_error(self, key: str, action: str) -> PddlSyntaxError:
        """Explain the text in place of a keyword's value."""
        if self._word and not self._word.startswith(":"):
            if key.lower() == ":parameters":
                return self._error("the parameters must be in brackets", None, "(?x - TYPE ...)")
            return self._missing_formula_error()
        previous = self._preceding_item()
        position = None if previous is None else previous.position
        return self._error(f"{key} of action {action} is missing its value", position)

    def _missing_formula_error(self) -> PddlSyntaxError:
        return self._error(
            f"a formula is expected, not '{self._word}'", None, f"write ({self._word}), in brackets"
        )

    def _formula_error(self, path: list[Group]) -> PddlSyntaxError:
        return (
            self._variables_error(path)
            or self._head_error(path)
            or self._count_error(path)
            or self._part_error(path)
        )

    def _variables_error(self, path: list[Group]) -> PddlSyntaxError | None:
        """Explain an error in the variables of a quantifier."""
        for depth, (outer, group) in enumerate(pairwise(path), start=2):
            if (
                outer.head.lower() in _QUANTIFIERS
                and len(outer.items) > _PAIR_LENGTH
                and group is outer.items[1]
            ):
                return (
                    self._typed_error("a variable", path[depth:])
                    if group.items
                    else self._quantifier_error(outer)
                )
        return None

    def _head_error(self, path: list[Group]) -> PddlSyntaxError | None:
        """Explain a formula with a wrong first word."""
        group = path[-1]
        head = group.head.lower()
        # the grammar has when in effects only
        if head == "when" and group.items[0].position == self._position:
            return self._error("'when' may only be in an effect", group.position, "use (imply ...)")
        return self._missing_head_error(path) if not head or head.startswith("?") else None

    def _count_error(self, path: list[Group]) -> PddlSyntaxError | None:
        """Explain a wrong number of parts in the innermost formula or its parent."""
        # the token may be in a part that is one too many, so the parent counts, too
        for group in reversed(path[-2:]):
            head, operand_count = group.head.lower(), len(group.items) - 1
            if head == "not" and operand_count != 1:
                hint = "write (not (and ...)) for several"
                return self._error("'not' takes one formula", group.position, hint)
            if head in _OPERAND_NOUNS and operand_count != _OPERAND_COUNT:
                message = f"'{group.head}' takes two {_OPERAND_NOUNS[head]}, but has {operand_count}"
                return self._error(message, group.position)
        return None

    def _part_error(self, path: list[Group]) -> PddlSyntaxError:
        if path[-1].head.lower() in _QUANTIFIERS:
            return self._quantifier_error(path[-1])
        return self._missing_formula_error() if self._word else self._error("a formula is expected")

    def _quantifier_error(self, group: Group) -> PddlSyntaxError:
        head = group.head
        hint = f"({head} (?x - TYPE) FORMULA)"
        return self._error(f"'{head}' needs its variables in brackets", group.position, hint)

    def _missing_head_error(self, path: list[Group]) -> PddlSyntaxError:
        group = path[-1]
        if group.head:
            return self._error(f"the variable {group.head} cannot be a predicate", group.position)
        outer = path[-2] if len(path) > 1 else None
        # within a predicate, brackets hold the value of a function
        is_term = outer is not None and outer.head.lower() not in (*_OPERAND_NOUNS, "and", "or", "not")
        if is_term and outer is not None and outer.head and not outer.head.startswith(":"):
            return self._error("a function is expected", group.position)
        return self._error("a formula must start with a word", group.position, "such as 'and' or a predicate")


def _groups_around(items: tuple[Item, ...], position: Position) -> list[Group]:
    """Return the groups that enclose a position, outermost first."""
    path: list[Group] = []
    while True:
        preceding = [item for item in items if isinstance(item, Group) and item.position < position]
        enclosing = next((group for group in reversed(preceding) if position <= group.end), None)
        if enclosing is None:
            return path
        path.append(enclosing)
        items = enclosing.items
