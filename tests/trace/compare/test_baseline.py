"""Accepted differences: matched by their texts, each with a reason; nothing else is accepted."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from random import Random

import pytest

from cxbridge.errors import TraceError
from cxbridge.events import Event
from cxbridge.trace.compare.baseline import accept, load_baseline, write_baseline
from cxbridge.trace.compare.model import Comparison, Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.mutations import renumber
from tests.trace.runs import MemoryRun, family, goal, skill

EVENTS = family()
OTHER: list[Event] = [
    *EVENTS[:12],
    skill("odd{}", "S_RUNNING"),
    *EVENTS[13:-1],
    goal("RUN-gen3", "FINISHED", "COMPLETED", goal_class="PARENT"),
]


def compare(b: Sequence[Event] = OTHER, order: Order = Order.TOTAL) -> Comparison:
    return compare_runs(MemoryRun(EVENTS), [MemoryRun(b)], order=order)


def baseline(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "baseline.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("order", Order)
def test_what_was_written_accepts_the_same_differences_with_other_names(tmp_path: Path, order: Order) -> None:
    path = tmp_path / "baseline.yaml"
    found = compare(order=order)
    assert write_baseline(path, found, "known") == found.total == 2
    again = compare(renumber(OTHER, Random(3)), order)
    assert accept(again, load_baseline(path)) == []
    assert again.same
    assert [each.reason for each in again.accepted] == ["known", "known"]


def test_a_reason_is_wanted(tmp_path: Path) -> None:
    path = tmp_path / "baseline.yaml"
    write_baseline(path, compare(), "")
    with pytest.raises(TraceError, match="reason") as caught:
        load_baseline(path)
    assert caught.value.line == 4


def test_what_is_not_listed_remains_and_what_led_to_it_is_that_of_the_first_that_remains(
    tmp_path: Path,
) -> None:
    comparison = compare()
    path = baseline(tmp_path, "differences:\n- {what: another skill string, reason: other voice}\n")
    assert accept(comparison, load_baseline(path)) == []
    assert [difference.what for difference in comparison.differences] == ["another outcome and error"]
    assert comparison.rows == []


@pytest.mark.parametrize(
    ("entry", "accepted"),
    [
        ("kind: changed", 2),
        ("kind: order", 0),
        ("what: another*", 2),
        ("what: another", 0),
        ("subject: skiller*", 1),
        ("a: '*skill=\"say{}\"*'", 1),
        ("b: '*outcome=COMPLETED*', subject: goal RUN-gen77 of class PARENT", 1),
        ("what: '*', level: skills", 0),
        ("what: '*', level: transitions, order: total", 2),
        ("what: '*', order: partial", 0),
        ("what: '*', times: 1", 1),
    ],
)
def test_what_an_entry_accepts(tmp_path: Path, entry: str, accepted: int) -> None:
    comparison = compare()
    unused = accept(
        comparison, load_baseline(baseline(tmp_path, f"differences:\n- {{{entry}, reason: x}}\n"))
    )
    assert len(comparison.accepted) == accepted
    applies = "skills" not in entry and "partial" not in entry
    assert len(unused) == (0 if accepted or not applies else 1)
    assert all(str(entry).startswith("line 2: ") for entry in unused)


def test_equal_differences_are_one_entry_that_is_used_up(tmp_path: Path) -> None:
    events = [goal("gen1", "A"), goal("gen1", "B"), goal("gen2", "A"), goal("gen2", "B")]
    odd = [goal("gen1", "A"), goal("gen1", "B", "FAILED"), goal("gen2", "A"), goal("gen2", "B", "FAILED")]
    path = tmp_path / "baseline.yaml"
    comparison = compare_runs(MemoryRun(events), [MemoryRun(odd)])
    assert write_baseline(path, comparison, "known") == 1
    (entry,) = load_baseline(path)
    assert entry.entry.times == 2
    accept(comparison, [entry])
    assert comparison.same


def test_a_new_baseline_keeps_the_old_reasons(tmp_path: Path) -> None:
    comparison = compare()
    path = baseline(tmp_path, "differences:\n- {what: another skill string, reason: other voice}\n")
    accept(comparison, load_baseline(path))
    write_baseline(path, comparison, "new")
    assert [each.entry.reason for each in load_baseline(path)] == ["other voice", "new"]


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("differences: [", "is not YAML", 1),
        ("- a\n- b\n", "is not a baseline", 1),
        ("differences: 3\n", "is not a baseline", 1),
        ("differences:\n- 3\n", "Expected `object`, got `int`", 2),
        ("differences:\n- {reason: x}\n", "an entry that accepts everything", 2),
        ("differences:\n- {what: x}\n", "missing required field `reason`", 2),
        ("differences:\n- {what: x, reason: ' '}\n", "at `$.reason`", 2),
        ("differences:\n- {what: x, reason: x}\n- {wat: x, reason: x}\n", "unknown field `wat`", 3),
        ("differences:\n- {what: x, reason: x, times: 0}\n", ">= 1 - at `$.times`", 2),
        ("differences:\n- {kind: odd, reason: x}\n", "Invalid enum value 'odd' - at `$.kind`", 2),
    ],
)
def test_what_is_no_baseline_is_refused(tmp_path: Path, text: str, message: str, line: int) -> None:
    path = baseline(tmp_path, text)
    with pytest.raises(TraceError, match=re.escape(message)) as caught:
        load_baseline(path)
    assert (caught.value.file, caught.value.line) == (str(path), line)


def test_an_empty_baseline_accepts_nothing(tmp_path: Path) -> None:
    assert load_baseline(baseline(tmp_path, "# nothing yet\n")) == []
    with pytest.raises(TraceError, match="cannot be read"):
        load_baseline(tmp_path / "absent.yaml")


def test_too_many_differences_are_not_accepted(tmp_path: Path) -> None:
    events = [goal("gen1", f"MODE-{at}") for at in range(2500)]
    odd = [goal("gen1", f"MODE-{at}", "ODD" if at % 2 else "UNKNOWN") for at in range(2500)]
    comparison = compare_runs(MemoryRun(events), [MemoryRun(odd)])
    with pytest.raises(TraceError, match="1250 differences are too many to accept"):
        write_baseline(tmp_path / "baseline.yaml", comparison, "")
    everything = load_baseline(baseline(tmp_path, "differences:\n- {what: '*', reason: x}\n"))
    accept(comparison, everything)
    assert not comparison.same
