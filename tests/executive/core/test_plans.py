"""Plans in the built-in core: their facts, action selection, execution monitoring."""

from __future__ import annotations

import pytest

from tests.executive.core.core_domain import EXECUTOR, DomainBench, moving_bench

SEQUENTIAL = "action-selection/sequential.clp"
TEMPORAL = "action-selection/temporal.clp"


def states(bench: DomainBench, goal: str = "G") -> list[str]:
    """Return the states of a plan's actions, by id."""
    actions = sorted(bench.all("plan-action", goal_id=goal), key=lambda action: int(str(action["id"])))
    return [str(action["state"]) for action in actions]


def bench_with(*files: str) -> DomainBench:
    """Return the core with files, and an operator ``act`` without precondition and effects."""
    bench = DomainBench(*files)
    bench.operator("act", "")
    return bench


# --- sequential selection -------------------------------------------------------------------------------


def test_actions_are_selected_in_order_of_ids() -> None:
    bench = bench_with(SEQUENTIAL)
    bench.plan("act", "act", "act")
    bench.modify("plan-action", "(id 0)", id="3")
    for expected in (
        ["PENDING", "FORMULATED", "FORMULATED"],
        ["FINAL", "PENDING", "FORMULATED"],
        ["FINAL", "FINAL", "PENDING"],
    ):
        bench.env.run()
        assert states(bench) == expected
        bench.set_state("EXECUTION-SUCCEEDED", action=(0, 1, 2)[expected.index("PENDING")])
    assert bench.state("G") == ("FINISHED", "COMPLETED")


@pytest.mark.parametrize(
    "change",
    [
        ("goal", "(mode COMMITTED)"),
        ("goal", "(committed-to OTHER-PLAN)"),
        ("plan", "(type nil)"),
        ("plan", "(type TEMPORAL)"),
        ("plan", "(suspended TRUE)"),
    ],
)
def test_action_of_inactive_goal_is_not_selected(change: tuple[str, str]) -> None:
    bench = bench_with(SEQUENTIAL)
    bench.plan("act")
    template, slots = change
    bench.modify(template, slots, id="G" if template == "goal" else "G-PLAN")
    bench.env.run()
    assert states(bench) == ["FORMULATED"]


@pytest.mark.parametrize("kind", ["SEQUENTIAL", "TEMPORAL"])
def test_failed_action_fails_goal(kind: str) -> None:
    bench = bench_with(SEQUENTIAL, TEMPORAL)
    bench.begin("act", "act", kind=kind, slots='(error-msg "no fuel")')
    bench.set_state("EXECUTION-FAILED")
    assert bench.state("G") == ("FINISHED", "FAILED")
    goal = bench.goal("G")
    if kind == "SEQUENTIAL":
        assert goal["error"] == ("ACTION-FAILED",)
        assert goal["message"] == "Action act failed: no fuel"
    else:
        assert goal["error"] == ()
        assert goal["message"] == ""


def test_plans_with_same_id_are_separate() -> None:
    bench = bench_with(SEQUENTIAL)
    bench.env.build(EXECUTOR)
    for goal in ("G", "H"):
        bench.assert_all(
            f"(goal (id {goal}) (mode DISPATCHED) (committed-to TALK-PLAN))",
            f"(plan (id TALK-PLAN) (goal-id {goal}) (type SEQUENTIAL))",
            *(
                f"(plan-action (id {number}) (goal-id {goal}) (plan-id TALK-PLAN) (action-name act))"
                for number in (1, 2)
            ),
        )
    bench.modify("plan-action", "(state RUNNING)", goal_id="H", id="1")
    bench.env.run()
    assert states(bench) == ["FINAL", "FINAL"]
    assert states(bench, "H") == ["RUNNING", "FORMULATED"]
    assert bench.state("H") == ("DISPATCHED", "UNKNOWN")


# --- temporal selection ---------------------------------------------------------------------------------


