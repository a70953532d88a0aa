"""What CLIPS prints when it is watched: in the forms of 6.30 and 6.4, and by the CLIPS that is installed."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from random import Random

import clips
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, FactChange, GoalTransition, LogLine, RuleFired
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.formats.clips_watch import ClipsWatch

# of one program by both versions, shortened; CLIPS does not escape the quote and the line feed in the strings
GOAL = (
    '(goal (id "g1") (class A) (sub-type nil) (parent nil) (mode {}) (outcome UNKNOWN) (error)'
    ' (message "a "q"\nlines"))'
)
V630 = f"""\
<== Focus MAIN
==> Focus MAIN
<== f-0     (initial-fact)
:== ?*g* ==> 1 <== 1
==> f-0     (initial-fact)
==> f-1     {GOAL.format("FORMULATED")}
==> Activation 0      r1: f-1
FIRE    1 r1: f-1
<== f-1     {GOAL.format("FORMULATED")}
==> f-2     {GOAL.format("SELECTED")}
==> Activation 10     r2: f-2,*
hello from the program
==> f-3     (ord a 1 "x")
FIRE    2 r2: f-2,*
"""
V64 = f"""\
<== Focus MAIN
==> Focus MAIN
:== ?*g* ==> 1 <== 1
==> f-1     {GOAL.format("FORMULATED")}
==> Activation 0      r1: f-1
FIRE    1 r1: f-1
<== f-1     (goal ... (mode FORMULATED) ...)
==> f-1     (goal ... (mode SELECTED) ...)
==> Activation 10     r2: f-1,*
hello from the program
==> f-2     (ord a 1 "x")
FIRE    2 r2: f-1,*
"""


def read(path: Path, text: str | bytes) -> tuple[list[Event], list[str]]:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    run = open_run(path)
    assert isinstance(run, ClipsWatch)
    return list(run), run.notes


@pytest.mark.parametrize("text", [V630, V64], ids=["6.30", "6.4"])
def test_rules_facts_and_transitions(tmp_path: Path, text: str) -> None:
    events, notes = read(tmp_path / "watch", text)
    assert [event.rule for event in events if isinstance(event, RuleFired)] == ["r1", "r2"]
    changes = [
        event for event in events if isinstance(event, FactChange) and event.template != "initial-fact"
    ]
    assert [(event.asserted, event.text) for event in changes] == [
        (True, GOAL.format("FORMULATED")),
        (False, GOAL.format("FORMULATED")),
        (True, GOAL.format("SELECTED")),
        (True, '(ord a 1 "x")'),
    ]
    assert [event.mode for event in events if isinstance(event, GoalTransition)] == ["FORMULATED", "SELECTED"]
    assert "hello from the program" in [event.text for event in events if isinstance(event, LogLine)]
    assert [event.time_us for event in events] == sorted(event.time_us for event in events)
    assert not notes


def test_what_the_installed_clips_prints(tmp_path: Path) -> None:
    """A real run of CLIPS, into a file by its own means."""
    env = clips.Environment()
    path = tmp_path / "watch"
    env.eval(f'(dribble-on "{path}")')
    env.eval("(watch all)")
    env.build(
        "(deftemplate goal (slot id) (slot class) (slot sub-type) (slot parent) (slot mode (default NEW))"
        " (slot outcome) (multislot error) (slot note))"
    )
    env.build('(defrule go ?g <- (goal (mode NEW)) => (modify ?g (mode OLD) (error a "b ... (c)")))')
    env.build('(defrule again ?g <- (goal (mode OLD)) => (modify ?g (note "x) ... (y")) (retract ?g))')
    env.reset()
    env.assert_string('(goal (id g1) (note "two\nlines"))')
    assert env.run() == 2
    env.eval("(dribble-off)")
    run = open_run(path)
    events = list(run)
    assert isinstance(run, ClipsWatch)
    assert not run.notes
    assert [event.rule for event in events if isinstance(event, RuleFired)] == ["go", "again"]
    assert [event.mode for event in events if isinstance(event, GoalTransition)] == ["NEW", "OLD"]
    changes = [event for event in events if isinstance(event, FactChange)]
    assert [event.asserted for event in changes] == [True, False, True, False, True, False]
    assert changes[1].text == changes[0].text
    assert changes[5].text == changes[4].text
    assert '(error a "b ... (c)")' in changes[3].text


def test_output_without_a_line_feed_hides_nothing(tmp_path: Path) -> None:
    events, notes = read(
        tmp_path / "watch",
        "FIRE    1 a: f-1\nhelloFIRE    2 b: f-1,*\nso ==> f-2     (ord 1)\nno FIRE 3 here: as you see\n",
    )
    assert [event.rule for event in events if isinstance(event, RuleFired)] == ["a", "b"]
    assert [event.text for event in events if isinstance(event, FactChange)] == ["(ord 1)"]
    assert [event.text for event in events if isinstance(event, LogLine)] == [
        "hello",
        "so ",
        "no FIRE 3 here: as you see",
    ]
    assert not notes


def test_a_part_of_a_fact_that_never_was_asserted_is_told(tmp_path: Path) -> None:
    events, notes = read(tmp_path / "watch", "==> f-7     (goal ... (mode SELECTED) ...)\nFIRE    1 r: f-7\n")
    assert [type(event) for event in events] == [RuleFired]
    assert notes == [
        "line 1: fact f-7 is not readable: not all its slots are shown, and it was not asserted before"
    ]


@pytest.mark.parametrize("text", [V630, V64], ids=["6.30", "6.4"])
def test_cut_off_at_every_byte(tmp_path: Path, text: str) -> None:
    whole = [
        event for event in read(tmp_path / "whole", text)[0] if isinstance(event, FactChange | RuleFired)
    ]
    data = text.encode()
    for length in range(len(data)):
        (tmp_path / "cut").write_bytes(data[:length])
        with suppress(CxbridgeError):
            found = [
                event for event in open_run(tmp_path / "cut") if isinstance(event, FactChange | RuleFired)
            ]
            kept = found[:-1]  # the last one may be cut off within an ordered fact or the basis
            assert kept == whole[: len(kept)]


def test_damage_gives_our_errors_only(tmp_path: Path) -> None:
    random = Random(3)
    for _ in range(500):
        data = bytearray(V64.encode())
        for _ in range(random.randint(1, 8)):
            data[random.randrange(len(data))] = random.randrange(256)
        (tmp_path / "watch").write_bytes(data)
        with suppress(CxbridgeError):
            list(open_run(tmp_path / "watch"))


@given(st.text(max_size=60))
def test_any_text_in_between_is_a_log_line(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "watch"
    events, _ = read(
        path, f"FIRE    1 first: f-1\n{text}\nFIRE    2 last: f-1\n".encode("utf-8", "surrogatepass")
    )
    rules = [event.rule for event in events if isinstance(event, RuleFired)]
    assert (rules[0], rules[-1]) == ("first", "last")


def test_it_can_be_converted(tmp_path: Path) -> None:
    (tmp_path / "watch").write_text(V64)
    assert convert(open_run(tmp_path / "watch"), tmp_path / "run.mcap", "mcap") == []
    assert list(open_run(tmp_path / "run.mcap")) == list(open_run(tmp_path / "watch"))
