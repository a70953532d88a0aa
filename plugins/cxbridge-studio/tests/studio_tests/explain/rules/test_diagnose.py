"""Each diagnosis, in a world where the answer is known."""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import Symbol
from cxbridge_studio.explain.rules.diagnose import diagnose
from cxbridge_studio.explain.rules.diagnosis import Count
from cxbridge_studio.explain.rules.environment import take_snapshot
from studio_tests.explain.worlds import diagnosis_of, numbers, world

GOALS = (
    "(goal (id g1) (class TALK) (parent nil) (mode DISPATCHED))",
    "(goal (id g2) (class TALK) (parent g1) (mode FORMULATED) (params who bob))",
    "(goal (id g3) (class MOVE) (parent g1) (mode RETRACTED))",
)


def test_a_condition_that_matches():
    found = diagnosis_of("(goal (id ?id)) (goal (parent ?id))", *GOALS)
    assert numbers(found) == [(3, 3), (None, 2)]
    assert found.failing == 0
    assert found.failure is None
    assert found.matches == Count(2)
    assert sorted(found.bases) == ["f-1,f-2", "f-1,f-3"]


def test_a_constant_that_no_fact_has():
    found = diagnosis_of("?g <- (goal (class TALK) (mode SELECTED))", *GOALS)
    assert numbers(found) == [(0, 0)]
    assert found.failing == 1
    assert found.failure is not None
    assert [miss.fact for miss in found.failure.near] == [
        "f-2 (goal (id g2) (class TALK) (mode FORMULATED) ...)",
        "f-1 (goal (id g1) (class TALK) (mode DISPATCHED) ...)",
    ]
    for miss, mode in zip(found.failure.near, ("FORMULATED", "DISPATCHED"), strict=True):
        (deviation,) = miss.deviations
        assert (deviation.slot, deviation.value, deviation.wanted) == ("mode", mode, "SELECTED")


def test_a_join_that_is_empty_names_where_the_value_comes_from():
    found = diagnosis_of("(robot (at ?place)) (goal (class ?place))", "(robot (name r) (at C-BS))", *GOALS)
    assert numbers(found) == [(1, 1), (None, 0)]
    assert found.failing == 2
    assert found.failure is not None
    (deviation,) = found.failure.near[0].deviations
    assert deviation.wanted == "C-BS"
    assert deviation.known == ()


def test_predicates_and_variables_of_the_pattern_itself():
    found = diagnosis_of(
        "(robot (name ?n) (battery ?b&:(> ?b 50))) (robot (name ~?n) (battery ?c&:(> ?c ?b)))",
        "(robot (name a) (battery 80))",
        "(robot (name b) (battery 20))",
    )
    assert numbers(found) == [(1, 1), (None, 0)]
    assert found.failure is not None
    (miss,) = [miss for miss in found.failure.near if miss.fact.startswith("f-2 ")]
    (deviation,) = miss.deviations
    assert deviation.value == "20"
    assert deviation.wanted == "?c&:(> ?c ?b)"
    assert deviation.known == ("?b = 80 (condition 1)",)


def test_ordered_facts_by_their_fields():
    found = diagnosis_of("(time ?s 5)", "(time 1 2)")
    assert found.failure is not None
    (miss,) = found.failure.near
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
def test_each_kind_of_condition_names_its_failure(rule, facts, kind, details):
    failure = diagnosis_of(rule, *GOALS, *facts).failure
    assert failure is not None
    assert failure.kind == kind
    named = [fact.split()[0] for fact in failure.facts] + [inner.kind for inner in failure.inner]
    wanted = [miss.deviations[0].wanted for miss in failure.near[:1]]
    assert sorted([*named, *wanted, *failure.values]) == details


def test_functions_and_globals_of_the_run_are_copied():
    found = diagnosis_of(
        "(robot (battery ?b&:(enough ?b)))",
        "(defglobal ?*least* = 30)",
        "(deffunction limit () ?*least*)",
        "(deffunction enough (?b) (> ?b (limit)))",
        "(robot (name r) (battery 31))",
    )
    assert numbers(found) == [(1, 1)]


