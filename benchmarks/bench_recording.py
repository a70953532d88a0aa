"""The cost of recording at each level: pairs of runs in one process, and the medians of their ratios."""

from __future__ import annotations

import gc
import statistics
import tempfile
import time
from pathlib import Path

from benchmarks.harness import report
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run

ROOT = Path(__file__).resolve().parent.parent
PAIRS = 11
LIMITS = {"transitions": 1.05, "rules": 1.25, "facts": 1.25}
"""The limits of the median ratio by level."""
GOALS = 150

SCENARIO = """
clips-executive:
  assert-time-each-loop: true
  automatic-goal-retraction: true
  steal-skiller-control: true
  spec: long
  specs:
    long:
      init:
        stage-1:
          - name: pddl-parser
            feature-request: true
        stage-3:
          - name: agent
            files: [long.clp, action-selection/sequential.clp, skills-actions.clp]
      action-mapping:
        act: wait{seconds=0.2}
skiller:
  skillspace: test
"""

AGENT = f"""
(defrule long-begin
  (executive-initialized)
  (not (skiller-control))
  =>
  (assert (skiller-control (skiller "Skiller")) (domain-operator (name act) (param-names text)) (work 1))
)
(defrule long-formulate
  (skiller-control (acquired TRUE))
  ?w <- (work ?n&:(<= ?n {GOALS}))
  (not (goal))
  =>
  (retract ?w)
  (assert (work (+ ?n 1)) (goal (id (sym-cat WORK ?n)) (class WORK)))
)
(defrule long-select ?g <- (goal (class WORK) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(defrule long-expand
  ?g <- (goal (id ?id) (class WORK) (mode SELECTED))
  =>
  (loop-for-count (?i 1 3) (assert (plan-action (id ?i) (plan-id P) (goal-id ?id) (action-name act)
                                   (param-names text) (param-values "hello"))))
  (assert (plan (id P) (goal-id ?id) (type SEQUENTIAL)))
  (modify ?g (mode EXPANDED))
)
(defrule long-commit
  ?g <- (goal (class WORK) (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule long-dispatch ?g <- (goal (class WORK) (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule long-evaluate ?g <- (goal (class WORK) (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule long-retract ?g <- (goal (class WORK) (mode EVALUATED)) => (modify ?g (mode RETRACTED)))
"""


def run_seconds(scenario: Path, trace: Path | None, level: str) -> float:
    """Return the processor time of a run in seconds.

    :param trace: the file of the recording; None to run without a recording.
    """
    gc.collect()  # the garbage of the run before does not count
    started = time.process_time()
    run_scenario(RunOptions(scenario=scenario, trace=trace, trace_level=level))
    return time.process_time() - started


def measure_pair(scenario: Path, trace: Path, level: str, is_recorded_first: bool) -> tuple[float, float]:
    """Return the times of a recorded run and of a run without recording."""
    if is_recorded_first:
        return run_seconds(scenario, trace, level), run_seconds(scenario, None, level)
    plain = run_seconds(scenario, None, level)
    return run_seconds(scenario, trace, level), plain


def measure(name: str, scenario: Path, folder: Path) -> None:
    """Print the cost of recording a scenario at each level."""
    trace = folder / "run.mcap"
    for level, limit in LIMITS.items():
        # the first runs fill caches; the order of a pair alternates, so that a drift of speed cancels out
        run_seconds(scenario, trace, level)
        run_seconds(scenario, None, level)
        pairs = [measure_pair(scenario, trace, level, number % 2 == 0) for number in range(PAIRS)]
        ratio = statistics.median(recorded / plain for recorded, plain in pairs)
        recorded, plain = (min(times) for times in zip(*pairs, strict=True))
        event_count = sum(1 for _ in open_run(trace))
        fastest = f"{recorded:.3f} s against {plain:.3f} s, {recorded / plain:.2f}"
        print(f"  {event_count} events; the fastest: {fastest}")
        report(f"{name}, {level}: time recorded to time not recorded", ratio, limit)


def main() -> None:
    """Measure the test scenario and a long run."""
    with tempfile.TemporaryDirectory() as folder:
        long_run = Path(folder) / "long"
        long_run.mkdir()
        (long_run / "scenario.yaml").write_text(SCENARIO)
        (long_run / "long.clp").write_text(AGENT)
        measure("test scenario", ROOT / "scenarios" / "test-scenario", Path(folder))
        measure("long run", long_run, Path(folder))


if __name__ == "__main__":
    main()
