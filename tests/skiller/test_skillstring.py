"""Skill strings as values."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import SkillError
from cxbridge.skiller.quoting import escape
from cxbridge.skiller.skillstring import Name, SkillCall, parse_skill_call, parse_skill_string


@pytest.mark.parametrize(
    ("text", "call"),
    [
        ("say{}", SkillCall("say")),
        ("say()", SkillCall("say")),
        ('say{text="Hello peggy", wait=true}', SkillCall("say", {"text": "Hello peggy", "wait": True})),
        ("move(1, -2.5, 'x')", SkillCall("move", {1: 1, 2: -2.5, 3: "x"})),
        ('go{"a"; b = nil, }', SkillCall("go", {1: "a", "b": None})),
        ('go{["to-place"]="x", to={1, x=2}}', SkillCall("go", {"to-place": "x", "to": {1: 1, "x": 2}})),
        ("go{0x10, 1e3, .5}", SkillCall("go", {1: 16, 2: 1000, 3: 0.5})),
        ("go{status=S_FINAL}", SkillCall("go", {"status": Name("S_FINAL")})),
        (r'say"a\"b\n\65\\"', SkillCall("say", {1: 'a"b\nA\\'})),
        ("go{ -- comment\n a=1}", SkillCall("go", {"a": 1})),
        ('say{text="a, b=c; {d}"}', SkillCall("say", {"text": "a, b=c; {d}"})),
    ],
)
def test_calls(text: str, call: SkillCall):
    assert parse_skill_call(text) == call


def test_several_calls_in_a_row():
    assert [call.name for call in parse_skill_string("a{}; b(1) c{}")] == ["a", "b", "c"]
    with pytest.raises(SkillError, match="has 2 calls, expected one"):
        parse_skill_call("a{} b{}")


@pytest.mark.parametrize(
    ("text", "column"), [("say{text=}", 10), ("1", 1), ("if x then say{} end", 4), ("say{", None), ("", None)]
)
def test_anything_else_is_refused_with_its_place(text: str, column: int | None):
    with pytest.raises(SkillError, match="cannot read the skill string") as caught:
        parse_skill_string(text)
    assert caught.value.column == column


names = st.from_regex(r"[a-z_][a-z0-9_]{0,8}", fullmatch=True).filter(
    lambda name: name not in ("nil", "true", "false")
)
values = st.one_of(st.text(max_size=20), st.integers(-(2**40), 2**40), st.booleans(), st.none())


def write(value: Any) -> str:
    if isinstance(value, str):
        return f'"{escape(value)}"'
    return "nil" if value is None else str(value).lower()


@given(names, st.dictionaries(names, values, max_size=5))
def test_what_is_written_is_read_back(name: str, args: dict[str | int, Any]):
    text = f"{name}{{{', '.join(f'{key}={write(value)}' for key, value in args.items())}}}"
    assert parse_skill_call(text) == SkillCall(name, args)


@given(st.text(st.sampled_from("abx{}()=,;\"'\\ \n019.-[]"), max_size=30))
def test_any_text_is_read_or_refused(text: str):
    with contextlib.suppress(SkillError):
        parse_skill_string(text)
