"""Runs as trace events."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import CxbridgeError
from cxbridge.events import (
    Event,
    FactChange,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.history.builder import RunHistory
from cxbridge.history.linking import find_skill_links
from cxbridge.trace.formats.registry import open_run
from cxbridge_web.timeline.export import make_trace_events, write_timeline
from cxbridge_web.timeline.goals import DROPPED_NOTE, INDENT, OPEN_NOTE
from cxbridge_web.timeline.reading import read_timeline
from tests.trace.events import events
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun, family, goal, recording
from web_tests.test_escaping import HOSTILE
from web_tests.test_report import hostile
from web_tests.timeline.checker import check, counts, load, threads


def made(*run: Event) -> list[dict[str, Any]]:
    found = list(make_trace_events(read_timeline(MemoryRun(run))))
    check(found)
    return found


def act(time: int, action: str, state: str, goal_id: str = "g") -> PlanActionTransition:
    return PlanActionTransition(time, "executive", action, goal_id, "plan", action, state)


def say(time: int, text: str, state: str, msgid: int = 1) -> SkillStatus:
    return SkillStatus(time, "executive", "Skiller", text, msgid, state)


def slices(found: list[dict[str, Any]], category: str) -> list[str]:
    return [each["name"] for each in found if each["ph"] == "B" and each["cat"] == category]


def test_goals_are_tracks_below_their_parents():
    found = made(*family())
    assert threads(found)[:4] == [
        "RUN-gen3 PARENT",
        f"{INDENT}gen1 WORK",
        f"{INDENT * 2}plan gen1-PLAN",
        f"{INDENT}gen2 WORK",
    ]
    assert sorted(slices(found, "goal")) == ["RUN-gen3 PARENT", "gen1 WORK", "gen2 WORK"]


def test_deep_goals_still_have_their_names():
    found = made(*(goal(f"g{n}", "FORMULATED", parent=f"g{n - 1}") for n in range(50)))
    assert threads(found)[-1] == f"{INDENT * 12}g49 WORK"


def test_modes_are_slices_of_the_goal_and_tell_outcome_and_error():
    found = made(*family())
    assert "FINISHED FAILED" in slices(found, "mode")
    failed = next(each for each in found if each["ph"] == "B" and each["name"] == "gen2 WORK")
    assert failed["args"]["error"] == "NO-PLAN"
    assert failed["args"]["parent"] == "RUN-gen3"


def test_a_goal_that_is_retracted_and_comes_again_has_two_lives():
    times = [("FORMULATED", 0), ("RETRACTED", 5), ("FORMULATED", 5), ("RETRACTED", 9)]
    found = made(*(goal("a", mode, time_us=time) for mode, time in times))
    assert slices(found, "goal") == ["a WORK", "a WORK"]
    assert OPEN_NOTE not in str(found)


def test_what_is_not_over_ends_with_the_recording():
    found = made(
        goal("g", "FORMULATED"), act(1, "1", "PENDING"), say(2, "a", "S_RUNNING"), say(9, "a", "S_RUNNING")
    )
    assert str(found).count(OPEN_NOTE) == 4
    assert {
        each["ts"] for each in found if each["ph"] == "E" and each["cat"] in {"goal", "action", "skill"}
    } == {9}


def test_an_action_that_is_not_over_ends_with_its_goal():
    found = made(
        goal("g", "FORMULATED"),
        act(1, "1", "PENDING"),
        goal("g", "RETRACTED", time_us=5),
        LogLine(9, Level.INFO, "c", "later"),
    )
    action = next(each for each in found if each["ph"] == "B" and each["cat"] == "action")
    assert action["args"]["note"] == DROPPED_NOTE
    assert {each["ts"] for each in found if each["ph"] == "E"} == {5}


def test_actions_that_overlap_have_tracks_of_their_own():
    found = made(
        goal("g", "FORMULATED"),
        *(act(0, name, "FORMULATED") for name in "123"),
        act(1, "1", "PENDING"),
        act(2, "2", "PENDING"),
        act(3, "1", "FINAL"),
        act(4, "2", "FINAL"),
    )
    assert threads(found) == ["g WORK", f"{INDENT}plan plan", f"{INDENT}plan plan (2)"]
    plan = next(each for each in found if each["ph"] == "B" and each["cat"] == "plan")
    assert plan["args"]["not begun"] == "3 3"


def test_an_arrow_leads_from_action_to_skill_to_write():
    def write(time: int, status: str) -> InterfaceWrite:
        values = {"skill_string": "a{}", "msgid": 1, "status": status, "error": ""}
        return InterfaceWrite(time, "SkillerInterface::Skiller", values)

    found = made(
        goal("g", "FORMULATED"),
        act(1, "a", "FORMULATED"),
        act(1, "a", "WAITING"),
        write(2, "S_RUNNING"),
        say(3, "a{}", "S_RUNNING"),
        act(3, "a", "RUNNING"),
        write(7, "S_FINAL"),
        say(8, "a{}", "S_FINAL"),
        act(8, "a", "FINAL"),
    )
    flow = [(each["ph"], each["ts"]) for each in found if each.get("cat") == "flow"]
    assert flow == [("s", 1 - 0), ("t", 2), ("t", 3), ("f", 7)]


def test_of_two_that_waited_the_one_of_the_skills_name_ran_it():
    run = [
        goal("g", "FORMULATED"),
        act(1, "other", "WAITING"),
        act(1, "move", "WAITING"),
        say(2, "move{}", "S_RUNNING"),
        act(2, "other", "RUNNING"),
        act(2, "move", "RUNNING"),
    ]
    (link,) = find_skill_links(RunHistory.from_events(run))
    assert link.action.name == "move"


def test_of_two_that_waited_the_one_that_ended_with_the_skill_ran_it():
    second = 1_000_000
    run = [
        goal("g", "FORMULATED"),
        act(1, "kitchen", "WAITING"),
        act(1, "office", "WAITING"),
        say(2, "move{office}", "S_RUNNING"),
        act(2, "kitchen", "RUNNING"),
        act(2, "office", "RUNNING"),
        say(5 * second, "move{office}", "S_FINAL"),
        act(5 * second, "office", "EXECUTION-SUCCEEDED"),
        act(9 * second, "kitchen", "EXECUTION-SUCCEEDED"),
    ]
    (link,) = find_skill_links(RunHistory.from_events(run))
    assert link.action.name == "office"


def test_a_skill_that_no_action_waited_for_has_no_arrow():
    assert find_skill_links(RunHistory.from_events([say(1, "a", "S_RUNNING"), say(2, "a", "S_FINAL")])) == []


def test_counters_tell_of_facts_and_firings():
    changes = [FactChange(time, "e", time != 3, time, "t", "(t)") for time in range(5)]
    found = made(*changes, RuleFired(5, "e", 1, "r", ""), RuleFired(250_000, "e", 2, "r", ""))
    values = [(each["name"], each["ts"], *each["args"].values()) for each in found if each["ph"] == "C"]
    assert ("facts", 4, 3) in values
    assert [each[1:] for each in values if each[0] == "rules"] == [
        (0, 1),
        (100_000, 0),
        (200_000, 1),
        (300_000, 0),
    ]


def test_calls_of_planners_that_overlap_have_tracks_of_their_own():
    def call(time: int, ident: str, status: str) -> PlannerCall:
        return PlannerCall(time, "e", ident, "g", "auto", "d", "(p)", status, 5, 3, "")

    found = made(
        call(0, "1", "started"), call(1, "2", "started"), call(2, "1", "found"), call(3, "2", "none")
    )
    assert threads(found) == ["planner", "planner"]
    assert [each["args"]["status"] for each in found if each["ph"] == "B"] == ["found", "none"]


def test_messages_are_instants_on_their_interface():
    found = made(InterfaceMessage(7, "T::i", "StopMessage", 4, "me", "queued", {}))
    assert [each["name"] for each in found if each["ph"] == "i"] == ["StopMessage 4 queued from me: "]


def test_log_lines_are_instants():
    found = made(LogLine(0, Level.WARN, "c", "first\nsecond"))
    line = next(each for each in found if each["ph"] == "i")
    assert (line["name"], line["args"]) == ("W first", {"level": "warning", "text": "first\nsecond"})


def test_lines_of_the_same_time_are_not_stacked_and_keep_their_order():
    lines = [
        LogLine(5, level, "c", str(number))
        for number, level in enumerate([Level.INFO, Level.ERROR, Level.INFO])
    ]
    found = [each for each in made(*lines) if each["ph"] == "i"]
    assert [each["name"] for each in found] == ["I 0", "E 1", "I 2"]
    assert [each["ts"] for each in found] == [0, 0.001, 0.002]


def test_the_file_has_characters_not_escapes(tmp_path):
    path = tmp_path / "run.json"
    write_timeline(
        MemoryRun([goal("a", "FORMULATED"), goal("ü", "FORMULATED", parent="a", error="\udcff")]), path
    )
    assert f'"{INDENT}ü WORK"' in path.read_text(encoding="utf-8")
    load(path)


@given(st.lists(events, max_size=40))
def test_any_events_make_a_timeline(several):
    made(*several)


runs = st.lists(
    st.one_of(
        st.builds(
            goal,
            st.sampled_from("abc"),
            st.sampled_from(["FORMULATED", "SELECTED", "RETRACTED"]),
            parent=st.sampled_from("abcd"),
        ),
        st.builds(
            act,
            st.just(0),
            st.sampled_from("12"),
            st.sampled_from(["FORMULATED", "WAITING", "RUNNING", "FINAL"]),
            st.sampled_from("ab"),
        ),
        st.builds(
            say,
            st.just(0),
            st.sampled_from(["1{}", "2{}"]),
            st.sampled_from(["S_RUNNING", "S_FINAL", "S_INACTIVE"]),
            st.integers(0, 2),
        ),
        st.builds(
            InterfaceWrite,
            st.just(0),
            st.just("SkillerInterface::Skiller"),
            st.fixed_dictionaries(
                {"status": st.sampled_from(["S_RUNNING", "S_FINAL"]), "msgid": st.integers(0, 2)}
            ),
        ),
    ),
    max_size=40,
)


@given(runs)
def test_slices_nest_and_arrows_have_ends_whatever_goals_and_skills_do(several):
    made(*several)


def test_hostile_strings_are_named_with_visible_characters():
    found = made(*hostile())
    assert all(each["name"].isprintable() for each in found)
    assert HOSTILE[0] in str(found)


@pytest.mark.parametrize(
    "run",
    [
        pytest.param([], id="empty"),
        pytest.param([LogLine(5, Level.INFO, "c", "only a line")], id="no goals"),
        pytest.param(family()[:-5], id="cut off"),
        pytest.param(
            [goal("a", "FORMULATED", time_us=99_000_000), goal("a", "FINISHED", time_us=3)],
            id="clock set back",
        ),
        pytest.param([goal("a", "FORMULATED", parent="b"), goal("b", "FORMULATED", parent="a")], id="circle"),
        pytest.param([goal(f"g{n}", "FORMULATED", parent=f"g{n - 1}") for n in range(3000)], id="deep"),
    ],
)
def test_any_run_makes_a_file(tmp_path, run):
    path = tmp_path / "run.json"
    count, _ = write_timeline(MemoryRun(run), path)
    assert len(load(path)) == count


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs the recordings of Fawkes, shared/traces")
@pytest.mark.parametrize("name", NAMES)
def test_the_recordings_of_fawkes(tmp_path, name):
    path = tmp_path / "run.json"
    write_timeline(open_run(recording(name)), path)
    found = counts(load(path))
    assert found["i rule"] == 728
    assert found["B skill"] == 4
    assert found["s flow"] == found["f flow"] == 4


def test_a_file_that_cannot_be_written_is_one_error(tmp_path):
    (tmp_path / "no").touch()
    with pytest.raises(CxbridgeError, match="cannot be written"):
        write_timeline(MemoryRun([]), tmp_path / "no" / "x.json")
