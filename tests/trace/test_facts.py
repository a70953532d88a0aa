"""Printed facts read back, with strings that CLIPS does not escape."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import FactChange
from cxbridge.trace import facts
from cxbridge.trace.facts import FactSyntaxError, parse_fact, template_of
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
        patch.setattr(facts, "_plain_slots", lambda *_: None)
        assert fast == parsed()


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
