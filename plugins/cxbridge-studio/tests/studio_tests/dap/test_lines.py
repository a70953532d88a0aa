"""Breakpoints at lines, and the calls that stop a run within right-hand sides."""

from __future__ import annotations

from contextlib import contextmanager
from unittest.mock import Mock

import pytest

from cxbridge.clipstext.syntax import definitions
from cxbridge.clock import VirtualClock
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.resources import shipped_dir
from cxbridge_studio.dap.probes import Probes
from cxbridge_studio.dap.rule_lines import find_rules, find_stop_line
from cxbridge_studio.debugger.debugger import Debugger
from tests.support import FAWKES_DIR

TEXT = """\
; a comment
(deftemplate a (slot x))

(defrule first "with a text"
  ?a <- (a (x ?x&:(> ?x 1)))
  (not (b ?gone))
  =>
  (bind ?y (+ ?x 1))
  (if (> ?y 2)
   then
    (printout t "big " ?y crlf)
   else
    (bind ?z 3)
    (retract ?a))
  (assert (b ?y))
)

(deffunction f () 3)
(defrule second (b ?x) => )
"""


RULES = list(find_rules(TEXT))


@pytest.mark.parametrize(
    ("line", "rule", "action_line"),
    [
        (1, "first", 0),  # a comment: the next rule
        (6, "first", 0),  # a condition: the rule
        (8, "first", 8),
        (10, "first", 9),  # then: the action around it
        (11, "first", 11),
        (16, "first", 15),
        (17, "second", 0),
        (18, "second", 0),  # a function is not a rule
        (19, "second", 0),  # nothing on its right-hand side
    ],
)
def test_breakpoint_on_line_stops_at_rule_or_action(line, rule, action_line):
    found_rule, found_line = find_stop_line(RULES, line)
    assert (found_rule.name, found_line) == (rule, action_line)
    assert find_stop_line(RULES, line, includes_actions=False) == (found_rule, 0)


def test_line_after_last_rule_is_an_error():
    with pytest.raises(CxbridgeError, match="no rule begins at this line or below"):
        find_stop_line(RULES, 20)


def test_names_of_action_always_have_values():
    names = {action.line: action.names for action in RULES[0].actions}
    assert names[8] == ("a", "x")
    assert names[11] == ("a", "x", "y")  # ?gone belongs to the not
    assert names[14] == ("a", "x", "y", "z")
    assert names[15] == ("a", "x", "y")  # ?z has a value in one branch only


def test_variable_of_one_branch_of_or_is_no_name():
    rule = next(find_rules("(defrule r (or (a ?x ?y) (b ?x)) (or) (exists (c ?z)) => (f))"))
    assert rule.actions[0].names == ("x",)


ALL_ACTIONS = """
(deftemplate goal (slot id) (multislot params))
(defrule all
  ?go <- (go $?rest)
  (or (goal (id ?id)) (other ?id))
  =>
  (retract ?go)
  (bind ?sum 0)
  (progn (bind ?sum (+ ?sum 1)) (bind ?sum (+ ?sum 1)))
  (while (< ?sum 5) do (bind ?sum (+ ?sum 1)))
  (loop-for-count (?i 1 3) do (bind ?sum (+ ?sum ?i)))
  (loop-for-count 2 (bind ?sum (+ ?sum 1)))
  (progn$ (?each ?rest) (bind ?sum (+ ?sum ?each-index)))
  (foreach ?each ?rest (bind ?sum (+ ?sum ?each-index)))
  (do-for-all-facts ((?g goal)) (neq ?g:id nil) (bind ?sum (+ ?sum 1)) (modify ?g (params ?g:id)))
  (delayed-do-for-all-facts ((?g goal) (?h goal)) TRUE (bind ?sum (+ ?sum 1)))
  (switch ?sum (case 3 then (bind ?sum 4)) (default (bind ?sum (* 2 ?sum))))
  (bind ?if (if (> ?sum 3) then big else small))
  (bind ?rest) (bind ?again ?sum)
  (assert (result ?sum ?if ?id)))
"""


@contextmanager
def make_environment(tmp_path, *, with_probes=True):
    """Load a rule with all kinds of actions, and its facts; yield environment, debugger and probes."""
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    debugger = Debugger(env)
    probes = Probes(env, debugger) if with_probes else None
    file = tmp_path / "file.clp"
    file.write_text(ALL_ACTIONS)
    env.load(file)
    assert [str(diagnostic) for diagnostic in env.loader.diagnostics] == []
    env.assert_string("(goal (id g1))")
    env.assert_string("(go a b c)")
    yield env, debugger, probes
    env.destroy()


def test_probes_do_not_change_results_of_rule(tmp_path):
    results = []
    for with_probes in (False, True):
        with make_environment(tmp_path, with_probes=with_probes) as (env, _, _):
            env.run()
            results.append([slots["implied"] for _, _, slots in env.facts("result")])
    assert results[0] == results[1] != []


def test_line_steps_stop_at_each_action_with_variables(tmp_path):
    stops = []

    def note(stop):
        stops.append((stop.line, dict(probes.values)))
        debugger.step("line")

    with make_environment(tmp_path) as (_, debugger, probes):
        debugger.on_stop = note
        debugger.step("line")
        debugger.run()
        assert probes.values is None
    by_line = dict(stops)
    assert [line for line, _ in stops[:4]] == [7, 8, 9, 9]
    assert [line for line, _ in stops].count(10) == 1 + 3  # the loop, and three times the body
    assert by_line[11]["i"] == 3
    assert by_line[13]["each"] == "c"
    assert str(by_line[15]["g"]).startswith("<Fact-")
    assert "rest" not in by_line[20]
    assert by_line[20]["id"] == "g1"


FILES = sorted(
    [
        *CORE_DIR.rglob("*.clp"),
        *shipped_dir("scenarios").rglob("*.clp"),
        *([] if FAWKES_DIR is None else (FAWKES_DIR / "src").rglob("*.clp")),
    ]
)


def test_probes_keep_lines_of_definitions(tmp_path):
    changed = 0
    with make_environment(tmp_path) as (_, _, probes):
        for file in FILES:
            text = file.read_bytes().decode("utf-8", "surrogateescape")
            rewritten = probes.rewrite(str(file), text)
            assert [(d.kind, d.name, d.line) for d in definitions(rewritten)] == [
                (d.kind, d.name, d.line) for d in definitions(text)
            ]
            changed += rewritten != text
    assert changed > 20


def test_error_during_stop_ends_run_and_is_stored(tmp_path):
    with make_environment(tmp_path) as (env, debugger, probes):
        debugger.on_stop = Mock(side_effect=KeyboardInterrupt)
        debugger.step("line")
        debugger.run()
        assert isinstance(probes.error, KeyboardInterrupt)
        assert env.is_ended
