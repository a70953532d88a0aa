"""Goals in the built-in core: outcome tables of all sub-types, resources, clean-up, meta facts.

The tables are those of the compatibility page on the behaviour of the CX core, section 2.
"""

from __future__ import annotations

import pytest

from cxbridge.executive.values import Symbol
from tests.executive.core_bench import GOAL_FILES, Bench

# A leaf's class tells its outcome. Nothing else is done for leaves; roots are ended, not retracted.
_AGENT = """
(defrule leaf-runs ?g <- (goal (mode SELECTED) (class ?c&WILL-COMPLETED|WILL-FAILED|WILL-REJECTED)) =>
  (modify ?g (mode FINISHED) (outcome (sym-cat (sub-string 6 99 ?c)))))
(defrule leaf-fails-once ?g <- (goal (mode SELECTED) (class SECOND-TRY) (meta $?m)) =>
  (modify ?g (mode FINISHED) (outcome (if (eq ?m (create$)) then FAILED else COMPLETED)) (meta tried)))
(defrule root-begins ?g <- (goal (mode FORMULATED) (class ROOT)) => (modify ?g (mode SELECTED)))
(defrule root-expands ?g <- (goal (mode SELECTED) (class ROOT)) => (modify ?g (mode EXPANDED)))
(defrule evaluate ?g <- (goal (mode FINISHED) (parent ~nil)) => (modify ?g (mode EVALUATED)))
(defrule notice (declare (salience 10)) (goal (id ?id) (parent ~nil) (mode SELECTED)) =>
  (printout t "selected " ?id crlf))
"""

OUTCOMES = ("COMPLETED", "FAILED", "REJECTED")
PREFIXES = {
    "run-one": "RUN-ONE",
    "run-all": "RUN-ALL",
    "try-all": "TRY-ALL",
    "retry": "RETRY",
    "timeout": "TIMEOUT",
    "run-parallel": "PARALLEL",
}
SUB_TYPES = {
    "run-one": "RUN-ONE-OF-SUBGOALS",
    "run-all": "RUN-ALL-OF-SUBGOALS",
    "try-all": "TRY-ALL-OF-SUBGOALS",
    "retry": "RETRY-SUBGOAL",
    "timeout": "TIMEOUT-SUBGOAL",
    "run-parallel": "RUN-SUBGOALS-IN-PARALLEL",
}


@pytest.fixture
def bench() -> Bench:
    """Goals of all sub-types, and an agent that only runs leaves."""
    bench = Bench(*GOAL_FILES)
    for rule in _AGENT.split("\n(defrule ")[1:]:
        bench.env.build(f"(defrule {rule}")
    return bench


def grow(bench: Bench, kind: str, *leaves_wanted: str, option: str = "") -> str:
    """Make a tree of one goal and leaves with these outcomes or classes; returns the id of the goal."""
    leaves = " ".join(
        f"(assert (goal (id C{number}) (class {f'WILL-{leaf}' if leaf in OUTCOMES else leaf})))"
        for number, leaf in enumerate(leaves_wanted, 1)
    )
    bench.env.eval(f"(goal-tree-assert-{kind} ROOT {option} {leaves})")
    return str(bench.one("goal", **{"class": "ROOT"})["id"])


def lone(bench: Bench, kind: str, *params: object) -> str:
    """Make a goal without sub-goals."""
    text = " ".join(str(param) for param in params)
    bench.env.eval(
        f"(assert (goal (id P) (class ROOT) (sub-type {SUB_TYPES[kind]}) (params {text}) (mode EXPANDED)))"
    )
    return "P"


def selected(bench: Bench) -> list[str]:
    """Return the ids of sub-goals in the order of their selection."""
    return [text.removeprefix("selected ") for text in bench.texts() if text.startswith("selected ")]


def error(bench: Bench, goal_id: str) -> tuple[str, str]:
    """Return error fields and message of a goal."""
    goal = bench.goal(goal_id)
    fields = goal["error"]
    assert isinstance(fields, tuple)
    return " ".join(map(str, fields)), str(goal["message"])


# --- sequential sub-types: the children's outcomes, who is pursued, what becomes of the parent --------------

