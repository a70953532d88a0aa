"""Facts and values made of constants only, for clients that must not run programs.

CLIPS evaluates function calls within a fact: ``(battery (level (system "...")))``. Therefore the text of a
client is parsed here, and CLIPS gets a new text, written from the result: a name, slots, constants. The only
parentheses in the new text are those of the fact and of slots that the deftemplate has: in an ordered fact,
CLIPS would call a function named in parentheses. A list of forbidden functions would not suffice, because
deffunctions and ``funcall`` can call them, too.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from clips._clips import lib
from msgspec import Struct

from cxbridge.clipstext.syntax import TOKEN
from cxbridge.clipstext.values import quoted
from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import NULL, CData, encode
from cxbridge.executive.host.facts.copying import template_of
from cxbridge.executive.host.values import FALSE, FactAddress, Value

DATA_FUNCTION = "cx-assert-data"
"""The name of the variant of CLIPS' `assert-string` for texts of clients: constants only."""

_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")
# the safety of a text rests on this pattern, which must match no call and no variable: a symbol has no
# parentheses, quotes, connectives or brackets of instance names, and does not start with ? or $ (variables),
# or with = or : (calls); the operators with < or >, and a lone = or :, are symbols, too
_SYMBOL: Final = re.compile(r"(?![?$=:])[^\s()&|~<;\"\0`\[\]]+|<|<=|<>|=|=>|>=|:")
_ESCAPED: Final = re.compile(r"\\(.)", re.DOTALL)


def to_safe_values_text(text: str) -> str:
    """Return constants, such as ``1 "a" b``, as text in which CLIPS finds no function call.

    :raises ClipsError: if a value is not a constant.
    """
    return " ".join(_to_safe_texts(list(_split_tokens(text)), text))


class ConstantFact(Struct, frozen=True):
    """A fact of constants.

    :param slot_names: empty for an ordered fact.
    :param text: the fact as CLIPS text, which CLIPS may only read if the deftemplate has these slots.
    """

    template: str
    slot_names: tuple[str, ...]
    text: str


def parse_constant_fact(text: str) -> ConstantFact:
    """Parse a fact without evaluating any part of the text.

    :raises ClipsError: if the text is not a fact of constants.
    """
    tokens = list(_split_tokens(text))
    # the shortest fact has three tokens: parentheses and a name
    if len(tokens) < 3 or tokens[0] != "(" or tokens[-1] != ")" or not _SYMBOL.fullmatch(tokens[1]):  # noqa: PLR2004
        raise ClipsError(f"{text} is not a fact", hint="e.g. (battery (level 3)), or (at home)")
    name, inner_tokens = tokens[1], tokens[2:-1]
    if "(" not in inner_tokens:
        return ConstantFact(name, (), f"({' '.join([name, *_to_safe_texts(inner_tokens, text)])})")
    if inner_tokens[-1] != ")":
        raise _refusal_error(text)
    slot_texts, slot_names, start = [], [], 0
    while start < len(inner_tokens):
        end = inner_tokens.index(")", start)
        if inner_tokens[start] != "(" or end < start + 2 or not _SYMBOL.fullmatch(inner_tokens[start + 1]):
            raise _refusal_error(text)
        slot_names.append(inner_tokens[start + 1])
        # _to_safe_texts() refuses parentheses, so that no slot holds a function call
        slot_texts.append(
            f"({' '.join([inner_tokens[start + 1], *_to_safe_texts(inner_tokens[start + 2 : end], text)])})"
        )
        start = end + 1
    return ConstantFact(name, tuple(slot_names), f"({' '.join([name, *slot_texts])})")


def _split_tokens(text: str) -> Iterator[str]:
    """Yield the tokens of a text except white space.

    :raises ClipsError: if a string is not closed, or the text has a NUL character.
    """
    for match in TOKEN.finditer(text):
        if match.lastgroup == "unclosed" or "\0" in match[0]:
            raise _refusal_error(text)
        if not match[0].isspace():
            yield match[0]


def _to_safe_texts(tokens: list[str], text: str) -> list[str]:
    """Return the texts of constants, with the strings quoted again.

    :param text: the text of the client, for errors.
    :raises ClipsError: if a token is not a constant.
    """
    constants = []
    for token in tokens:
        if token[0] == '"':
            constants.append(quoted(_ESCAPED.sub(r"\1", token[1:-1])))
        elif _NUMBER.fullmatch(token) or (_SYMBOL.fullmatch(token) and token.isprintable()):
            constants.append(token)
        else:
            raise _refusal_error(text)
    return constants


def _refusal_error(text: str) -> ClipsError:
    return ClipsError(
        f"refused: {text} does not consist of constants", hint="use only numbers, symbols and strings"
    )


def assert_data(env: CData, text: str) -> Value:
    """Assert a fact given as data, without evaluating any part of the text.

    :returns: the fact; FALSE if CLIPS refuses it.
    :raises ClipsError: as in :func:`to_safe_fact_text`.
    """
    fact = lib.AssertString(env, encode(to_safe_fact_text(env, text)))
    return FALSE if fact == NULL else FactAddress(fact)


def to_safe_fact_text(env: CData, text: str) -> str:
    """Return a fact of constants as text in which CLIPS finds no function call.

    :raises ClipsError: if the text is not a fact of constants, or the deftemplate lacks one of its slots.
    """
    fact = parse_constant_fact(text)
    if fact.slot_names:
        deftemplate = lib.FindDeftemplate(env, encode(fact.template))
        existing_slots = (
            () if deftemplate == NULL else [name for name, _ in template_of(deftemplate).slots or ()]
        )
        for slot in fact.slot_names:
            if slot not in existing_slots:
                raise ClipsError(f"refused: there is no deftemplate '{fact.template}' with a slot '{slot}'")
    return fact.text