def test_temporal_actions_start_at_their_dispatch_times() -> None:
    bench = bench_with(TEMPORAL)
    bench.plan("act", "act", "act", kind="TEMPORAL")
    bench.modify("plan-action", "(dispatch-time 1.0)", id="2")
    bench.modify("plan-action", "(dispatch-time 2.5)", id="3")
    bench.tick()
    start = bench.one("plan")["start-time"]
    assert start == tuple(divmod(bench.clock.time_us, 1_000_000))
    assert states(bench) == ["PENDING", "FORMULATED", "FORMULATED"]
    bench.tick(1.0)
    assert states(bench)[1] == "FORMULATED", "only after MORE than the dispatch time"
    bench.tick(0.5)
    assert states(bench) == ["PENDING", "PENDING", "FORMULATED"]
    assert bench.action(2)["start-time"] == tuple(divmod(bench.clock.time_us, 1_000_000))
    bench.tick(1.5)
    assert states(bench) == ["PENDING", "PENDING", "PENDING"]
    for action in (1, 2, 3):
        bench.set_state("EXECUTION-SUCCEEDED", action)
    assert bench.state("G") == ("FINISHED", "COMPLETED")


# --- execution monitoring -------------------------------------------------------------------------------


def test_action_without_executor_fails() -> None:
    bench = bench_with(SEQUENTIAL, "execmon/stalled-action.clp")
    bench.begin("act")
    assert states(bench) == ["FAILED"]
    assert bench.action()["error-msg"] == "No action executor for action 'act'"
    assert bench.goal("G")["message"] == "Action act failed: No action executor for action 'act'"


def test_stalled_plan_fails_goal() -> None:
    bench = bench_with("execmon/stalled-sequential-plan.clp")
    bench.operator("use", "x", ("atom", "ready", "x"))
    bench.plan("act", "use A")
    for state in ("PENDING", "RUNNING"):
        bench.set_state(state)
        assert bench.state("G") == ("DISPATCHED", "UNKNOWN")
    bench.set_state("FINAL")
    assert bench.state("G") == ("FINISHED", "FAILED")
    goal = bench.goal("G")
    assert goal["error"] == ("STALLED-NONE-EXECUTABLE",)
    assert goal["message"] == (
        "Action use (goal G, plan G-PLAN, action 2) not executable, but next in sequence"
    )


@pytest.mark.parametrize(
    ("file", "slots", "running", "code", "text"),
    [
        (
            "temporal-missed-dispatch",
            "(dispatch-time 5.0)",
            2,
            "ACTION-MISSED-DISPATCH",
            "missed its dispatch time",
        ),
        (
            "temporal-over-duration",
            "(start-time {now} 0) (duration 5.0)",
            1,
            "ACTION-OVER-DURATION",
            "running longer than expected (which was 5.0 sec)",
        ),
    ],
)
def test_late_action_is_reported_once(file: str, slots: str, running: int, code: str, text: str) -> None:
    bench = bench_with(f"execmon/{file}.clp")
    now = bench.clock.time_us // 1_000_000
    bench.plan("act", "act", kind="TEMPORAL", slots=slots.format(now=now))
    bench.modify("plan", f"(start-time {now} 0)", id="G-PLAN")
    bench.modify("plan-action", "(state RUNNING)", id=str(running))
    bench.tick(4.0)
    assert bench.goal("G")["warning"] == ()
    bench.tick(2.0)
    bench.tick(2.0)
    assert bench.goal("G")["warning"] == (code, 1, "act")
    assert bench.texts("W") == [f"Action act (goal G, plan G-PLAN, action 1) {text}"]


# --- the work of a transition -----------------------------------------------------------------------------


def join_activity(bench: DomainBench) -> int:
    """Return how often CLIPS has compared facts, made or dropped partial matches, in all rules."""
    activity = 0
    for rule in DomainBench.tuple(bench.env.eval("(get-defrule-list)")):
        counts = DomainBench.tuple(bench.env.eval(f"(join-activity {rule} terse)"))
        activity += sum(int(str(count)) for count in counts)
    return activity


def work_of_one_action(goals: int) -> int:
    """Return the join activity until one action is FINAL and the next action PENDING."""
    bench = moving_bench(SEQUENTIAL, TEMPORAL, "execmon/stalled-sequential-plan.clp")
    for number in range(goals):
        bench.facts(f"at R{number} A")
        bench.plan(*[f"move R{number} A B", f"move R{number} B A"] * 2, goal=f"G{number}")
    bench.env.run()
    before = join_activity(bench)
    bench.set_state("EXECUTION-SUCCEEDED", 1, "G3")
    assert states(bench, "G3") == ["FINAL", "PENDING", "FORMULATED", "FORMULATED"]
    return join_activity(bench) - before


def test_cost_of_transition_is_independent_of_number_of_goals() -> None:
    """Lengths of hash chains differ a little."""
    assert work_of_one_action(160) < 2.5 * work_of_one_action(10)
