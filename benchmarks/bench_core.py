"""The built-in CX core under load, against the original core of a Fawkes checkout in the same run.

The work: G goals, each with a sequential plan of 10 actions, in a domain of 20 facts. Every action goes
from FORMULATED to FINAL; its precondition is grounded and checked, its effects are applied. Both cores run in
cxbridge's CLIPS host, with the same facts, the same executor rule and the same driver. The variants:

* ``shared``: the domain begins with the 20 facts alone. The goals share each fact that an action changes.
* ``own``: the domain also has the place of each goal's robot. A move changes the place: the next action
  becomes executable, the previous action does not. The original core looks through all places for that. It is
  measured at G = 50 only.

Times are processor times of the process. They include the assertion of goals, plans and actions, but not the
making of the environment and the loading of files. The built-in core's figure is the best of some rounds,
because machines are noisy.

    FAWKES_DIR=/path/to/fawkes python -m benchmarks.bench_core    exits with 1 when a limit is exceeded
"""

from __future__ import annotations

import itertools
import sys
import time
from dataclasses import dataclass

from benchmarks.cores import has_fawkes, make_environment
from benchmarks.harness import report
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value

GOALS = (50, 100, 200, 400)
"""The numbers of goals, G."""
ROUNDS = 5
SPEED_UP = 10.0
"""The minimum ratio of the original core's time to the built-in core's, at the greatest G."""
GROWTH = 2.3
"""The maximum ratio of the times after and before G doubles."""

ACTIONS = 10
"""The number of actions of a plan."""

LINKS = 20
"""The number of domain facts that all goals share."""

DOMAIN = """
(domain-predicate (name linked) (param-names from to))
(domain-predicate (name visited) (param-names place))
(domain-predicate (name at) (param-names robot place))
(domain-operator (name move) (param-names robot from to))
(pddl-formula (id move1) (part-of move) (type conjunction))
(pddl-formula (id move11) (part-of move1) (type atom))
(pddl-predicate (id move11-atom) (part-of move11) (predicate linked) (param-names from to))
(domain-effect (name visit) (part-of move) (predicate visited) (type POSITIVE) (param-names to))
(domain-effect (name forget) (part-of move) (predicate visited) (type NEGATIVE) (param-names from))
"""

OWN_PLACES = """
(pddl-formula (id move12) (part-of move1) (type atom))
(pddl-predicate (id move12-atom) (part-of move12) (predicate at) (param-names robot from))
(domain-effect (name leave) (part-of move) (predicate at) (type NEGATIVE) (param-names robot from))
(domain-effect (name arrive) (part-of move) (predicate at) (type POSITIVE) (param-names robot to))
"""

EXECUTOR = """
(defrule bench-executor
  ?action <- (plan-action (state PENDING) (executable TRUE))
  =>
  (modify ?action (state EXECUTION-SUCCEEDED)))
"""


@dataclass(frozen=True)
class Work:
    """Work for a core (``builtin`` or ``fawkes``), in the variant ``shared`` or ``own``, for G goals."""

    core: str
    variant: str
    goals: int


def measure_seconds(work: Work) -> float:
    """Do the work once, and return the processor time in seconds.

    :raises AssertionError: if the work was not done, so that the figure would mean nothing: CLIPS refuses a
        fact, or an action is not FINAL, or a goal is not COMPLETED.
    """
    env = make_environment(work.core, "action-selection/sequential")
    env.build(EXECUTOR)
    has_own_places = work.variant == "own"
    for fact in (DOMAIN + (OWN_PLACES if has_own_places else "")).split("\n"):
        assert not fact or env.assert_string(fact) is not None, fact
    for link in range(LINKS):
        env.assert_fact("domain-fact", {"name": Symbol("linked"), "param-values": places(link)})
    env.run()
    start = time.process_time()
    for number in range(work.goals):
        assert_goal(env, number, has_own_places=has_own_places)
    env.run()
    seconds = time.process_time() - start
    states = [str(slots["state"]) for _, _, slots in env.facts("plan-action")]
    assert states == ["FINAL"] * (work.goals * ACTIONS), f"{work}: not all actions are FINAL"
    outcomes = [str(slots["outcome"]) for _, _, slots in env.facts("goal")]
    assert outcomes == ["COMPLETED"] * work.goals, f"{work}: not all goals are COMPLETED"
    env.destroy()
    return seconds


def places(link: int) -> tuple[Symbol, Symbol]:
    """Return the places from which and to which a link leads."""
    return Symbol(f"place-{link}"), Symbol(f"place-{link + 1}")


def assert_goal(env: ClipsEnvironment, number: int, *, has_own_places: bool) -> None:
    """Assert a dispatched goal with its plan and actions; in the variant ``own`` also its robot's place."""
    goal, plan, robot = Symbol(f"goal-{number}"), Symbol(f"plan-{number}"), Symbol(f"robot-{number}")
    if has_own_places:
        env.assert_fact("domain-fact", {"name": Symbol("at"), "param-values": (robot, places(0)[0])})
    env.assert_fact("goal", {"id": goal, "mode": Symbol("DISPATCHED"), "committed-to": plan})
    env.assert_fact("plan", {"id": plan, "goal-id": goal, "type": Symbol("SEQUENTIAL")})
    for action in range(ACTIONS):
        slots: dict[str, Value] = {
            "id": action + 1,
            "goal-id": goal,
            "plan-id": plan,
            "action-name": Symbol("move"),
            "param-names": (Symbol("robot"), Symbol("from"), Symbol("to")),
            "param-values": (robot, *places(action)),
        }
        env.assert_fact("plan-action", slots)


def measure_builtin(variant: str) -> dict[int, float]:
    """Return the built-in core's best time in seconds by G; a round measures each G once."""
    best_seconds = dict.fromkeys(GOALS, float("inf"))
    for _ in range(ROUNDS):
        for goals in GOALS:
            best_seconds[goals] = min(best_seconds[goals], measure_seconds(Work("builtin", variant, goals)))
    for goals, seconds in best_seconds.items():
        print(f"  {variant:>6}, built-in core, G = {goals:3}: {seconds:7.3f} s")
    return best_seconds


def main() -> int:
    """Measure and print.

    :returns: 1 when a limit was exceeded, otherwise 0.
    """
    is_within_limits = True
    seconds_by_variant = {variant: measure_builtin(variant) for variant in ("shared", "own")}
    for variant, best_seconds in seconds_by_variant.items():
        for smaller, greater in itertools.pairwise(GOALS):
            growth = best_seconds[greater] / best_seconds[smaller]
            report(f"{variant}: G = {greater} / G = {smaller}", growth, GROWTH)
            is_within_limits = is_within_limits and growth <= GROWTH
    if not has_fawkes():
        print("FAWKES_DIR names no Fawkes checkout: the original core is not measured")
        return int(not is_within_limits)
    for variant, goals in (("own", GOALS[0]), *(("shared", goals) for goals in GOALS)):
        original_s = measure_seconds(Work("fawkes", variant, goals))
        ratio = original_s / seconds_by_variant[variant][goals]
        print(f"  {variant:>6}, original core, G = {goals:3}: {original_s:7.3f} s, {ratio:.0f} times as long")
    # goals and ratio are those of the last measurement: `shared`, with the greatest G
    print(f"original / built-in at G = {goals}: {ratio:.1f} (at least {SPEED_UP:g})")
    return int(not is_within_limits or ratio < SPEED_UP)


if __name__ == "__main__":
    sys.exit(main())