_SEQUENTIAL = [
    # kind, children, pursued, outcome, error, message
    ("run-one", "COMPLETED FAILED", "C1", "COMPLETED", "", ""),
    (
        "run-one",
        "FAILED COMPLETED",
        "C1",
        "FAILED",
        "SUB-GOAL-FAILED",
        "Sub-goal 'C1' of RUN-ONE goal '{}' has failed",
    ),
    ("run-one", "REJECTED COMPLETED", "C1 C2", "COMPLETED", "", ""),
    ("run-one", "REJECTED REJECTED", "C1 C2", "REJECTED", "SUB-GOALS-REJECTED", ""),
    ("run-all", "COMPLETED COMPLETED COMPLETED", "C1 C2 C3", "COMPLETED", "", ""),
    (
        "run-all",
        "COMPLETED FAILED COMPLETED",
        "C1 C2",
        "FAILED",
        "SUB-GOAL-FAILED C2",
        "Sub-goal 'C2' of RUN-ALL goal '{}' has failed",
    ),
    (
        "run-all",
        "REJECTED COMPLETED",
        "C1",
        "REJECTED",
        "SUB-GOAL-REJECTED",
        "Sub-goal 'C1' of RUN-ALL goal '{}' was rejected",
    ),
    ("try-all", "FAILED REJECTED COMPLETED COMPLETED", "C1 C2 C3", "COMPLETED", "", ""),
    ("try-all", "FAILED REJECTED", "C1 C2", "FAILED", "SUB-GOALS-FAILED", ""),
    ("try-all", "REJECTED REJECTED", "C1 C2", "REJECTED", "SUB-GOALS-REJECTED", ""),
]


@pytest.mark.parametrize(("kind", "children", "pursued", "outcome", "code", "message"), _SEQUENTIAL)
def test_sequential_outcomes(
    bench: Bench, kind: str, children: str, pursued: str, outcome: str, code: str, message: str
) -> None:
    parent = grow(bench, kind, *children.split())
    assert parent.startswith(f"{PREFIXES[kind]}-ROOT-gen")
    bench.tick()
    assert bench.state(parent) == ("FINISHED", outcome)
    assert error(bench, parent) == (code, message.format(parent))
    assert selected(bench) == pursued.split()
    assert bench.goal(parent)["committed-to"] == Symbol("nil")
    for child in pursued.split():
        assert bench.state(child)[0] == "RETRACTED"


@pytest.mark.parametrize(
    ("kind", "code", "name"),
    [
        ("run-one", "", "RUN-ONE"),
        ("run-all", "NO-SUB-GOALS", "RUN-ALL"),
        ("try-all", "NO-SUB-GOALS", "TRY-ALL"),
        ("run-parallel", "NO-SUB-GOALS", "RUN-PARALLEL"),
        ("retry", "NO-SUB-GOAL", "RETRY"),
        ("timeout", "NO-SUB-GOAL", "TIMEOUT"),
    ],
)
def test_without_children_a_goal_fails(bench: Bench, kind: str, code: str, name: str) -> None:
    params = {"retry": ("max-tries", 2), "timeout": ("timeout", 1.0)}.get(kind, ())
    lone(bench, kind, *params)
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    assert error(bench, "P") == (code, f"No sub-goal for {name} goal 'P'")


def test_try_all_looks_at_its_own_children_only(bench: Bench) -> None:
    bench.env.eval("(assert (goal (id stranger) (mode RETRACTED) (outcome FAILED)))")
    parent = grow(bench, "try-all", "REJECTED", "REJECTED")
    bench.tick()
    assert bench.state(parent) == ("FINISHED", "REJECTED")


def test_maintain_children_are_invisible(bench: Bench) -> None:
    bench.env.eval("(assert (goal (id M) (class WILL-COMPLETED) (type MAINTAIN) (parent P)))")
    lone(bench, "run-all")
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    assert bench.state("M") == ("FORMULATED", "UNKNOWN")


def test_the_greatest_priority_goes_first(bench: Bench) -> None:
    for number, priority in enumerate((1.0, 7.5, 3.0), 1):
        bench.env.eval(
            f"(assert (goal (id C{number}) (class WILL-COMPLETED) (parent P) (priority {priority})))"
        )
    lone(bench, "run-all")
    bench.tick()
    assert selected(bench) == ["C2", "C3", "C1"]


