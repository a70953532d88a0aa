"""Diagnoses of rules in small environments."""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import Symbol
from cxbridge_studio.explain.rules.diagnoser import diagnose
from cxbridge_studio.explain.rules.diagnosis import Count
from cxbridge_studio.explain.rules.environment import take_snapshot
from studio_tests.explain.worlds import diagnose_rule, list_counts, make_world

GOALS = (
    "(goal (id g1) (class TALK) (parent nil) (mode DISPATCHED))",
    "(goal (id g2) (class TALK) (parent g1) (mode FORMULATED) (params who bob))",
    "(goal (id g3) (class MOVE) (parent g1) (mode RETRACTED))",
)


def test_matching_condition_has_no_failure():
    diagnosis = diagnose_rule("(goal (id ?id)) (goal (parent ?id))", *GOALS)
    assert list_counts(diagnosis) == [(3, 3), (None, 2)]
    assert diagnosis.failing == 0
    assert diagnosis.failure is None
    assert diagnosis.matches == Count(2)
    assert sorted(diagnosis.bases) == ["f-1,f-2", "f-1,f-3"]


def test_failed_constant_names_nearest_facts():
    diagnosis = diagnose_rule("?g <- (goal (class TALK) (mode SELECTED))", *GOALS)
    assert list_counts(diagnosis) == [(0, 0)]
    assert diagnosis.failing == 1
    assert diagnosis.failure is not None
    assert [miss.fact for miss in diagnosis.failure.near] == [
        "f-2 (goal (id g2) (class TALK) (mode FORMULATED) ...)",
        "f-1 (goal (id g1) (class TALK) (mode DISPATCHED) ...)",
    ]
    for miss, mode in zip(diagnosis.failure.near, ("FORMULATED", "DISPATCHED"), strict=True):
        (deviation,) = miss.deviations
        assert (deviation.slot, deviation.value, deviation.wanted) == ("mode", mode, "SELECTED")


def test_empty_join_names_bound_value():
    diagnosis = diagnose_rule(
        "(robot (at ?place)) (goal (class ?place))", "(robot (name r) (at C-BS))", *GOALS
    )
    assert list_counts(diagnosis) == [(1, 1), (None, 0)]
    assert diagnosis.failing == 2
    assert diagnosis.failure is not None
    (deviation,) = diagnosis.failure.near[0].deviations
    assert deviation.wanted == "C-BS"
    assert deviation.known == ()


def test_failed_predicate_names_values_of_its_variables():
    diagnosis = diagnose_rule(
        "(robot (name ?n) (battery ?b&:(> ?b 50))) (robot (name ~?n) (battery ?c&:(> ?c ?b)))",
        "(robot (name a) (battery 80))",
        "(robot (name b) (battery 20))",
    )
    assert list_counts(diagnosis) == [(1, 1), (None, 0)]
    assert diagnosis.failure is not None
    (miss,) = [miss for miss in diagnosis.failure.near if miss.fact.startswith("f-2 ")]
    (deviation,) = miss.deviations
    assert deviation.value == "20"
    assert deviation.wanted == "?c&:(> ?c ?b)"
    assert deviation.known == ("?b = 80 (condition 1)",)


def test_deviations_of_ordered_facts_name_fields():
    diagnosis = diagnose_rule("(time ?s 5)", "(time 1 2)")
    assert diagnosis.failure is not None
    (miss,) = diagnosis.failure.near
    assert [(d.slot, d.value, d.wanted) for d in miss.deviations] == [("field 2", "2", "5")]


@pytest.mark.parametrize(
    ("rule", "facts", "kind", "details"),
    [
        ("(goal (id g1)) (not (goal (parent g1)))", (), "not", ["f-2", "f-3"]),
        ("(robot (battery ?b)) (test (> ?b 50))", ("(robot (name r) (battery 7))",), "test", ["?b = 7"]),
        ("(exists (goal (class TALK) (mode SELECTED)))", (), "exists", ["SELECTED"]),
        ("(forall (goal (id ?i)) (robot (name ?i)))", ("(robot (name g1))",), "forall", ["f-2", "f-3"]),
        (
            "(or (goal (mode SELECTED)) (and (goal (id g1)) (robot)) (not (goal (id g1))))",
            (),
            "or",
            ["not", "pattern", "pattern"],
        ),
    ],
)
def test_failure_has_kind_of_condition(rule, facts, kind, details):
    failure = diagnose_rule(rule, *GOALS, *facts).failure
    assert failure is not None
    assert failure.kind == kind
    named = [fact.split()[0] for fact in failure.facts] + [inner.kind for inner in failure.inner]
    wanted_values = [miss.deviations[0].wanted for miss in failure.near[:1]]
    assert sorted([*named, *wanted_values, *failure.values]) == details


