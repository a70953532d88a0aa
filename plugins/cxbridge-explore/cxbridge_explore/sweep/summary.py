"""The summary of a sweep, and the comparison of two sweeps with the same seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from cxbridge_explore.sweep.rows import RunRow
from cxbridge_explore.sweep.statistics import Interval, mean_interval, proportion_interval, summarize_sample

MAX_LISTED_SEEDS: Final = 10  # by outcome, or of a comparison; chosen freely


def summarize_rows(rows: Sequence[RunRow]) -> dict[str, Any]:
    """Return the summary of a sweep as JSON values; see docs/games.md.

    :param rows: the rows in the order of seeds; at least one row.
    """
    outcomes = dict(Counter(row.outcome for row in rows).most_common())
    goals: dict[str, Counter[str]] = {}
    for row in rows:
        for goal_class, counts in row.goals.items():
            goals.setdefault(goal_class, Counter()).update(counts)
    completed_rows = [row for row in rows if row.is_completed]
    return {
        "runs": len(rows),
        "outcomes": outcomes,
        "completed": proportion_interval(len(completed_rows), len(rows)).as_dict(),
        "makespan": summarize_sample([row.makespan for row in completed_rows]),
        "calls": sum(row.calls for row in rows),
        "faults": sum(row.faults for row in rows),
        "goals": {name: dict(goals[name].most_common()) for name in sorted(goals)},
        "seeds": {
            outcome: [row.seed for row in rows if row.outcome == outcome][:MAX_LISTED_SEEDS]
            for outcome in outcomes
            if outcome != "completed"
        },
        "cpu_seconds": round(sum(row.cpu_seconds for row in rows), 3),
    }


def rank_differences(differences: Mapping[int, float]) -> list[int]:
    """Return the seeds with a difference, the largest difference first.

    :param differences: the differences by seed.
    """
    seeds = [seed for seed, difference in differences.items() if difference]
    return sorted(seeds, key=lambda seed: (-abs(differences[seed]), seed))


@dataclass(frozen=True, slots=True)
class AgentComparison:
    """The comparison of two agents in the same worlds.

    :param first_rows: the rows of the first agent by seed.
    :param second_rows: the rows of the second agent, for the same seeds.
    """

    first_rows: Mapping[int, RunRow]
    second_rows: Mapping[int, RunRow]

    @property
    def completion_difference(self) -> Interval:
        """The difference in the share of completed runs, second minus first."""
        return mean_interval(
            [
                float(self.second_rows[seed].is_completed) - row.is_completed
                for seed, row in self.first_rows.items()
            ]
        )

    @property
    def makespan_difference(self) -> Interval | None:
        """The difference in makespan in seconds, second minus first, over the seeds with two completed runs.

        None if there is no such seed.
        """
        differences = self._makespan_differences()
        return mean_interval(list(differences.values())) if differences else None

    def _makespan_differences(self) -> dict[int, float]:
        return {
            seed: self.second_rows[seed].makespan - row.makespan
            for seed, row in self.first_rows.items()
            if row.is_completed and self.second_rows[seed].is_completed
        }

    def most_different_seeds(self) -> list[int]:
        """Return up to :data:`MAX_LISTED_SEEDS` seeds: first those with different outcomes.

        Then come the seeds with two completed runs, the largest difference in makespan first.
        """
        differing_seeds = [
            seed for seed, row in self.first_rows.items() if row.outcome != self.second_rows[seed].outcome
        ]
        return [*differing_seeds, *rank_differences(self._makespan_differences())][:MAX_LISTED_SEEDS]

    def as_dict(self) -> dict[str, Any]:
        makespan = self.makespan_difference
        return {
            "completed": self.completion_difference.as_dict(),
            "makespan": None if makespan is None else makespan.as_dict(),
            "seeds": [
                {
                    "seed": seed,
                    "outcomes": [self.first_rows[seed].outcome, self.second_rows[seed].outcome],
                    "makespans": [
                        round(self.first_rows[seed].makespan, 6),
                        round(self.second_rows[seed].makespan, 6),
                    ],
                }
                for seed in self.most_different_seeds()
            ],
        }