# --- resources --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", list(SUB_TYPES))
def test_dispatch_waits_for_required_resources(bench: Bench, kind: str) -> None:
    option = {"retry": "2", "timeout": "9.0", "run-parallel": "NONE"}.get(kind, "")
    parent = grow(bench, kind, "COMPLETED", option=option)
    bench.modify("goal", "(required-resources r1 r2) (acquired-resources r1)", id=parent)
    bench.tick()
    assert bench.state(parent)[0] == "COMMITTED"
    assert bench.state("C1")[0] == "FORMULATED"
    bench.modify("goal", "(acquired-resources r3 r2 r1)", id=parent)
    bench.tick()
    assert bench.state(parent) == ("FINISHED", "COMPLETED")


@pytest.mark.parametrize("kind", list(SUB_TYPES))
@pytest.mark.parametrize("outcome", ["COMPLETED", "FAILED", "REJECTED"])
def test_a_child_is_over_only_without_resources(bench: Bench, kind: str, outcome: str) -> None:
    option = {"retry": "1", "timeout": "9.0", "run-parallel": "NONE"}.get(kind, "")
    parent = grow(bench, kind, outcome, option=option)
    bench.modify("goal", "(acquired-resources r1)", id="C1")
    bench.tick()
    assert bench.state(parent)[0] == "DISPATCHED"
    assert bench.state("C1") == ("RETRACTED", outcome)
    bench.modify("goal", "(acquired-resources)", id="C1")
    bench.tick()
    assert bench.state(parent) == ("FINISHED", outcome)


# --- retry ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("outcome", ["FAILED", "REJECTED"])
def test_retry_gives_up_after_the_last_try(bench: Bench, outcome: str) -> None:
    parent = grow(bench, "retry", outcome, option="3")
    bench.tick()
    assert selected(bench) == ["C1"] * 3
    assert bench.state(parent) == ("FINISHED", outcome)
    message = f"RETRY goal '{parent}' sub-goal 'C1' {outcome} in try 3/3"
    assert error(bench, parent) == (f"SUB-GOAL-{outcome}", message)
    assert bench.texts("W") == [
        f"Committing to RETRY {parent} -> C1 (try 2/3)",
        f"Committing to RETRY {parent} -> C1 (try 3/3)",
    ]


def test_retry_keeps_what_the_child_has_noted(bench: Bench) -> None:
    parent = grow(bench, "retry", "SECOND-TRY", option="3")
    bench.tick()
    assert bench.state(parent) == ("FINISHED", "COMPLETED")
    assert bench.goal(parent)["committed-to"] == "C1"
    assert bench.goal(parent)["meta"] == ("num-tries", 2)


def test_retry_keeps_other_meta_data_of_its_own(bench: Bench) -> None:
    parent = grow(bench, "retry", "SECOND-TRY", option="3")
    bench.modify("goal", "(meta colour red)", id=parent)
    bench.tick()
    assert bench.state(parent) == ("FINISHED", "COMPLETED")
    assert bench.goal(parent)["meta"] == ("colour", "red", "num-tries", 2)


def test_retry_meets_no_old_plan(bench: Bench) -> None:
    bench.retract_automatically()
    bench.env.build(
        "(defrule plan-it (goal (id ?id) (class PLANNED) (mode SELECTED)) =>"
        " (bind ?n (length$ (find-all-facts ((?p plan)) TRUE)))"
        ' (printout t "plans " ?n crlf)'
        " (assert (plan (id X) (goal-id ?id)) (plan-action (id 1) (plan-id X) (goal-id ?id))"
        " (go-on ?id)))"
    )
    bench.env.build(
        "(defrule go-on ?f <- (go-on ?id) ?g <- (goal (id ?id)) =>"
        " (retract ?f) (modify ?g (mode FINISHED) (outcome FAILED)))"
    )
    grow(bench, "retry", "PLANNED", option="3")
    bench.tick()
    assert [text for text in bench.texts("I") if text.startswith("plans")] == ["plans 0"] * 3
    assert not bench.all("plan-action")