def test_functions_and_globals_of_run_are_copied():
    diagnosis = diagnose_rule(
        "(robot (battery ?b&:(enough ?b)))",
        "(defglobal ?*least* = 30)",
        "(deffunction limit () ?*least*)",
        "(deffunction enough (?b) (> ?b (limit)))",
        "(robot (name r) (battery 31))",
    )
    assert list_counts(diagnosis) == [(1, 1)]


def test_function_with_query_finds_facts():
    diagnosis = diagnose_rule(
        "(robot (name ?n)) (test (known ?n))",
        "(deffunction known (?n) (any-factp ((?g goal)) (eq ?g:id ?n)))",
        "(robot (name g2))",
        *GOALS,
    )
    assert diagnosis.matches == Count(1)


def test_copy_keeps_indices_of_facts():
    with make_world(
        *GOALS, "(defrule it ?a <- (goal) ?b <- (robot) (test (= (+ 3 (fact-index ?a)) (fact-index ?b))) =>)"
    ) as env:
        env.retract(1)
        env.retract(2)
        env.assert_string("(goal (id g9))")
        env.assert_string("(robot (name r))")
        env.retract(4)
        env.assert_string("(robot (name s))")
        diagnosis = diagnose(take_snapshot(env, "it"))
    assert diagnosis.bases == ("f-3,f-6",)


def test_fact_address_in_slot_is_matched():
    rule = "(defrule it ?g <- (goal (id g1)) (robot (at ?g)) =>)"
    with make_world(*GOALS, rule) as env:
        env.eval("(do-for-fact ((?g goal)) (eq ?g:id g1) (assert (robot (name r) (at ?g))))")
        diagnosis = diagnose(take_snapshot(env, "it"))
    assert diagnosis.bases == ("f-1,f-4",)


def diagnose_with_host_function(rule):
    with make_world(*GOALS) as env:
        env.define("of-the-host", lambda: Symbol("TRUE"))
        env.build("(deffunction inner () (of-the-host))")
        env.build("(deffunction outer () (inner))")
        env.build(rule)
        snapshot = take_snapshot(env, "it")
        return diagnose(snapshot), snapshot


@pytest.mark.parametrize("call", ["(of-the-host)", "(outer)"])
def test_function_of_host_cannot_be_copied(call):
    diagnosis, snapshot = diagnose_with_host_function(f"(defrule it (goal (id ?i)) (test {call}) =>)")
    assert (
        diagnosis.unknown
        == "condition 2 cannot be matched on a copy: it calls 'of-the-host', which only the run has"
    )
    assert list_counts(diagnosis) == [(3, 3), (None, None)]
    assert "Pattern 1: 3" in snapshot.clips_counts


def test_errors_in_condition_are_listed():
    diagnosis = diagnose_rule("(robot (battery ?b)) (test (> ?b 1))", "(robot (name r) (battery low))")
    assert any("low" in error or "expected argument" in error for error in diagnosis.errors)


def test_too_many_facts_leave_counts_of_clips():
    with make_world(*GOALS, "(defrule it (goal (id ?i)) =>)") as env:
        snapshot = take_snapshot(env, "it", max_facts=2)
        diagnosis = diagnose(snapshot)
    assert "too many" in diagnosis.unknown
    assert snapshot.clips_counts[0] == "Pattern 1: 3"


def test_count_of_matches_has_limit(monkeypatch):
    monkeypatch.setattr("cxbridge_studio.explain.rules.matcher.MAX_MATCHES", 10)
    diagnosis = diagnose_rule("(goal) (goal) (goal)", *GOALS)
    assert str(diagnosis.elements[2].joined) == "10+"


def test_many_matches_are_compared_in_a_sample(monkeypatch):
    monkeypatch.setattr("cxbridge_studio.explain.rules.near_misses.MAX_PAIRS", 12)
    robots = [f"(robot (name r{number}) (battery {number}))" for number in range(12)]
    diagnosis = diagnose_rule("(robot (name ?n) (battery ?b)) (goal (id ?n) (params ?b))", *robots, *GOALS)
    assert diagnosis.failure is not None
    assert "in a sample" in diagnosis.failure.reason
    assert len(diagnosis.failure.near) == 3


@pytest.mark.parametrize(
    "rule",
    ["(robot (name ?n)) (not (goal (id ?n) (mode ~?n)))", "(not (not (robot)))", "(exists (robot) (goal))"],
)
def test_diagnosis_does_not_change_run(rule):
    with make_world(*GOALS, "(robot (name g1))", f"(defrule it {rule} =>)") as env:
        before = [(index, name, dict(slots)) for index, name, slots in env.facts()]
        agenda = take_snapshot(env, "it").agenda
        diagnose(take_snapshot(env, "it"))
        assert [(index, name, dict(slots)) for index, name, slots in env.facts()] == before
        assert take_snapshot(env, "it").agenda == agenda
        assert env.run() == len(agenda or ())
