"""The summary of a sweep, and the comparison of two sweeps with the same seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from cxbridge_explore.sweep.rows import RunRow
from cxbridge_explore.sweep.statistics import Interval, mean_interval, proportion_interval, summarize_sample

_MAX_LISTED_SEEDS: Final = 10


@dataclass(frozen=True, slots=True)
class SweepSummary:
    """The summary of a sweep.

    :param rows: the rows in the order of seeds; at least one row.
    """

    rows: Sequence[RunRow]

    @property
    def outcomes(self) -> dict[str, int]:
        """The number of runs by outcome, most frequent first."""
        return dict(Counter(row.outcome for row in self.rows).most_common())

    @property
    def completed(self) -> Interval:
        """The share of completed runs."""
        return proportion_interval(sum(row.is_completed for row in self.rows), len(self.rows))

    @property
    def makespan(self) -> dict[str, float] | None:
        """The quantiles of the durations of completed runs; None without a completed run."""
        return summarize_sample([row.makespan for row in self.rows if row.is_completed])

    @property
    def goals(self) -> dict[str, dict[str, int]]:
        """The number of goals by class and outcome, in all runs."""
        outcomes_by_class: dict[str, Counter[str]] = {}
        for row in self.rows:
            for goal_class, outcomes in row.goals.items():
                outcomes_by_class.setdefault(goal_class, Counter()).update(outcomes)
        return {name: dict(outcomes_by_class[name].most_common()) for name in sorted(outcomes_by_class)}

    def find_seeds(self, outcome: str) -> list[int]:
        """Return the first seeds whose runs have an outcome."""
        return [row.seed for row in self.rows if row.outcome == outcome][:_MAX_LISTED_SEEDS]

    def as_dict(self) -> dict[str, Any]:
        return {
            "runs": len(self.rows),
            "outcomes": self.outcomes,
            "completed": self.completed.as_dict(),
            "makespan": self.makespan,
            "calls": sum(row.calls for row in self.rows),
            "faults": sum(row.faults for row in self.rows),
            "goals": self.goals,
            "seeds": {name: self.find_seeds(name) for name in self.outcomes if name != "completed"},
            "cpu_seconds": round(sum(row.cpu_seconds for row in self.rows), 3),
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

    :param first: the rows of the first agent by seed.
    :param second: the rows of the second agent, for the same seeds.
    """

    first: Mapping[int, RunRow]
    second: Mapping[int, RunRow]

    @property
    def completed(self) -> Interval:
        """The difference in the share of completed runs, second minus first."""
        return mean_interval(
            [float(self.second[seed].is_completed) - row.is_completed for seed, row in self.first.items()]
        )

    @property
    def makespan(self) -> Interval | None:
        """The difference in makespan in seconds, second minus first, over runs that both complete."""
        differences = self._differences()
        return mean_interval(list(differences.values())) if differences else None

    def _differences(self) -> dict[int, float]:
        return {
            seed: self.second[seed].makespan - row.makespan
            for seed, row in self.first.items()
            if row.is_completed and self.second[seed].is_completed
        }

    def most_different_seeds(self) -> list[int]:
        """Return the most different seeds: first the seeds with different outcomes, then by makespan."""
        other_outcomes = [
            seed for seed, row in self.first.items() if row.outcome != self.second[seed].outcome
        ]
        return [*other_outcomes, *rank_differences(self._differences())][:_MAX_LISTED_SEEDS]

    def as_dict(self) -> dict[str, Any]:
        makespan = self.makespan
        return {
            "completed": self.completed.as_dict(),
            "makespan": None if makespan is None else makespan.as_dict(),
            "seeds": [
                {
                    "seed": seed,
                    "outcomes": [self.first[seed].outcome, self.second[seed].outcome],
                    "makespans": [round(self.first[seed].makespan, 6), round(self.second[seed].makespan, 6)],
                }
                for seed in self.most_different_seeds()
            ],
        }
