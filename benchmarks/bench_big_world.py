"""A loop of the executive in a big world: 2,000 domain facts, 100 goals with plans, one fact changes.

The whole built-in core runs, with world model, synchronisation, action selection, execution monitoring
and the Skiller's interface. Each goal is dispatched and has a plan of ten actions, which wait for two
facts. In each loop one of these facts comes or goes, for another goal each time: the formulas that it
stands in are worked out anew, and its wm-fact comes or goes. The rival is the same loop when nothing
changes.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

from benchmarks.bench_core import ACTIONS, DOMAIN
from benchmarks.harness import report
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.run import Run, RunOptions

GOALS = 100
FACTS = 2_000
LOOPS = 400
LIMIT_MS = 5.0

SCENARIO = """
clips-executive:
  spec: big
  assert-time-each-loop: true
  automatic-goal-retraction: true
  specs:
    big:
      action-mapping: {move: 'say{text="?(to)"}'}
      init:
        stage-3:
          - {name: domain, file: big-domain.clp}
          - {name: worldmodel, files: [wm-domain-sync.clp, wm-config.clp]}
          - {name: selection, file: action-selection/sequential.clp}
          - {name: execution, file: skills-actions.clp}
          - {name: monitoring, file: execmon/stalled-sequential-plan.clp}
"""

READY = """
(domain-predicate (name ready) (param-names robot))
(domain-predicate (name never) (param-names robot))
(pddl-formula (id move12) (part-of move1) (type atom))
(pddl-predicate (id move12-atom) (part-of move12) (predicate ready) (param-names robot))
(pddl-formula (id move13) (part-of move1) (type atom))
(pddl-predicate (id move13-atom) (part-of move13) (predicate never) (param-names robot))
"""


def write_scenario(folder: Path) -> Path:
    """Write the scenario's files, and return their folder."""
    (folder / "scenario.yaml").write_text(SCENARIO)
    facts = (DOMAIN + READY).strip()
    rule = f"(defrule big-domain (executive-init) => (assert {facts} (domain-facts-loaded)))"
    (folder / "big-domain.clp").write_text(rule)
    return folder


def fill(env) -> None:
    """Assert the facts that stay, and the goals with their plans."""
    for number in range(FACTS):
        link = (Symbol(f"place-{number}"), Symbol(f"place-{number + 1}"))
        env.assert_fact("domain-fact", {"name": Symbol("linked"), "param-values": link})
    for number in range(GOALS):
        goal, plan = Symbol(f"goal-{number}"), Symbol(f"plan-{number}")
        env.assert_fact("goal", {"id": goal, "mode": Symbol("DISPATCHED"), "committed-to": plan})
        env.assert_fact("plan", {"id": plan, "goal-id": goal, "type": Symbol("SEQUENTIAL")})
        for action in range(ACTIONS):
            slots: dict[str, Value] = {
                "id": action + 1,
                "goal-id": goal,
                "plan-id": plan,
                "action-name": Symbol("move"),
                "param-names": (Symbol("robot"), Symbol("from"), Symbol("to")),
                "param-values": (robot(number), Symbol(f"place-{action}"), Symbol(f"place-{action + 1}")),
            }
            env.assert_fact("plan-action", slots)


def robot(number: int) -> Symbol:
    """Return the robot of a goal."""
    return Symbol(f"robot-{number}")


def satisfied(env, number: int) -> set[str]:
    """Return which formulas of a goal's first action are satisfied."""
    groundings = {
        slots["id"]
        for _, _, slots in env.facts("pddl-grounding")
        if tuple(slots["param-values"])[:2] == (robot(number), Symbol("place-0"))
    }
    return {
        str(slots["formula-id"])
        for _, _, slots in env.facts("grounded-pddl-formula")
        if slots["grounding"] in groundings and slots["is-satisfied"] == Symbol("TRUE")
    }


def milliseconds(work) -> float:
    """Return how long a call takes."""
    start = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - start)


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(scenario=write_scenario(Path(folder)))
        with Run(options) as assembly:
            measure(assembly)


def measure(assembly: Run) -> None:
    """Time loops of a run with and without a change."""
    assembly.start()
    env, clock, executive = assembly.executive.env, assembly.clock, assembly.executive

    def loop() -> None:
        clock.sleep_until(clock.now_us() + 33_333)
        executive.loop()

    for _ in range(30):
        loop()
    with env.lock:
        fill(env)
    print(f"  first loop with all of it: {milliseconds(loop):.0f} ms")
    for _ in range(30):
        loop()
    idle = statistics.median(milliseconds(loop) for _ in range(LOOPS))
    changed = []
    for number in range(LOOPS):
        goal = number // 2 % GOALS
        if number % 2 == 0:
            with env.lock:
                assert env.assert_fact(
                    "domain-fact", {"name": Symbol("ready"), "param-values": (robot(goal),)}
                )
        else:
            with env.lock:
                env.eval("(do-for-fact ((?f domain-fact)) (eq ?f:name ready) (retract ?f))")
        changed.append(milliseconds(loop))
        if number < 2:
            with env.lock:
                found = satisfied(env, goal)
            assert ("move12" in found) == (number == 0), "the change has changed nothing"
    print(f"  nothing changes: {idle:.2f} ms; worst loop with a change: {max(changed):.2f} ms")
    report("loop with 2,000 facts and 100 goals, one fact changes, ms", statistics.median(changed), LIMIT_MS)


if __name__ == "__main__":
    main()
