"""Plays one run of a sweep, in the world that a chooser draws."""

from __future__ import annotations

import time
from collections import Counter

from cxbridge.events import Event, GoalTransition
from cxbridge_explore.sweep.rows import RunRow, SweepJob
from cxbridge_explore.worldmodel.reading import read_world
from cxbridge_explore.worlds.points import USUAL, Chooser
from cxbridge_explore.worlds.run import WorldRun


class GoalCounter:
    """Counts the outcomes of goals by class. The event bus calls the instance with each transition."""

    def __init__(self) -> None:
        # class and last outcome, by agent and id: the agents of a team have goals with equal ids
        self._last_outcomes: dict[tuple[str, str], tuple[str, str]] = {}

    def __call__(self, event: Event) -> None:
        if isinstance(event, GoalTransition) and event.outcome not in ("", "UNKNOWN"):
            self._last_outcomes[event.env, event.goal] = event.goal_class, event.outcome

    def counts_by_class(self) -> dict[str, dict[str, int]]:
        """Return the number of goals by class and outcome."""
        counts_by_class: dict[str, dict[str, int]] = {}
        for (goal_class, outcome), count in Counter(self._last_outcomes.values()).items():
            counts_by_class.setdefault(goal_class, {})[outcome] = count
        return counts_by_class


def play_seed(job: SweepJob, seed: int, chooser: Chooser) -> RunRow:
    """Play the run of a seed and return its row.

    :param seed: the seed for the row.
    :param chooser: draws the world from the seed.
    :raises CxbridgeError: if the scenario or the world is invalid.
    """
    start_s = time.process_time()
    goal_counter = GoalCounter()
    world_model = None if job.world is None else read_world(job.world)
    with WorldRun(job.options, chooser, world_model) as run:
        run.assembly.bus.subscribe(goal_counter, GoalTransition)
        result = run.play()
        call_count = len(run.skill_results)
    verdict = result.verdict
    unusual_choices = [choice for choice in result.choices if choice.option_index != USUAL]
    return RunRow(
        seed,
        verdict.word,
        verdict.reason,
        makespan=verdict.run_seconds,
        calls=call_count,
        faults=sum(choice.taken_option.faults for choice in unusual_choices),
        goals=goal_counter.counts_by_class(),
        choices=[choice.as_dict() for choice in unusual_choices],
        cpu_seconds=time.process_time() - start_s,
    )
