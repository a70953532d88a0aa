"""The tables of PDDL's grammar, which lark makes of ``pddl.lark`` ahead of time.

The reader needs nothing but these: importing lark and analysing the grammar would take longer than reading a
domain. ``python -m tests.grammars`` makes
them after a change of the grammar.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final

import msgspec

STARTS: Final = ("domain", "problem", "condition")
END: Final = "$END"

GRAMMAR: Final = Path(__file__).with_name("pddl.lark")
TABLES: Final = Path(__file__).with_name("tables.json")


class Rule(msgspec.Struct, frozen=True, array_like=True):
    """A rule of the grammar, in its reduced form.

    :param result: the nonterminal on its left side.
    :param size: the number of symbols on its right side.
    :param kept: the places of those symbols that have a value.
    :param spread: the places of those whose value is a list, each element of which is a value.
    :param build: the method that makes the rule's value of these values; empty: their list is the value, and
        a single value is the value itself.
    """

    result: str
    size: int
    kept: tuple[int, ...]
    spread: tuple[int, ...]
    build: str


class Tables(msgspec.Struct, frozen=True):
    """The grammar, as the reader needs it.

    :param comment: the pattern of a comment.
    :param cuts: the terminals that are cut out of the text before words are, with their patterns.
    :param keywords: the terminal of each word that has one, in lower case.
    :param words: the terminals of other words with their patterns; the first that matches counts.
    :param rules: the rules, by number.
    :param starts: the first state of each start symbol.
    :param states: what each state does at a symbol: go to a state, or, where the number is negative, reduce
        the rule ``-1 - number``.
    """

    comment: str
    cuts: dict[str, str]
    keywords: dict[str, str]
    words: dict[str, str]
    rules: tuple[Rule, ...]
    starts: dict[str, int]
    states: tuple[dict[str, int], ...]


@cache
def load_tables() -> Tables:
    """Return the tables."""
    return msgspec.json.decode(TABLES.read_bytes(), type=Tables)
