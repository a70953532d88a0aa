"""The action mapping, by section 5 of the facts about the Skiller."""

from __future__ import annotations

import re

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cxbridge.events import Level
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.mapping import ActionSkillMapping, MappedSkill
from tests.support import many

MODES: tuple[Mode, ...] = ("strict", "fawkes")


def map_action(template: str, mode: Mode = "fawkes", **params: str) -> MappedSkill:
    return ActionSkillMapping({"act": template}, mode=mode).map("act", params)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("template", "params", "expected"),
    [
        ("a{x=?(v)s}", {"v": "Cup-1"}, 'a{x="Cup-1"}'),
        ("a{x=?(v)S}", {"v": "Cup-1"}, 'a{x="CUP-1"}'),
        ("a{x=?(v)y}", {"v": "Cup-1"}, "a{x=Cup-1}"),
        ("a{x=?(v)Y}", {"v": "Cup-1"}, "a{x=CUP-1}"),
        ("a{x=?(v)i}", {"v": "3.9"}, "a{x=3}"),
        ("a{x=?(v)i}", {"v": " -12abc"}, "a{x=-12}"),
        ("a{x=?(v)i}", {"v": "+007"}, "a{x=7}"),
        ("a{x=?(v)f}", {"v": "2"}, "a{x=2.000000}"),
        ("a{x=?(v)f}", {"v": "1.23456789xyz"}, "a{x=1.234568}"),
        ("a{x=?(v)f}", {"v": "0x10p1"}, "a{x=32.000000}"),
        ("a{x=?(v)f}", {"v": "-Infinity"}, "a{x=-inf}"),
        ('say{text="?(a)y and ?(b)y"}', {"a": "x", "b": "y"}, 'say{text="x and y"}'),
        ("?(a)s?(a)s", {"a": "x"}, '"x""x"'),
        ("a{x=?(Team-colour_1)s}", {"Team-colour_1": "c"}, 'a{x="c"}'),
        ("", {}, ""),
    ],
)
def test_placeholder_types(template: str, params: dict[str, str], expected: str, mode: Mode):
    assert map_action(template, mode, **params) == MappedSkill(expected)


@pytest.mark.parametrize(
    ("template", "value", "expected"),
    [
        ("?(s|/L/left/|/R/right/)s", "l", '"left"'),
        ("?(s|/a/b/|/b/c/)y", "ab", "cc"),
        ("?(s|/(.)-(.)/$2-$1/)y", "a-b", "b-a"),
        ("?(s|/b/[$&]/)y", "abc", "a[b]c"),
        ("?(s|/b/$$/)y", "abc", "a$c"),
        ("?(s|/R-1/0.0/|/R-2/3.0/)f", "R-2", "3.000000"),
        ("?(s|/x)/y/)s", "ax)", None),
        ("?(s|/[)]/y/)y", "a)", "ay"),
    ],
)
def test_chains_of_replacements(template: str, value: str, expected: str | None):
    mapped = map_action(template, s=value)
    if expected is None:
        assert mapped.text == ""
        assert "Invalid regex 'x)'" in mapped.messages[0][1]
    else:
        assert mapped == MappedSkill(expected)


def test_bar_in_pattern_splits_chain():
    mapped = map_action("?(v|/a|b/c/)y", v="ab")
    assert mapped.text == "ab"
    assert mapped.messages == (
        (Level.WARN, "regex '/a' missing start/end slashes, ignoring"),
        (Level.WARN, "regex 'b/c/' missing start/end slashes, ignoring"),
    )


@pytest.mark.parametrize("template", ["a{?(x)q}", "a{?()s}", "a{?(x|/a//)s}", "a{?(x", "?(ok)s?(x)q"])
def test_invalid_placeholder_is_text_with_warning_at_load(template: str):
    mapping = ActionSkillMapping({"act": template})
    text = mapping.map("act", {"ok": "v"}).text
    assert text == template.replace("?(ok)s", '"v"')
    ((level, warning),) = mapping.check()
    assert level is Level.WARN
    assert warning.startswith("action-mapping/act: '?(")


def test_invalid_expression_has_warning_at_load():
    ((level, warning),) = ActionSkillMapping({"act": "?(x|/a(/b/)s"}).check()
    assert (level, "invalid regex 'a('" in warning) == (Level.WARN, True)


def test_inserted_values_are_not_expanded():
    assert map_action('x{"?(a)y"}', a="?(b)y", b="no").text == 'x{"?(b)y"}'


def test_parameter_without_value_is_error():
    assert map_action("wait{t=?(d)f}") == MappedSkill(
        "", ((Level.ERROR, "No value for parameter 'd' of action 'act' given"),)
    )


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        ("i", "x", "Failed to convert 'x' to integer: stol"),
        ("f", "", "Failed to convert '' to float: stod"),
        ("i", "9" * 30, f"Failed to convert '{'9' * 30}' to integer: stol: out of range"),
        ("f", "1e999", "Failed to convert '1e999' to float: stod: out of range"),
    ],
)
def test_invalid_number_is_error(kind: str, value: str, message: str):
    assert map_action(f"?(v){kind}", v=value) == MappedSkill("", ((Level.ERROR, message),))


def test_action_without_mapping_has_no_text():
    mapping = ActionSkillMapping({"say": "say{}"})
    assert mapping.map("sing", {}) == MappedSkill("")
    assert (mapping.has_template("say"), mapping.has_template("sing")) == (True, False)