@pytest.mark.parametrize("kind", ["retry", "timeout"])
@pytest.mark.parametrize("params", ["", "max-tries", "max-tries three", "timeout -1.0", "max-tries 1 x 2"])
def test_parameters_that_are_wrong(bench: Bench, kind: str, params: str) -> None:
    bench.env.eval("(assert (goal (id C1) (class WILL-COMPLETED) (parent P)))")
    lone(bench, kind, params)
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    name = PREFIXES[kind]
    assert error(bench, "P") == ("INVALID-PARAMETERS", f"Invalid parameters for {name} goal 'P'")


@pytest.mark.parametrize(("kind", "params"), [("retry", "max-tries 2"), ("timeout", "timeout 2.0")])
def test_more_than_one_child(bench: Bench, kind: str, params: str) -> None:
    for child in ("C1", "C2"):
        bench.env.eval(f"(assert (goal (id {child}) (class WILL-COMPLETED) (parent P)))")
    lone(bench, kind, params)
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    message = f"More than one sub-goal for {PREFIXES[kind]} goal 'P'"
    assert error(bench, "P") == ("TOO-MANY-SUBGOALS", message)
    assert selected(bench) == []


@pytest.mark.parametrize("kind", ["retry", "timeout"])
def test_expands_by_itself_when_there_is_a_child(bench: Bench, kind: str) -> None:
    params = {"retry": "max-tries 2", "timeout": "timeout 2.0"}[kind]
    bench.env.eval(
        f"(assert (goal (id P) (class ANY) (sub-type {SUB_TYPES[kind]}) (params {params}) (mode SELECTED))"
        " (goal (id C1) (class WILL-COMPLETED) (parent P)))"
    )
    bench.tick()
    assert bench.state("P") == ("FINISHED", "COMPLETED")


# --- timeout ----------------------------------------------------------------------------------------------


def test_timeout_fails_the_child_and_then_itself(bench: Bench) -> None:
    parent = grow(bench, "timeout", "HANGS", option="5.0")
    bench.tick()
    assert bench.state("C1")[0] == "SELECTED"
    assert bench.goal(parent)["meta"] == ("start-time", *divmod(bench.clock.now_us(), 1_000_000))
    bench.tick(5.0)
    assert bench.state("C1")[0] == "SELECTED"
    bench.tick(0.1)
    assert error(bench, "C1") == ("TIMEOUT", f"Parent {parent} set FAILED due to timeout")
    assert bench.state(parent) == ("FINISHED", "FAILED")
    assert error(bench, parent) == (
        "TIMEOUT",
        f"TIMEOUT goal '{parent}' sub-goal 'C1' FAILED (error TIMEOUT)",
    )


@pytest.mark.parametrize("outcome", ["FAILED", "REJECTED"])
def test_timeout_passes_the_outcome_on(bench: Bench, outcome: str) -> None:
    parent = grow(bench, "timeout", outcome, option="5.0")
    bench.tick()
    code = f"SUBGOAL-{outcome}"
    assert bench.state(parent) == ("FINISHED", outcome)
    assert error(bench, parent) == (
        code,
        f"TIMEOUT goal '{parent}' sub-goal 'C1' {outcome} (error {code})",
    )


def test_timeout_spares_a_child_that_holds_resources(bench: Bench) -> None:
    grow(bench, "timeout", "HANGS", option="1.0")
    bench.modify("goal", "(acquired-resources r1)", id="C1")
    bench.tick()
    bench.tick(3.0)
    assert bench.state("C1")[0] == "SELECTED"


# --- parallel ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("children", "outcome", "blamed", "what"),
    [
        ("COMPLETED COMPLETED", "COMPLETED", "", ""),
        ("COMPLETED FAILED REJECTED", "FAILED", "C2", "has failed"),
        ("COMPLETED COMPLETED REJECTED", "REJECTED", "C3", "was rejected"),
    ],
)
def test_parallel_outcomes(bench: Bench, children: str, outcome: str, blamed: str, what: str) -> None:
    parent = grow(bench, "run-parallel", *children.split(), option="FAILED")
    bench.tick()
    assert sorted(selected(bench)) == [f"C{n}" for n, _ in enumerate(children.split(), 1)]
    assert bench.state(parent) == ("FINISHED", outcome)
    assert bench.goal(parent)["committed-to"] == Symbol("nil")
    expected = ("", "")
    if blamed:
        message = f"Sub-goal '{blamed}' of RUN-PARALLEL goal '{parent}' {what}"
        expected = (f"SUB-GOAL-{outcome} {blamed}", message)
    assert error(bench, parent) == expected


