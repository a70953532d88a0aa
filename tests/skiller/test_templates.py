"""Templates of skill strings are parsed as lark parses them by the grammar."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.skiller.templates import TERMINALS, Placeholder, Replacement, parse_template

pytest.importorskip("lark", reason="lark reads the grammar")

from tests.grammars import format_terminals, make_terminals, template_parser

_PIECES = [
    "?(",
    "?",
    "(",
    "a",
    "to-2",
    "_",
    "ä",
    ")",
    "s",
    "S",
    "y",
    "Y",
    "i",
    "f",
    "q",
    "/",
    "//",
    "|/b/c/",
    "\n",
    " ",
]
# without a bar inside a pattern: Fawkes splits there, beyond the grammar (test_mapping.py)
_TEMPLATES = st.lists(
    st.one_of(
        st.sampled_from(_PIECES),
        st.just("?(a|/b/c/)s"),
        st.text(st.characters(exclude_characters="|"), max_size=2),
    )
).map("".join)


def test_terminals_equal_those_of_grammar() -> None:
    assert format_terminals(make_terminals()) == TERMINALS.read_text(encoding="utf-8"), (
        "run python -m tests.grammars"
    )


@given(_TEMPLATES)
def test_template_has_parts_of_lark(template: str) -> None:
    expected: list[str | Placeholder] = []
    for token in _PARSER.parse(template, start="template").children:
        if token.type == "PLACEHOLDER":
            expected.append(_placeholder(token))
        elif expected and isinstance(expected[-1], str):
            expected[-1] += token
        else:
            expected.append(str(token))
    assert list(parse_template(template)) == expected


_PARSER = template_parser()


def _placeholder(text: str) -> Placeholder:
    name, *steps, kind = _PARSER.parse(text, start="placeholder").children
    return Placeholder(str(name), tuple(Replacement(*step[2:-1].split("/")) for step in steps), str(kind))
