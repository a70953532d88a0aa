"""The environment: CLIPS 6.4 that behaves like 6.30 where agents notice."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest

from cxbridge.clock import VIRTUAL_EPOCH_US
from cxbridge.errors import ClipsError
from cxbridge.events import FactChange, Level, RuleFired
from cxbridge.executive.host.values import Symbol


def test_now_returns_time_of_clock(env):
    assert env.eval("(now)") == (VIRTUAL_EPOCH_US // 1_000_000, 0)


def test_multifields_are_not_flattened(env):
    got = []
    env.define("take", lambda *values: got.append(values), 0, 9)
    env.eval('(take 1 (create$ a b) "s" (create$))')
    assert got == [(1, (Symbol("a"), Symbol("b")), "s", ())]


def test_wrong_number_of_arguments_is_refused_by_parser(env):
    env.define("two", lambda a, b: a, 2)
    with pytest.raises(ClipsError, match="expected exactly 2 argument"):
        env.build("(defrule r (x) => (two 1))")


def test_too_large_integer_is_an_error(env, log):
    env.define("big", lambda: 2**64)
    with pytest.raises(ClipsError):
        env.eval("(big)")
    assert any("does not fit" in text for text in log.texts(Level.ERROR))


def test_exception_of_function_is_fault_of_its_rule_only(env, log):
    def fail():
        raise ValueError("boom")

    env.define("fail", fail)
    env.build("(defrule a (declare (salience 1)) (go) => (fail) (assert (unreached)))")
    env.build("(defrule b (go) => (assert (reached)))")
    env.assert_string("(go)")
    assert env.run() == 2
    assert [template for _, template, _ in env.facts()] == ["go", "reached"]
    assert env.faults == ["function 'fail' failed: ValueError: boom"]


def test_limited_run_stops_at_limit(env):
    env.build("(defrule r (n ?x) => (assert (m ?x)))")
    for number in range(5):
        env.assert_ordered("n", (number,))
    assert env.run(2) == 2
    assert env.run() == 3


def test_output_is_logged_line_by_line(env, log):
    env.eval('(progn (printout t "a " 1 crlf "b" crlf) (printout warn "w" crlf) (printout error "e" crlf))')
    env.eval('(printout debug "two" crlf "lines" crlf)')
    assert [(line.level, line.text) for line in log.lines] == [
        (Level.INFO, "a 1"),
        (Level.INFO, "b"),
        (Level.WARN, "w"),
        (Level.ERROR, "e"),
        (Level.DEBUG, "two"),
        (Level.DEBUG, "lines"),
    ]


def test_unfinished_line_is_logged_at_end_of_run(env, log):
    env.build('(defrule r (go) => (printout t "no end"))')
    env.assert_string("(go)")
    env.run()
    assert log.texts() == ["no end"]


def test_facts_are_asserted_with_defaults(env):
    env.build("(deftemplate thing (slot a (default 5)) (slot b) (multislot c))")
    index = env.assert_fact("thing", {"b": Symbol("x"), "c": (1, "two")})
    assert list(env.facts("thing")) == [(index, "thing", {"a": 5, "b": "x", "c": (1, "two")})]


def test_assertion_of_unknown_deftemplate_or_slot_is_one_error(env):
    with pytest.raises(ClipsError, match="no deftemplate 'thing'"):
        env.assert_fact("thing", {})
    env.build("(deftemplate thing (slot a))")
    with pytest.raises(ClipsError, match="'thing' does not accept this value in slot 'b'"):
        env.assert_fact("thing", {"b": 1})
    with pytest.raises(ClipsError, match="'thing' does not accept this value in slot 'a'"):
        env.assert_fact("thing", {"a": (1, 2)})
    with pytest.raises(ClipsError, match="no deftemplate 'nothing'"):
        env.assert_ordered("nothing", (1,))


def test_only_watched_facts_and_rules_are_events(bus, env):
    events: list[Any] = []
    bus.subscribe(events.append, FactChange, RuleFired)
    env.watcher.set_hooks()
    env.build("(defrule r (go ?x) => (assert (gone ?x)))")
    env.build("(defrule quiet (gone ?) => )")
    env.eval("(watch facts)")
    env.eval("(watch rules)")
    env.eval("(unwatch rules quiet)")
    env.assert_string("(go 1)")
    env.run()
    assert [
        (type(event).__name__, getattr(event, "text", getattr(event, "rule", ""))) for event in events
    ] == [
        ("FactChange", "(go 1)"),
        ("RuleFired", "r"),
        ("FactChange", "(gone 1)"),
    ]
    assert events[1].basis == "f-1"


def test_unwatch_of_missing_template_is_an_error_as_in_clips(env, log):
    with pytest.raises(ClipsError):
        env.eval("(unwatch facts nothing)")
    assert any("Unable to find deftemplate 'nothing'" in text for text in log.texts(Level.ERROR))


def test_exit_ends_run_but_not_process(env):
    env.build("(defrule r (go) => (exit) (assert (after)))")
    env.assert_string("(go)")
    env.run()
    assert env.quit_requested
    assert list(env.facts("after")) == []
    env.assert_string("(go again)")
    assert env.run() == 0


def test_quit_requests_end_without_ending_run(env):
    env.build("(defrule r (go) => (quit) (assert (after)))")
    env.build("(defrule bye (after) (executive-finalize) => (assert (said-good-bye)))")
    env.assert_string("(go)")
    assert env.run() == 1
    assert env.quit_requested
    env.assert_string("(executive-finalize)")
    assert env.run() == 1
    assert len(list(env.facts("said-good-bye"))) == 1


def test_destroyed_environment_prints_nothing():
    program = """
