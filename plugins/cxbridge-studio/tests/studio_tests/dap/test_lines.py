"""The meanings of a file's lines, and the calls that stop within right-hand sides."""

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
        (10, "first", 9),  # then: the action that it belongs to
        (11, "first", 11),
        (16, "first", 15),
        (17, "second", 0),
        (18, "second", 0),  # a function is not a rule
        (19, "second", 0),  # nothing on its right-hand side
    ],
)
def test_where_a_breakpoint_on_a_line_stops(line, rule, action_line):
    found_rule, found_line = find_stop_line(RULES, line)
    assert (found_rule.name, found_line) == (rule, action_line)
    assert find_stop_line(RULES, line, includes_actions=False) == (found_rule, 0)


def test_a_line_after_the_last_rule_is_an_error():
    with pytest.raises(CxbridgeError, match="no rule begins at this line or below"):
        find_stop_line(RULES, 20)


def test_only_variables_that_have_a_value_for_sure():
    names = {action.line: action.names for action in RULES[0].actions}
    assert names[8] == ("a", "x")
    assert names[11] == ("a", "x", "y")  # not ?gone, which is of the not
    assert names[14] == ("a", "x", "y", "z")
    assert names[15] == ("a", "x", "y")  # ?z perhaps


def test_a_variable_of_one_branch_of_or_has_no_value_for_sure():
    rule = next(find_rules("(defrule r (or (a ?x ?y) (b ?x)) (exists (c ?z)) => (f))"))
    assert rule.actions[0].names == ("x",)


ALL_RIGHTS = """
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
def environment(tmp_path, *, with_probes=True):
    """Load the rule of all kinds of actions, with facts for it; yield environment, debugger and probes."""
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    debugger = Debugger(env)
    probes = Probes(env, debugger) if with_probes else None
    file = tmp_path / "file.clp"
    file.write_text(ALL_RIGHTS)
    env.load(file)
    assert [str(each) for each in env.loader.diagnostics] == []
    env.assert_string("(goal (id g1))")
    env.assert_string("(go a b c)")
    yield env, debugger, probes
    env.destroy()


def test_rules_do_the_same_with_the_calls_in_them(tmp_path):
    found = []
    for with_probes in (False, True):
        with environment(tmp_path, with_probes=with_probes) as (env, _, _):
            env.run()
            found.append([slots["implied"] for _, _, slots in env.facts("result")])
    assert found[0] == found[1] != []


def test_it_stops_at_every_action_with_the_variables_there(tmp_path):
    seen = []

    def note(stop):
        seen.append((stop.line, dict(probes.values)))
        debugger.step("line")

    with environment(tmp_path) as (_, debugger, probes):
        debugger.on_stop = note
        debugger.step("line")
        debugger.run()
        assert probes.values is None
    by_line = dict(seen)
    assert [line for line, _ in seen[:4]] == [7, 8, 9, 9]
    assert [line for line, _ in seen].count(10) == 1 + 3  # the loop, and its body, three times
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


def test_no_line_of_any_file_moves(tmp_path):
    changed = 0
    with environment(tmp_path) as (_, _, probes):
        for file in FILES:
            text = file.read_bytes().decode("utf-8", "surrogateescape")
            made = probes.rewrite(str(file), text)
            assert [(d.kind, d.name, d.line) for d in definitions(made)] == [
                (d.kind, d.name, d.line) for d in definitions(text)
            ]
            changed += made != text
    assert changed > 20


def test_an_error_while_it_is_stopped_ends_the_run_and_is_kept(tmp_path):
    with environment(tmp_path) as (env, debugger, probes):
        debugger.on_stop = Mock(side_effect=KeyboardInterrupt)
        debugger.step("line")
        debugger.run()
        assert isinstance(probes.error, KeyboardInterrupt)
        assert env.is_ended
