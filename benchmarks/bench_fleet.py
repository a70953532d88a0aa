"""A fleet in one executive: 50 robots, 10,000 unmatched facts, 1,000 goals on the skill board.

Each goal has a plan of one action, which an executor of its robot executes. Everything runs in this process,
on a virtual clock. A figure is the CPU time of a pass of the main loop: rules, skill board, executors.

    python -m benchmarks fleet      prints the figures; TOO SLOW below 30 loops a second
"""

from __future__ import annotations

import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions

ROBOTS = 50
FACTS = 10_000
GOALS = 1_000
EXECUTORS = 4
MIN_LOOPS_A_SECOND = 30.0
"""The minimum rate: that of the main loop in real time."""

CONFIG = """
clips-executive:
  assert-time-each-loop: true
  automatic-goal-retraction: true
  spec: fleet
  specs:
    fleet:
      init:
        stage-1: [{name: pddl-parser}, {name: skill-board}]
        stage-3:
          - name: agent
            files: [fleet.clp, action-selection/sequential.clp, skill-board-actions.clp]
      action-mapping: {work: "work{n=?(n)i}"}
skill-board:
  agents:
"""
AGENT = """
(deftemplate thing (slot n))
(defrule begin (executive-initialized) (not (begun)) =>
  (assert (begun) (domain-operator (name work) (param-names n)))
  (loop-for-count (?n 1 @FACTS@) (assert (thing (n ?n))))
  (loop-for-count (?n 1 @GOALS@)
    (bind ?goal (sym-cat G ?n))
    (assert (goal (id ?goal) (class WORK) (mode EXPANDED)))
    (assert (plan (id P) (goal-id ?goal) (type SEQUENTIAL)))
    (assert (plan-action (id 1) (plan-id P) (goal-id ?goal) (action-name work)
                         (param-names n) (param-values ?n)
                         (skiller (str-cat robot (mod ?n @ROBOTS@))) (executable TRUE)))))
(defrule commit ?g <- (goal (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule dispatch ?g <- (goal (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule evaluate ?g <- (goal (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule retract ?g <- (goal (mode EVALUATED)) => (modify ?g (mode RETRACTED)))
"""
CONTROL = """
(defrule control (executive-initialized) => (loop-for-count (?n 0 @LAST@)
  (blackboard-open-reading "SkillerInterface" (str-cat robot ?n))
  (assert (skiller-control (skiller (str-cat robot ?n))))))
"""
EXECUTOR = '''
from cxbridge.skiller.board import Progress, SkillExecutor

class Worker(SkillExecutor):
    """Executes for 0.8 s, with progress."""
    skills = ("work",)

    def execute(self, call):
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < 800_000:
            yield Progress(passed_us / 800_000, "at work")
'''


@dataclass(frozen=True)
class Fleet:
    """A fleet: the sizes of its scenario.

    :param executors: the number of executors of each robot.
    :param facts: the number of facts that no rule matches.
    :param has_lua_skillers: whether each robot has a Lua Skiller instead of executors on the skill board.
    """

    robots: int = ROBOTS
    executors: int = EXECUTORS
    goals: int = GOALS
    facts: int = FACTS
    has_lua_skillers: bool = False


def write_scenario(folder: Path, fleet: Fleet) -> Path:
    """Write the scenario of a fleet into a folder, and return the folder."""
    lines = []
    config = CONFIG
    if fleet.has_lua_skillers:
        config = CONFIG.partition("skill-board:")[0].replace(", {name: skill-board}", "")
        config = config.replace("skill-board-actions.clp", "skills-actions.clp")
        config = config.replace("work{n=?(n)i}", "wait{seconds=0.8}") + "skiller:\n  instances:\n"
        lines = [f"    robot{robot}: {{}}\n" for robot in range(fleet.robots)]
    for robot in range(0 if fleet.has_lua_skillers else fleet.robots):
        lines.append(f"    robot{robot}: {{executors: {{")
        settings = (f'w{n}: {{class: "worker.py:Worker"}}' for n in range(fleet.executors))
        lines.append(", ".join(settings) + "}}\n")
    (folder / "scenario.yaml").write_text(config + "".join(lines))
    text = AGENT
    if fleet.has_lua_skillers:
        text += CONTROL.replace("@LAST@", str(fleet.robots - 1))
    for name in ("facts", "goals", "robots"):
        text = text.replace(f"@{name.upper()}@", str(getattr(fleet, name)))
    (folder / "fleet.clp").write_text(text)
    (folder / "worker.py").write_text(EXECUTOR)
    return folder


def measure(fleet: Fleet) -> list[float]:
    """Run all goals, and return the processor time of each loop in milliseconds.

    :raises AssertionError: if a goal does not complete within 5,000 loops.
    """
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(scenario=write_scenario(Path(folder), fleet))
        loops_ms: list[float] = []
        with Run(options) as run:
            run.start()
            while not run.is_over and len(loops_ms) < 5_000:  # else a run without an end would go on forever
                begin_s = time.process_time()
                start_us = run.clock.now_us()
                run.loop.run_once()
                loops_ms.append((time.process_time() - begin_s) * 1e3)
                run.clock.sleep_until(start_us + run.loop.period_us)
            assert run.executive.goals.outcome_counts == {"COMPLETED": fleet.goals}, (
                run.executive.goals.outcome_counts
            )
    return loops_ms


def main() -> None:
    """Measure and print."""
    loops_ms = measure(Fleet())
    # the first loop does not count: it makes all facts and goals at once, unlike the loops of agents
    first_ms, later_ms = loops_ms[0], sorted(loops_ms[1:])
    rate = 1e3 * len(later_ms) / sum(later_ms)
    verdict = "ok" if rate >= MIN_LOOPS_A_SECOND else "TOO SLOW"
    print(f"{ROBOTS} robots, {FACTS} facts, {GOALS} goals: {rate:.0f} loops a second {verdict}")
    median_ms, p99_ms = statistics.median(later_ms), later_ms[len(later_ms) * 99 // 100]
    print(
        f"a loop: median {median_ms:.1f} ms, 99 of 100 below {p99_ms:.1f} ms, slowest {later_ms[-1]:.1f} ms"
    )
    print(
        f"{len(later_ms)} loops in {sum(later_ms) / 1e3:.2f} s; "
        f"the first, which makes the facts: {first_ms:.0f} ms"
    )


if __name__ == "__main__":
    main()