def test_parallel_selects_equal_priorities_at_once(bench: Bench) -> None:
    """Nobody deals with the first of them before the last is selected."""
    bench.env.build(
        '(defrule late (goal (mode SELECTED) (parent ~nil) (id ?id)) => (printout t "late " ?id crlf))'
    )
    grow(bench, "run-parallel", "HANGS", "HANGS", "HANGS", option="NONE")
    bench.tick()
    words = [text.split()[0] for text in bench.texts("I")]
    assert words == ["selected"] * 3 + ["late"] * 3


@pytest.mark.parametrize(
    ("option", "first", "second_runs"),
    [
        ("NONE", "COMPLETED", True),
        ("NONE", "FAILED", False),
        ("NONE", "REJECTED", False),
        ("REJECTED", "REJECTED", True),
        ("REJECTED", "FAILED", False),
        ("FAILED", "FAILED", True),
        ("FAILED", "REJECTED", True),
    ],
)
def test_parallel_continue_on(bench: Bench, option: str, first: str, second_runs: bool) -> None:
    parent = grow(bench, "run-parallel-delayed", first, "COMPLETED", "COMPLETED", option=option)
    bench.tick()
    assert selected(bench) == (["C1", "C2", "C3"] if second_runs else ["C1"])
    assert bench.state("C3") == ("RETRACTED", "COMPLETED" if second_runs else "REJECTED")
    assert bench.state(parent) == ("FINISHED", first)


def test_parallel_next_batch_follows_dispatch_not_the_end(bench: Bench) -> None:
    grow(bench, "run-parallel-delayed", "HANGS", "HANGS", option="NONE")
    bench.tick()
    assert selected(bench) == ["C1"]
    bench.modify("goal", "(mode DISPATCHED)", id="C1")
    bench.tick()
    assert selected(bench) == ["C1", "C2"]


def test_parallel_unknown_option_means_none(bench: Bench) -> None:
    parent = grow(bench, "run-parallel", "COMPLETED", option="SOMETIMES")
    assert bench.goal(parent)["params"] == ("continue-on", "NONE")
    (warning,) = bench.texts("W")
    assert warning == (
        "ignoring unrecognized option SOMETIMES for run-parallel goal, "
        "expected FAILED|REJECTED|NONE, using default: NONE"
    )


def test_parallel_stop_predicate(bench: Bench) -> None:
    for params, outcome, stops in (
        ("", "FAILED", True),
        ("", "COMPLETED", False),
        ("", "UNKNOWN", False),
        ("x y continue-on REJECTED", "REJECTED", False),
        ("x y continue-on REJECTED", "FAILED", True),
        ("continue-on FAILED x", "REJECTED", False),
    ):
        call = f"(run-parallel-stop-execution (create$ {params}) {outcome})"
        assert bench.env.eval(call) == Symbol("TRUE" if stops else "FALSE"), call


# --- trees, clean-up --------------------------------------------------------------------------------------


def test_ids_and_priorities_of_a_tree(bench: Bench) -> None:
    bench.env.eval(
        "(goal-tree-assert-run-all AUTOMATIC-SUBGOAL (assert (goal (class A)))"
        " (goal-tree-assert-retry B 3 (assert (goal (id mine) (class C)))))"
    )
    root = bench.one("goal", sub_type="RUN-ALL-OF-SUBGOALS")
    first, retry, leaf = (
        bench.one("goal", **{"class": "A"}),
        bench.one("goal", **{"class": "B"}),
        bench.goal("mine"),
    )
    assert str(root["id"]).startswith("RUN-ALL-AUTOMATIC-SUBGOAL-gen")
    assert str(first["id"]).startswith("A-gen")
    assert str(retry["id"]).startswith("RETRY-B-gen")
    assert (first["priority"], retry["priority"], leaf["priority"]) == (2, 1, 0)
    assert (first["parent"], retry["parent"], leaf["parent"]) == (root["id"], root["id"], retry["id"])
    assert retry["params"] == ("max-tries", 3)