INJECTION = 'x"} os.exit() say{text="y'


def test_fawkes_mode_inserts_values_unchanged():
    assert map_action("say{text=?(t)s}", "fawkes", t=INJECTION).text == f'say{{text="{INJECTION}"}}'


def test_strict_mode_escapes_in_quotes_and_refuses_bare_code():
    assert map_action("say{text=?(t)s}", "strict", t='a"b\\c\nd').text == r'say{text="a\"b\\c\nd"}'
    assert map_action('say{text="Hello ?(t)y"}', "strict", t='a"b').text == r'say{text="Hello a\"b"}'
    assert map_action("say{text='?(t)y'}", "strict", t="it's").text == r"say{text='it\'s'}"
    for bare in ("say{text=?(t)y}", "say{text=[[?(t)y]]}", "--?(t)y"):
        mapped = map_action(bare, "strict", t="x} y{")
        assert mapped.text == ""
        assert "use ?(t)s" in mapped.messages[0][1]


@given(st.text(max_size=40))
def test_lua_reads_value_of_strict_mode(value: str):
    from lupa.lua51 import LuaRuntime

    lua = LuaRuntime(encoding=None)
    for template in ("return ?(t)s", 'return "?(t)y"', "return '?(t)y'"):
        text = map_action(template, "strict", t=value).text
        assert lua.execute(text.encode()) == value.encode()


@pytest.mark.parametrize(
    ("template", "value"),
    [
        ("drive{dx=-?(v)y, place=1}", "-5"),
        ("drive{dx=-?(v)i, place=1}", "-5"),
        ("drive{dx=-?(v)f, place=1}", "-5"),
        ("drive{dx=?(v)y-1, place=1}", "a-"),
        ("drive{dx=?(v)y?(v)y, place=1}", "-"),
        ("drive{dx=-?(v)y-, place=1}", ""),
        ("a{x=[?(v)y[, y=1}", ""),
        ('a{x="?(v)s"}', "..os.exit().."),
        ('a{x="\\?(v)y"}', '"..os.exit()..'),
        ('a{x="\\?(v)y"}', "n"),
        ("--[[ a\n?(v)y", "]] os.exit()"),
    ],
)
def test_strict_mode_refuses_values_that_change_template_text(template: str, value: str):
    mapped = map_action(template, "strict", v=value)
    assert mapped.text == ""
    assert [level for level, _ in mapped.messages] == [Level.ERROR]


def lua_states(text: str) -> list[str]:
    """Return the lexical state of each character of a Lua text."""
    states: list[str] = []
    state = "code"
    while len(states) < len(text):
        at = len(states)
        opened = re.compile(r"(--)?\[(=*)\[").match(text, at) if state == "code" else None
        if opened:
            states += ["bracket"] * len(opened[0])
            state = f"]{opened[2]}]"
        elif state == "code" and text.startswith("--", at):
            states += ["comment"] * 2
            state = "comment"
        elif state[0] == "]" and text.startswith(state, at):
            states += ["bracket"] * len(state)
            state = "code"
        elif state in ("'", '"') and text[at] == "\\" and at + 1 < len(text):
            states += [f"escape in {state}"] * 2
        else:
            states.append(state)
            if state == "code" and text[at] in "'\"":
                state = text[at]
            elif (state == "comment" and text[at] == "\n") or text[at] == state:
                state = "code"
    return states


pieces = st.sampled_from(
    [
        "?(v)s",
        "?(w)S",
        "?(v)y",
        "?(w)Y",
        "?(v)i",
        "?(w)f",
        *"[],=-}5 '\"\\\n",
        "--",
        "--[[",
        "[[",
        "]]",
        "goto{",
    ]
)
values = st.text(st.sampled_from("-5a.\"'\\\n[]="), max_size=5)


@settings(max_examples=many(1000, 250))
@given(st.lists(pieces, max_size=10), values, values)
def test_strict_mode_keeps_lexical_states_of_template(template: list[str], v: str, w: str):
    """With any values, Lua reads each character of the template in the same state as with ``5``."""

    assume(map_action("".join(template), "strict", v=v, w=w).text)
    assert states_of_template(template, v, w) == states_of_template(template, "5", "5")


def states_of_template(template: list[str], v: str, w: str) -> list[str]:
    prefixes = ["".join(template[:end]) for end in range(len(template) + 1)]
    starts = [len(map_action(prefix, "strict", v=v, w=w).text) for prefix in prefixes]
    states = lua_states(map_action(prefixes[-1], "strict", v=v, w=w).text)
    return [
        state
        for piece, start in zip(template, starts, strict=False)
        if not piece.startswith("?(")
        for state in states[start : start + len(piece)]
    ]


ordinary = st.text(st.sampled_from("abcXYZ019-_.: ,;!?()[]{}/|$"), max_size=12)


@given(ordinary)
def test_modes_agree_on_ordinary_values(value: str):
    for template in ("a{t=?(v)s}", "a{t=?(v)S}", 'a{t="?(v)y!"}', "?(v|/a/b/)s"):
        assert map_action(template, "strict", v=value) == map_action(template, "fawkes", v=value)


@given(st.text(st.sampled_from("?()|/abcsyi-$ \n"), max_size=60))
def test_any_template_maps_or_has_message(template: str):
    mapped = map_action(template, a="1", b="x")
    assert mapped.text or not template or mapped.messages or "?(" in template
    ActionSkillMapping({"act": template}).check()
