"""Skill strings as values: cxbridge reads as Lua 5.1 reads, and refuses the rest with its place."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cxbridge.errors import SkillError
from cxbridge.skiller.quoting import escape
from cxbridge.skiller.skillstring import (
    MAX_DEPTH,
    ONLY_FAWKES,
    SkillStringCall,
    parse_skill_call,
    parse_skill_string,
    read_calls,
)
from fuzz.luaoracle import lua_calls, normalise
from tests.support import many


@pytest.mark.parametrize(
    ("text", "call"),
    [
        ("say{}", SkillStringCall("say")),
        ("say()", SkillStringCall("say")),
        ('say{text="Hello peggy", wait=true}', SkillStringCall("say", {"text": "Hello peggy", "wait": True})),
        ("move(1, -2.5, 'x')", SkillStringCall("move", {1: 1, 2: -2.5, 3: "x"})),
        ('go{"a"; b = nil, }', SkillStringCall("go", {1: "a", "b": None})),
        ('go{["to-place"]="x", to={1, x=2}}', SkillStringCall("go", {"to-place": "x", "to": {1: 1, "x": 2}})),
        ("go{0x10, 1e3, .5}", SkillStringCall("go", {1: 16, 2: 1000, 3: 0.5})),
        (r'say"a\"b\n\65\\"', SkillStringCall("say", {1: 'a"b\nA\\'})),
        ("go{ -- comment\n a=1}", SkillStringCall("go", {"a": 1})),
        ('say{text="a, b=c; {d}"}', SkillStringCall("say", {"text": "a, b=c; {d}"})),
        ('say[[a ]=] "b"]]', SkillStringCall("say", {1: 'a ]=] "b"'})),
        ("say{[==[\ntwo\r\nlines]==]}", SkillStringCall("say", {1: "two\nlines"})),
        ("say --[[ not\nthis ]] {text='x'} -- nor this", SkillStringCall("say", {"text": "x"})),
        ("say{'a\\\nb', \"c\\\r\nd\"}", SkillStringCall("say", {1: "a\nb", 2: "c\nd"})),
        (r"say{'\195\164', 'ä', '\255'}", SkillStringCall("say", {1: "ä", 2: "ä", 3: "\udcff"})),
        (
            "go(nil, false, {1, {2, {}}})",
            SkillStringCall("go", {1: None, 2: False, 3: {1: 1, 2: {1: 2, 2: {}}}}),
        ),
        ("go{- 5, [-1]=2, [3]=4}", SkillStringCall("go", {1: -5, -1: 2, 3: 4})),
        ("go{1, [1]=2}", SkillStringCall("go", {1: 1})),
        ("go{a=1, a=2}", SkillStringCall("go", {"a": 2})),
        (f"go({', '.join(['{}'] * 60)})", SkillStringCall("go", {n: {} for n in range(1, 61)})),
        ("go{1e999, 0x20000000000001}", SkillStringCall("go", {1: math.inf, 2: 2.0**53})),
    ],
)
def test_valid_calls_are_parsed(text: str, call: SkillStringCall):
    assert parse_skill_call(text) == call


def test_blank_text_has_no_calls():
    assert read_calls(" \n-- nothing\n--[[ at all ]]") == []
    with pytest.raises(SkillError, match="has no call of a skill"):
        parse_skill_string("")


EVALUATED = [
    ("if x then say{} end", 1, "'if' stands"),
    ("local x = 1", 1, "'local' stands"),
    ("x = 1", 3, "'=' stands where the arguments of 'x' should be"),
    ("os.execute('true')", 3, "'.' stands where the arguments of 'os' should be"),
    ("say.module('x')", 4, "'.' stands"),
    ("skills[1]{}", 7, "'[' stands"),
    ("say:reset()", 4, "':' stands"),
    ("say{}.module{}", 6, "'.' stands"),
    ("say{}{}", 6, "'{' stands"),
    ("(say){}", 1, "'(' stands"),
    ("say{text=name}", 10, "'name' stands"),
    ("say(math.pi)", 5, "'math' stands"),
    ("say{f()}", 5, "'f' stands"),
    ("say{function() end}", 5, "'function' stands"),
    ("say{1 + 1}", 7, "'+' stands"),
    ("say{'a' .. 'b'}", 9, "'.' stands"),
    ("say{#'a'}", 5, "'#' stands"),
    ("say{not true}", 5, "'not' stands"),
    ("say{- -1}", 5, "'-' stands"),
    ("say{-'1'}", 5, "'-' stands"),
    ("say{[x]=1}", 6, "'x' stands"),
    ("say{...}", 5, "'.' stands"),
    ("say{(1)}", 5, "'(' stands"),
    ("\x1bLua", 1, "stands where the name of a skill should be"),
    ("say{a=1}; ; say{}", 11, "';' stands"),
    ("ä{}", 1, "'ä' stands"),
]


@pytest.mark.parametrize(("text", "column", "problem"), EVALUATED)
def test_code_is_refused_with_column_and_mode(text: str, column: int, problem: str):
    with pytest.raises(SkillError) as caught:
        read_calls(text)
    assert caught.value.message.startswith(f"column {column}: ")
    assert problem in caught.value.message
    assert caught.value.message.endswith(ONLY_FAWKES)
    assert len(caught.value.message) < 128  # the message fits into the field "error"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("say{text=}", "column 10"), ("1", "column 1"), ("say{", "column 5"), ("say", "column 4"),
        ("say{'a}", "column 5"), ('say{"a\nb"}', "column 5"), ("say[[a", "column 4"),
        ("say{} --[[", "column 7"),
        (r"say'\256'", "column 5"), ("say{3x}", "column 5"), ("say{1..2}", "column 5"),
        ("say{0x}", "column 5"), ("say{1e}", "column 5"), ("say{[nil]=1}", "column 5"),
        ("say{[true]=1}", "column 5"),
        ("say{a=1\n b=2}", "line 2, column 2"),
        ("say\n(1)", "line 2, column 1"), ("say{and=1}", "column 5"),
        ("say" + "{" * (MAX_DEPTH + 1) + "}" * (MAX_DEPTH + 1), f"column {4 + MAX_DEPTH}"),
        ("say" + "{" * 100_000, f"column {4 + MAX_DEPTH}"),
    ],
)  # fmt: skip
def test_syntax_errors_have_place(text: str, place: str):
    with pytest.raises(SkillError) as caught:
        parse_skill_string(text)
    assert caught.value.message.startswith(f"{place}: ")


names = st.from_regex(r"[a-z_][a-z0-9_]{0,8}", fullmatch=True).filter(
    lambda name: (
        name not in ("nil", "true", "false", "and", "or", "not", "do", "if", "in", "end", "for")
        and name
        not in ("else", "elseif", "then", "local", "break", "repeat", "return", "until", "while", "function")
    )
)
values = st.one_of(st.text(max_size=20), st.integers(-(2**40), 2**40), st.booleans(), st.none())


def literal(value: Any) -> str:
    if isinstance(value, str):
        return f'"{escape(value)}"'
    return "nil" if value is None else str(value).lower()


@given(names, st.dictionaries(names, values, max_size=5))
def test_written_call_is_parsed(name: str, args: dict[str | int, Any]):
    text = f"{name}{{{', '.join(f'{key}={literal(value)}' for key, value in args.items())}}}"
    assert parse_skill_call(text) == SkillStringCall(name, args)


PIECES = [
    "a", "say", "x1", "_", "nil", "true", "false", "end", "{", "}", "(", ")", "[", "]", "=", ",", ";", " ",
    "\n", "\r\n", "\t", "-", "--", "--[[", "]]", "[[", "[=[", "]=]", "1", "0", ".5", "2.", "1e3", "1E-2",
    "0x1F",
    "9" * 30, "1e400", '"', "'", "\\", "\\n", "\\065", "\\9", "\\255", "\\\n", "ä", "\udcff", "\0",
    "..", "+", "text=", '"a b"', "'c'",
]  # fmt: skip


@settings(max_examples=many(20_000, 500))
@given(st.lists(st.sampled_from(PIECES), max_size=14).map("".join))
@example("say{'\\10'}")
@example("say[[ [[ ]]")
@example("say{} --[[ [[ ]]")
@example("say[=[ [[ ]=]")
def test_parsed_calls_equal_calls_of_lua(text: str):
    """The parser refuses a text, or Lua 5.1 makes the same calls: the text is data, without unseen calls."""
    try:
        calls = read_calls(text)
    except SkillError:
        return
    assert [(call.name, normalise(call.values)) for call in calls] == lua_calls(text)


literals = st.recursive(
    st.one_of(
        st.sampled_from(
            ["nil", "true", "false", "0x1F", "- 3", ".5", "2.", "1e-3", "[[\nx]]", "[=[]]]=]", "'\\\r\n'"]
        ),
        st.integers().map(str),
        st.floats(allow_nan=False, allow_infinity=False).map(repr),
        st.binary(max_size=8).map(lambda data: '"' + "".join(f"\\{byte:03}" for byte in data) + '"'),
        st.text(max_size=8).map(lambda text: f"'{escape(text, quote=chr(39))}'"),
    ),
    lambda inner: st.lists(
        st.one_of(inner, st.tuples(names, inner).map("=".join), inner.map(lambda value: f"['k k']={value}")),
        max_size=4,
    ).map(lambda items: "{" + "; ".join(items) + "}"),
    max_leaves=8,
)


@given(st.lists(st.tuples(names, st.lists(literals, max_size=3).map(", ".join)), min_size=1, max_size=3))
def test_every_literal_of_lua_is_parsed(calls: list[tuple[str, str]]):
    text = "\n".join(f"{name}({arguments});" for name, arguments in calls)
    assert [(call.name, normalise(call.values)) for call in read_calls(text)] == lua_calls(text)


@given(st.text(st.sampled_from("abx{}()=,;\"'\\ \n019.-[]"), max_size=30))
def test_any_text_is_parsed_or_refused(text: str):
    with contextlib.suppress(SkillError):
        parse_skill_string(text)