def test_automatic_subgoals_expand_and_evaluate_themselves(bench: Bench) -> None:
    bench.env.eval("(assert (goal (id A) (class AUTOMATIC-SUBGOAL) (mode SELECTED)))")
    bench.tick()
    assert bench.state("A")[0] == "EXPANDED"
    bench.modify("goal", "(mode FINISHED)", id="A")
    bench.tick()
    assert bench.state("A")[0] == "EVALUATED"


def test_a_retracted_root_takes_the_whole_tree_along(bench: Bench) -> None:
    bench.retract_automatically()
    parent = grow(bench, "run-all", "COMPLETED", "COMPLETED")
    bench.env.eval(
        "(assert (goal (id other)) (plan (id X) (goal-id other))"
        " (plan-action (id 1) (plan-id X) (goal-id other))"
        " (plan (id X) (goal-id C1)) (plan-action (id 1) (plan-id X) (goal-id C1))"
        " (plan-action (id 2) (plan-id NO-PLAN) (goal-id C2)))"
    )
    bench.tick()
    assert {str(goal["id"]) for goal in bench.all("goal")} == {parent, "C1", "C2", "other"}
    bench.modify("goal", "(mode RETRACTED)", id=parent)
    bench.tick()
    assert [goal["id"] for goal in bench.all("goal")] == ["other"]
    assert [plan["goal-id"] for plan in bench.all("plan")] == ["other"]
    assert [action["goal-id"] for action in bench.all("plan-action")] == ["other"]
    assert f"Retracting goal {parent}" in bench.texts("I")
    assert not bench.all("goal-tree-retract")
    assert not bench.all("goal-plan-retract")


def test_without_automatic_retraction_nothing_goes(bench: Bench) -> None:
    parent = grow(bench, "run-all", "COMPLETED")
    bench.env.eval("(assert (plan (id X) (goal-id C1)))")
    bench.tick()
    bench.modify("goal", "(mode RETRACTED)", id=parent)
    bench.tick()
    assert len(bench.all("goal")) == 2
    assert len(bench.all("plan")) == 1


def test_a_root_with_resources_stays(bench: Bench) -> None:
    bench.retract_automatically()
    bench.env.eval("(assert (goal (id R) (mode RETRACTED) (acquired-resources r1)))")
    bench.tick()
    assert bench.state("R")[0] == "RETRACTED"
    bench.modify("goal", "(acquired-resources)", id="R")
    bench.tick()
    assert not bench.all("goal")


def test_children_of_maintain_goals_go_one_by_one(bench: Bench) -> None:
    bench.retract_automatically()
    bench.env.eval(
        "(assert (goal (id M) (type MAINTAIN)) (goal (id C1) (parent M) (mode RETRACTED))"
        " (goal (id C2) (parent M)) (goal (id A)) (goal (id C3) (parent A) (mode RETRACTED)))"
    )
    bench.tick()
    assert [str(goal["id"]) for goal in bench.all("goal")] == ["M", "C2", "A", "C3"]


def test_retract_goal_tree_is_for_users_too(bench: Bench) -> None:
    parent = grow(bench, "run-all", "HANGS", "HANGS")
    bench.env.eval("(assert (plan (id X) (goal-id C1)) (plan-action (id 1) (plan-id X) (goal-id C1)))")
    bench.env.eval(f"(goal-retract-goal-tree {parent})")
    assert not any(bench.all(template) for template in ("goal", "plan", "plan-action"))


def test_a_failure_is_told_with_error_and_message(bench: Bench) -> None:
    bench.env.eval(
        '(assert (goal (id G) (class C) (mode RETRACTED) (outcome FAILED) (error E 1) (message "why"))'
        " (goal (id H) (class C) (mode RETRACTED) (outcome FAILED) (error E)))"
    )
    bench.tick()
    assert bench.texts("E") == ["Goal G (C) failed: why (E 1)"]


