"""Valid PDDL that Fawkes' parser refuses or ignores, for the setting ``strict: fawkes``.

In Fawkes, sections and parts of actions have a fixed order. Keywords are case-sensitive, and match the start
of a word (so ``<`` hides ``<=``). The words of a time, such as ``at start``, are separated by exactly one
blank. See docs/evidence/planning.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from cxbridge.executive.pddl.ast import FORMULA_WORDS, TIME_WORDS, Position
from cxbridge.executive.pddl.brackets import SECTION_DEPTH, BracketWord, Group, Item, parse_items
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error
from cxbridge.executive.pddl.grammar import END_TERMINAL
from cxbridge.executive.pddl.tokens import SourceText, Token

# The sections before the actions, in the required order.
_SECTIONS: Final = (":requirements", ":types", ":constants", ":predicates", ":functions")
# Required sections with their minimum number of entries.
_REQUIRED_SECTIONS: Final = {":requirements": 0, ":predicates": 1}
_ACTIONS: Final = frozenset({":action", ":durative-action"})
# The parts of actions by keyword, in the required order, with their names in errors.
_ACTION_PARTS: Final = {
    ":parameters": "parameters",
    ":duration": "duration",
    ":precondition": "condition",
    ":condition": "condition",
    ":effect": "effect",
    ":conditional-breakup": "conditional breakup",
    ":temporal-breakup": "temporal breakup",
}
_REQUIRED_PARTS: Final = ("parameters", "condition", "effect")
# Keywords that Fawkes finds at the start of a longer word, too.
_QUANTIFIERS: Final = ("exists", "forall")
_EFFECT_KEYWORDS: Final = ("when", "increase", "decrease")
_CONNECTIVES: Final = frozenset({"and", "or", "not", "when"})
# The first words of formulas that Fawkes' grammar lacks.
_UNKNOWN_HEADS: Final = frozenset(FORMULA_WORDS).difference(
    _CONNECTIVES, _QUANTIFIERS, _EFFECT_KEYWORDS, ("=", "<", ">")
)


def remove_text_after_actions(text: SourceText) -> None:
    """Remove the text after the first row of consecutive actions, because Fawkes ignores it."""
    tokens, depth, has_action = text.tokens, 0, False
    for index, token in enumerate(tokens):
        is_action_keyword = index > 0 and tokens[index - 1].text == "(" and token.text in _ACTIONS
        # at depth 1, this is the bracket that closes the domain, or the start of another section
        if has_action and depth == 1 and (token.text != "(" or tokens[index + 1].text not in _ACTIONS):
            text.tokens = [
                *tokens[:index],
                Token("RPAR", ")", token.start),  # closes the domain, which ends with its last action
                Token(END_TERMINAL, "", token.start),
            ]
            return
        has_action = has_action or (is_action_keyword and depth == SECTION_DEPTH)
        depth += {"(": 1, ")": -1}.get(token.text, 0)


def check_domain(text: SourceText) -> None:
    """Check that Fawkes accepts a valid domain.

    :raises PddlSyntaxError: if Fawkes refuses the domain.
    """
    check_keyword_case(text)
    (define,) = _filter_groups(parse_items(text))
    sections = [section for section in _filter_groups(define.items) if section.head.startswith(":")]
    for previous, section in pairwise(sections):
        if _section_rank(section.head) < _section_rank(previous.head):
            raise _refusal_error(text, section.position, f"{section.head} must come earlier")
    for head, min_entries in _REQUIRED_SECTIONS.items():
        if not any(section.head == head and len(section.items) > min_entries for section in sections):
            raise _refusal_error(text, define.position, f"there are no {head[1:]}")
    actions = [section for section in sections if section.head in _ACTIONS]
    if not actions:
        raise _refusal_error(text, define.position, "there are no actions")
    for action in actions:
        _check_action(text, action)


def _section_rank(head: str) -> int:
    """Return the place of a section in the required order; actions come last."""
    return _SECTIONS.index(head) if head in _SECTIONS else len(_SECTIONS)


def _check_action(text: SourceText, action: Group) -> None:
    order = list(_ACTION_PARTS)
    _action, name, *items = action.items  # keys and values alternate after the name
    keys = [item for item in items[::2] if isinstance(item, BracketWord)]
    values = dict(zip(keys, items[1::2], strict=True))
    for previous, key in pairwise(keys):
        if order.index(key.text) < order.index(previous.text):
            raise _refusal_error(text, key.position, f"{key.text} must come earlier")
    for key, value in values.items():
        if key.text != ":parameters":
            check_formula(text, value, is_effect=key.text == ":effect")
    for part in _REQUIRED_PARTS:
        if part not in {_ACTION_PARTS[key.text] for key in keys}:
            assert isinstance(name, BracketWord)  # the text is valid
            raise _refusal_error(text, action.position, f"action {name.text} has no {part}")


def check_formula(text: SourceText, formula: Item, *, is_effect: bool = False) -> None:
    """Check that Fawkes accepts a valid formula.

    :raises PddlSyntaxError: if Fawkes refuses the formula.
    """
    assert isinstance(formula, Group)  # each formula of a valid text has brackets
    reason = _refusal_reason(formula, is_effect=is_effect)
    if reason:
        raise _refusal_error(text, formula.position, reason)
    head, parts = formula.head, formula.items[1:]
    if head in _QUANTIFIERS or _is_timed(formula):
        parts = parts[1:]  # without the variables of a quantifier, or the second word of a time
    elif head not in _CONNECTIVES:
        return
    for index, part in enumerate(parts):
        # the first part of when is a condition
        check_formula(text, part, is_effect=is_effect and not (head == "when" and index == 0))


def _refusal_reason(formula: Group, *, is_effect: bool) -> str:
    """Return why Fawkes refuses a formula; empty if it accepts the formula."""
    head = formula.head
    keywords = _QUANTIFIERS + (_EFFECT_KEYWORDS if is_effect else ())
    if not head:
        return "a formula must start with a word"
    if head not in keywords and head.startswith(keywords):
        return f"it mistakes '{head}' for a keyword"
    if head in _UNKNOWN_HEADS:
        return f"it does not support '{head}'"
    if len(formula.items) == 1 and head in _CONNECTIVES:
        return f"Unknown predicate: {head}"
    if _is_timed(formula):
        first_position, second_position = formula.items[0].position, formula.items[1].position
        if second_position != (first_position.line, first_position.column + len(head) + 1):
            return f"there must be exactly one blank after '{head}'"
    return ""


def _is_timed(formula: Group) -> bool:
    # (at start ?x) is an atom of the predicate ``at``: after the words of a time, all items are formulas
    words = [item.text for item in formula.items[:2] if isinstance(item, BracketWord)]
    return tuple(words) in TIME_WORDS and all(isinstance(item, Group) for item in formula.items[2:])


def check_keyword_case(text: SourceText) -> None:
    """Check that keywords are in lower case.

    :raises PddlSyntaxError: if a keyword has an upper-case letter.
    """
    for previous, token in pairwise(text.tokens):
        word = token.text
        is_keyword = word.startswith(":") or (previous.text == "(" and token.kind not in ("NAME", "VARIABLE"))
        if is_keyword and word != word.lower():
            raise _refusal_error(
                text, text.position(token.start), f"'{word}' must be written '{word.lower()}'"
            )


def _filter_groups(items: Sequence[Item]) -> list[Group]:
    return [item for item in items if isinstance(item, Group)]


def _refusal_error(text: SourceText, position: Position, reason: str) -> PddlSyntaxError:
    return syntax_error(f"Fawkes' parser refuses this: {reason}", position, text.file)