def test_a_function_that_queries_facts_sees_them():
    found = diagnosis_of(
        "(robot (name ?n)) (test (known ?n))",
        "(deffunction known (?n) (any-factp ((?g goal)) (eq ?g:id ?n)))",
        "(robot (name g2))",
        *GOALS,
    )
    assert found.matches == Count(1)


def test_fact_indices_in_a_condition_are_those_of_the_run():
    with world(
        *GOALS, "(defrule it ?a <- (goal) ?b <- (robot) (test (= (+ 3 (fact-index ?a)) (fact-index ?b))) =>)"
    ) as env:
        env.retract(1)
        env.retract(2)
        env.assert_string("(goal (id g9))")
        env.assert_string("(robot (name r))")
        env.retract(4)
        env.assert_string("(robot (name s))")
        found = diagnose(take_snapshot(env, "it"))
    assert found.bases == ("f-3,f-6",)


def test_a_fact_address_in_a_slot():
    rule = "(defrule it ?g <- (goal (id g1)) (robot (at ?g)) =>)"
    with world(*GOALS, rule) as env:
        env.eval("(do-for-fact ((?g goal)) (eq ?g:id g1) (assert (robot (name r) (at ?g))))")
        found = diagnose(take_snapshot(env, "it"))
    assert found.bases == ("f-1,f-4",)


def host_world(rule):
    with world(*GOALS) as env:
        env.define("of-the-host", lambda: Symbol("TRUE"))
        env.build("(deffunction inner () (of-the-host))")
        env.build("(deffunction outer () (inner))")
        env.build(rule)
        snapshot = take_snapshot(env, "it")
        return diagnose(snapshot), snapshot


@pytest.mark.parametrize("call", ["(of-the-host)", "(outer)"])
def test_a_function_of_the_host_cannot_be_copied(call):
    found, snapshot = host_world(f"(defrule it (goal (id ?i)) (test {call}) =>)")
    assert (
        found.unknown
        == "condition 2 cannot be matched on a copy: it calls 'of-the-host', which only the run has"
    )
    assert numbers(found) == [(3, 3), (None, None)]
    assert "Pattern 1: 3" in snapshot.clips_counts


def test_errors_in_a_condition_are_told():
    found = diagnosis_of("(robot (battery ?b)) (test (> ?b 1))", "(robot (name r) (battery low))")
    assert any("low" in error or "expected argument" in error for error in found.errors)


def test_too_many_facts_leave_clips_own_numbers():
    with world(*GOALS, "(defrule it (goal (id ?i)) =>)") as env:
        snapshot = take_snapshot(env, "it", max_facts=2)
        found = diagnose(snapshot)
    assert "too many" in found.unknown
    assert snapshot.clips_counts[0] == "Pattern 1: 3"


def test_counting_ends_somewhere(monkeypatch):
    monkeypatch.setattr("cxbridge_studio.explain.rules.matcher.MAX_MATCHES", 10)
    found = diagnosis_of("(goal) (goal) (goal)", *GOALS)
    assert str(found.elements[2].joined) == "10+"


def test_a_sample_of_many_matches(monkeypatch):
    monkeypatch.setattr("cxbridge_studio.explain.rules.near_misses.MAX_PAIRS", 12)
    robots = [f"(robot (name r{number}) (battery {number}))" for number in range(12)]
    found = diagnosis_of("(robot (name ?n) (battery ?b)) (goal (id ?n) (params ?b))", *robots, *GOALS)
    assert found.failure is not None
    assert "in a sample" in found.failure.reason
    assert len(found.failure.near) == 3


@pytest.mark.parametrize(
    "rule",
    ["(robot (name ?n)) (not (goal (id ?n) (mode ~?n)))", "(not (not (robot)))", "(exists (robot) (goal))"],
)
def test_nothing_in_the_run_is_touched(rule):
    with world(*GOALS, "(robot (name g1))", f"(defrule it {rule} =>)") as env:
        before = [(index, name, dict(slots)) for index, name, slots in env.facts()]
        agenda = take_snapshot(env, "it").agenda
        diagnose(take_snapshot(env, "it"))
        assert [(index, name, dict(slots)) for index, name, slots in env.facts()] == before
        assert take_snapshot(env, "it").agenda == agenda
        assert env.run() == len(agenda or ())