def test_a_transition_fires_the_same_rules_among_many_goals() -> None:
    """The work for one goal does not grow with the number of others."""

    def firings(others: int) -> int:
        bench = Bench(*GOAL_FILES)
        for rule in _AGENT.split("\n(defrule ")[1:]:
            bench.env.build(f"(defrule {rule}")
        for number in range(others):
            bench.env.eval(f"(assert (goal (id other-{number})))")
        bench.tick()
        grow(bench, "run-all", "COMPLETED", "COMPLETED")
        return bench.tick()

    assert firings(0) == firings(50)


# --- meta facts -------------------------------------------------------------------------------------------


@pytest.fixture
def meta(bench: Bench) -> Bench:
    """A bench with a template for meta facts, and one without the slot goal-id."""
    bench.env.build("(deftemplate tries (slot goal-id) (slot count (default 7)))")
    bench.env.build("(deftemplate no-id (slot count))")
    return bench


def index_of(bench: Bench, template: str) -> int:
    """Return the index of the only fact of the template."""
    ((index, _, _),) = bench.env.facts(template)
    return index


def test_meta_template_alone_makes_a_default_fact(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (meta-template tries) (verbosity NOISY)))")
    meta.tick()
    assert meta.one("tries") == {"goal-id": "G", "count": 7}
    assert meta.goal("G")["meta-fact"] == index_of(meta, "tries")
    assert meta.texts("I") == ["Goal G attached default meta fact from template tries"]


def test_meta_template_finds_the_fact_that_is_there(meta: Bench) -> None:
    meta.env.eval("(assert (tries (goal-id other)) (tries (goal-id G) (count 2)))")
    meta.env.eval("(assert (goal (id G) (mode SELECTED) (meta-template tries)))")
    meta.tick()
    fact = meta.goal("G")["meta-fact"]
    assert fact in [index for index, _, slots in meta.env.facts("tries") if slots["goal-id"] == "G"]


def test_meta_fact_alone_sets_the_template_and_the_goal_id(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (meta-fact (fact-index (assert (tries (count 1)))))))")
    meta.tick()
    assert meta.goal("G")["meta-template"] == "tries"
    assert meta.one("tries")["goal-id"] == "G"


def test_a_meta_fact_that_was_modified_is_linked_again_with_the_next_time(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (meta-template tries)))")
    meta.tick()
    assert meta.env.retract(index_of(meta, "tries"))
    meta.env.eval("(assert (tries (goal-id G) (count 8)))")
    assert meta.goal("G")["meta-fact"] != index_of(meta, "tries")
    meta.tick()
    assert meta.goal("G")["meta-fact"] == index_of(meta, "tries")


def test_a_meta_fact_that_is_gone_is_forgotten(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (mode SELECTED) (meta-fact (fact-index (assert (tries))))))")
    meta.tick()
    assert meta.env.retract(index_of(meta, "tries"))
    meta.tick()
    assert (meta.goal("G")["meta-fact"], meta.goal("G")["meta-template"]) == (0, "nil")
    assert not meta.all("goal-meta-link")


def test_a_meta_fact_goes_with_its_goal(meta: Bench) -> None:
    meta.retract_automatically()
    meta.env.eval("(assert (goal (id G) (meta-template tries)) (tries (goal-id other)))")
    meta.tick()
    meta.modify("goal", "(mode RETRACTED)", id="G")
    meta.tick()
    assert [fact["goal-id"] for fact in meta.all("tries")] == ["other"]
    assert not meta.all("goal")
    assert not meta.all("goal-meta-link")


@pytest.mark.parametrize(
    ("goal", "text"),
    [
        ("(meta-template nowhere)", "Goal G attached goal meta template 'nowhere' unknown"),
        (
            "(meta-template no-id) (meta-fact (fact-index (assert (no-id))))",
            "Goal G uses meta fact 'no-id' without slot 'goal-id'",
        ),
    ],
)
def test_meta_mistakes_are_told(meta: Bench, goal: str, text: str) -> None:
    meta.env.eval(f"(assert (goal (id G) {goal}))")
    meta.tick()
    assert meta.texts("E") == [text]


def test_ambiguous_meta_facts_are_told(meta: Bench) -> None:
    meta.env.eval("(assert (tries (goal-id G) (count 1)) (tries (goal-id G) (count 2)))")
    meta.env.eval("(assert (goal (id G) (meta-template tries)))")
    meta.tick()
    assert meta.texts("E") == ["Goal G has ambiguous meta facts"]