from cxbridge.clock import VirtualClock
from cxbridge.events import *
from cxbridge.executive.host.environment import ClipsEnvironment
bus = EventBus(VirtualClock())
bus.subscribe(lambda event: None, FactChange, RuleFired)
for _ in range(3):
    env = ClipsEnvironment("e", bus)
    env.watcher.set_hooks()
    env.build("(deftemplate a (slot x (type FLOAT)) (multislot y (type SYMBOL)))")
    env.build("(defrule r ?f <- (a (x ?v&:(< ?v 9))) => (cx-modify ?f x (create$ (+ 1 ?v)) y (create$ 1 2)))")
    env.eval("(watch facts)")
    env.assert_fact("a", {"x": 1})
    env.run()
    try:
        env.assert_fact("a", {"x": (1, 2)})
    except Exception:
        pass
    env.destroy()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_retraction_event_names_template_of_reused_index(env, bus):
    events: list[FactChange] = []
    bus.subscribe(events.append, FactChange)
    env.watcher.set_hooks()
    env.build("(deftemplate a (slot x))")
    env.build("(deftemplate b (slot y))")
    env.eval("(watch facts a)")
    first = env.assert_string("(a (x 1))")
    env.eval("(reset)")
    indices = [env.assert_string(f"(b (y {number}))") for number in range(20)]
    env.eval("(watch facts)")
    events.clear()
    env.retract(first)
    assert [event.text for event in events] == [f"(b (y {indices.index(first)}))"]


def test_logical_names_of_6_30_and_colours_of_ros_2_print(env, log):
    names = "wwarning werror wdialog wtrace wdisplay wclips red green blue yellow magenta cyan white bold"
    env.build(
        "(defrule r (a) => (foreach ?name (create$ " + names + ") (printout ?name ?name crlf))"
        " (printout t end crlf))"
    )
    env.assert_string("(a)")
    env.run()
    assert log.texts(Level.WARN) == ["wwarning"]
    assert log.texts(Level.ERROR) == ["werror"]
    assert log.texts(Level.DEBUG) == ["wdialog", "wtrace"]
    assert log.texts(Level.INFO) == [*names.split()[4:], "end"]


def test_duplicate_with_many_values_for_single_slot_is_an_error(env, log, clp):
    assert env.load(
        clp(
            "(deftemplate t (slot a) (multislot m))"
            "(defrule r ?f <- (t (a 1)) => (duplicate ?f (a (create$ 1 2))))"
            "(defrule s ?f <- (t (a 2)) => (assert (same (duplicate ?f (a 2)) (duplicate ?f (a 3) (m x y)))))"
        )
    )
    env.assert_string("(t (a 1))")
    env.assert_string("(t (a 2))")
    env.run()
    assert "single field slot 'a'" in " ".join(log.texts(Level.ERROR))
    assert [slots for _, name, slots in env.facts("t")][-1] == {"a": 3, "m": ("x", "y")}
    assert [slots["implied"][0] for _, _, slots in env.facts("same")] == ["FALSE"]


def test_modify_sees_slots_of_redefined_template(env, clp):
    before = "(deftemplate t (slot a))\n(modify (assert (t (a 1))) (a 2))\n(clear)\n"
    assert env.batch(clp(before + "(deftemplate t (slot b))\n(modify (assert (t (b 1))) (b 2))\n"))
    assert [slots for _, _, slots in env.facts("t")] == [{"b": 2}]


@pytest.mark.parametrize("firings", [19, 20, 21, 100, 1000])
def test_chunks_of_run_are_not_logged(env, log, firings):
    """CLIPS prints that a limit is reached; where a chunk ends depends on the speed of the machine."""
    env.build(f"(defrule count ?f <- (n ?x&:(< ?x {firings})) => (retract ?f) (assert (n (+ ?x 1))))")
    env.assert_string("(n 0)")
    assert env.run() == firings
    assert log.texts() == []


def test_columns_without_slot_are_empty(env):
    env.build("(deftemplate goal (slot id) (multislot meta))")
    env.assert_string("(goal (id G) (meta a b))")
    assert list(env.columns("goal", "id", "meta")) == [(Symbol("G"), (Symbol("a"), Symbol("b")))]
    assert list(env.columns("goal", "mode", "id")) == []
    assert list(env.columns("plan", "id")) == []
