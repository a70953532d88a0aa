"""Printed facts read back, with strings that CLIPS does not escape."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from cxbridge.clipstext import facts
from cxbridge.clipstext.facts import (
    IMPLIED,
    LAYOUTS,
    FactSyntaxError,
    fact_text,
    parse_fact,
    template_of,
)
from cxbridge.clipstext.values import Symbol, Value
from cxbridge.events import Event, FactChange
from cxbridge.history.transitions import TRANSITION_TYPES, TransitionTracker
from cxbridge.trace.formats.registry import open_run
from tests.support import needs_shared
from tests.trace.runs import NAMES, recording

symbols = st.from_regex(r"[A-Za-z!/*+=._\[\]-][A-Za-z0-9?!/*+=._\[\]-]{0,8}", fullmatch=True)
strings = st.text(st.characters(blacklist_characters='"', blacklist_categories=["Cs"]), max_size=12)
fields = st.one_of(symbols, st.integers().map(str), strings.map(lambda text: f'"{text}"'))


@given(symbols, st.dictionaries(symbols, st.lists(fields, max_size=4), max_size=5))
def test_facts_without_odd_quotes_round_trip(template: str, slots: dict[str, list[str]]) -> None:
    text = f"({template}{''.join(f' ({slot}{_joined(values)})' for slot, values in slots.items())})"
    assert parse_fact(text) == (template, {slot: _joined(values).strip() for slot, values in slots.items()})


def _joined(values: list[str]) -> str:
    return "".join(f" {value}" for value in values)


@pytest.mark.parametrize(
    ("text", "slot", "value"),
    [
        (
            '(s (skill "say{text="Good bye", wait=true}") (msgid 3))',
            "skill",
            '"say{text="Good bye", wait=true}"',
        ),
        ('(s (skill "say{text="Good bye"}"))', "skill", '"say{text="Good bye"}"'),
        ('(s (files "a.clp" "BATCH|b.clp" c) (x 1))', "files", '"a.clp" "BATCH|b.clp" c'),
        ('(s (text "a (b) "c" d") (x 1))', "text", '"a (b) "c" d"'),
        ('(s (text "") (x 1))', "text", '""'),
        ('(s (text "two\nlines") (x 1))', "text", '"two\nlines"'),
        ("(s (empty) (x 1))", "empty", ""),
        (
            (
                '(SkillerInterface (id r) (time 1) (skill_string "") (error "said "stop" in try 1") '
                '(exclusive_controller "") (msgid 1) (status S_FAILED))'
            ),
            "error",
            '"said "stop" in try 1"',
        ),
    ],
)
def test_quotes_within_strings(text: str, slot: str, value: str) -> None:
    assert parse_fact(text)[1][slot] == value


@pytest.mark.parametrize(
    "text", ["", "(", "()", "goal", "(ordered fact)", "(goal (id a)", "(goal (id a) ", '(g (a "b', "(g ())"]
)
def test_what_is_no_template_fact_is_refused(text: str) -> None:
    with pytest.raises(FactSyntaxError):
        parse_fact(text)


@given(st.text(max_size=60))
def test_no_text_breaks_the_parser(text: str) -> None:
    with suppress(FactSyntaxError):
        parse_fact(f"(goal {text}")
    template_of(text)


@given(st.text("() ab?\n;<-", max_size=30))
def test_the_fast_way_and_the_careful_one_agree(text: str) -> None:
    def parsed() -> object:
        with suppress(FactSyntaxError):
            return parse_fact(f"(goal{text})")
        return None

    fast = parsed()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(facts, "_parse_slots_without_strings", lambda *_: None)
        assert fast == parsed()


@pytest.mark.parametrize(
    ("slots", "text"),
    [
        ({"a": Symbol("b"), "c": (), "d": ("e f", 1, 2.5)}, '(t (a b) (c) (d "e f" 1 2.5))'),
        ({IMPLIED: (Symbol("x"), 1)}, "(t x 1)"),
        ({IMPLIED: ()}, "(t)"),
    ],
)
def test_a_fact_is_written_as_clips_prints_it(slots: Mapping[str, Value], text: str) -> None:
    assert fact_text("t", slots) == text


@needs_shared
@pytest.mark.parametrize("name", NAMES)
def test_every_template_fact_of_the_recordings_reads_back(name: str) -> None:
    count = 0
    for event in open_run(recording(name)):
        if isinstance(event, FactChange) and " (" in event.text:
            template, slots = parse_fact(event.text)
            printed = "".join(
                f" ({slot} {value})" if value else f" ({slot})" for slot, value in slots.items()
            )
            assert f"({template}{printed})" == event.text
            count += 1
    assert count > 1600


ODD = [
    '"',
    '"" b',
    "\n",
    ") (",
    '" (x',
    'say{text="hi", wait=true}',
    ' a "b c" d',
    "FIRE 1 x:",
    "==> f-1 (goal",
]
odd = st.text(st.sampled_from("\"()\n\r ;&|~<>\\=,'{}a1\u2028é"), max_size=12) | st.sampled_from(ODD)
atoms = {
    "symbol": symbols,
    "string": odd.map(lambda text: f'"{text}"'),
    "number": st.floats(width=32).map(str),
}
STRINGS = {"message", "skiller", "error-msg", "skill_string", "exclusive_controller"}
MANY = {"warning", "error", "params", "meta", "param-values", "time"}


@st.composite
def tracked_facts(draw: st.DrawFn) -> tuple[str, dict[str, str]]:
    """A fact that transitions are made of, with any strings, as CLIPS 6.30 prints it."""
    template = draw(st.sampled_from(sorted(LAYOUTS)))
    slots = {}
    for name in LAYOUTS[template]:
        if name in MANY and not (template == "SkillerInterface" and name == "error"):
            values = draw(st.lists(st.one_of(*atoms.values()), max_size=3))
        elif name in STRINGS or name == "error":
            values = [draw(atoms["string"])]
        elif name == "msgid":
            values = [str(draw(st.integers(0, 2**32)))]
        else:
            values = [draw(symbols)]
        slots[name] = " ".join(values)
    return template, slots


def printed(template: str, slots: Mapping[str, str]) -> str:
    """A fact as CLIPS prints it."""
    texts = (f" ({name} {value})" if value else f" ({name})" for name, value in slots.items())
    return f"({template}{''.join(texts)})"


def is_plain(template: str, slots: Mapping[str, str]) -> bool:
    """Whether no string has the end of a slot and the begin of another in it: nobody can read that."""
    begins = "|".join(map(re.escape, LAYOUTS[template]))
    return not any(re.search(rf"\) \((?:{begins})[ )]", value) for value in slots.values())


@given(tracked_facts())
def test_facts_of_transitions_read_back_whatever_their_strings_hold(fact: tuple[str, dict[str, str]]) -> None:
    assume(is_plain(*fact))
    assert parse_fact(printed(*fact)) == fact


@given(tracked_facts(), st.integers(0, 400))
def test_a_fact_that_is_cut_off_is_never_taken_for_a_whole_one(
    fact: tuple[str, dict[str, str]], end: int
) -> None:
    text = printed(*fact)[:-1][:end]
    assume(not text.endswith("))"))
    with pytest.raises(FactSyntaxError):
        parse_fact(text)


@given(facts=st.lists(tracked_facts(), max_size=8))
def test_a_log_has_every_transition_whatever_strings_hold(
    facts: list[tuple[str, dict[str, str]]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """39 of 595 transitions of a real log were dropped: quotes, blanks and line feeds in strings."""
    path = tmp_path_factory.mktemp("log") / "fawkes.log"
    facts = [fact for fact in facts if is_plain(*fact)]
    path.write_text(
        "".join(
            f"D 12:00:00.{number:06d} CLIPS (executive): {entry}\n"
            for number, fact in enumerate(facts)
            for entry in as_fawkes_logs(f"==> f-{number:<5d} {printed(*fact)}")
        ),
        encoding="utf-8",
        newline="\n",
    )
    run: Iterable[Event] = open_run(path) if facts else []
    tracker = TransitionTracker("executive")
    expected = [tracker.track_assertion(number, *fact) for number, fact in enumerate(facts)]
    found = [event for event in run if isinstance(event, TRANSITION_TYPES)]
    start = 12 * 3600 * 1_000_000
    assert found == [replace(each, time_us=start + each.time_us) for each in expected if each is not None]


def as_fawkes_logs(text: str) -> list[str]:
    """The entries of a text: a string that is nothing but a line feed ends one, and is not printed."""
    return re.split(r'(?<=[ ]")\n(?="[ )])', text)
