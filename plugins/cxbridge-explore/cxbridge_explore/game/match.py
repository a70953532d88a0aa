"""Plays many games of one agent, or of two agents with the same seeds, and compares the agents."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge_explore.game.kinds import Game
from cxbridge_explore.game.score import GameResult
from cxbridge_explore.spawning import safe_process_pool
from cxbridge_explore.sweep.statistics import CONFIDENCE, Interval, mean_interval, summarize_sample
from cxbridge_explore.sweep.summary import MAX_LISTED_SEEDS, rank_differences


def play_games(
    games: Mapping[str, Game], seeds: Sequence[int], process_count: int, show_line: Callable[[str], None]
) -> dict[str, dict[int, GameResult]]:
    """Play each game with each seed, in child processes.

    :param games: the games by agent.
    :param show_line: called with a line about the progress after each game.
    :returns: the results by agent and seed, in the order of ``games`` and ``seeds``.
    :raises CxbridgeError: if a scenario is invalid, or a process dies.
    """
    results: dict[str, dict[int, GameResult]] = {name: {} for name in games}
    with safe_process_pool(process_count) as pool:
        agents_and_seeds = {
            pool.submit(game.play, seed): (name, seed) for seed in seeds for name, game in games.items()
        }
        try:
            for count, future in enumerate(as_completed(agents_and_seeds), 1):
                name, seed = agents_and_seeds[future]
                results[name][seed] = future.result()
                show_line(f"{count} of {len(agents_and_seeds)} games")
        except BrokenProcessPool:
            raise CxbridgeError(
                "a process that played a game has died", hint="play fewer games at once: --jobs 1"
            ) from None
        finally:
            pool.shutdown(cancel_futures=True)  # after an error, no further game starts
    # in the order of `seeds`, since the games have ended in any order
    return {
        name: {seed: results_by_seed[seed] for seed in seeds} for name, results_by_seed in results.items()
    }


def mean_points(results: Mapping[int, GameResult]) -> Interval:
    """Return the mean points of an agent's games, with its confidence interval.

    :param results: the results by seed; at least one.
    """
    return mean_interval([float(result.points) for result in results.values()])


def summarize_games(results: Mapping[int, GameResult]) -> dict[str, Any]:
    """Return the games of one agent as JSON values; see docs/games.md.

    :param results: the results by seed; at least one.
    """
    return {
        "games": len(results),
        "complete": sum(result.is_over for result in results.values()),
        "points": summarize_sample([float(result.points) for result in results.values()]),
        "mean": mean_points(results).as_dict(),
        "deliveries": sum(len(result.score.deliveries) for result in results.values()),
        "by_seed": {seed: result.points for seed, result in results.items()},
    }


@dataclass(frozen=True, slots=True)
class Match:
    """The games of two agents with the same seeds.

    :param first: the results of the first agent by seed.
    :param second: the results of the second agent by seed.
    """

    first: Mapping[int, GameResult]
    second: Mapping[int, GameResult]

    @property
    def difference(self) -> Interval:
        """The mean difference in points, second minus first."""
        return mean_interval(list(self._differences().values()))

    def _differences(self) -> dict[int, float]:
        return {seed: float(self.second[seed].points - result.points) for seed, result in self.first.items()}

    def most_different_games(self) -> Iterator[tuple[int, int, int]]:
        """Yield the seeds with the largest differences, with the points of the first and second agent."""
        for seed in rank_differences(self._differences())[:MAX_LISTED_SEEDS]:
            yield seed, self.first[seed].points, self.second[seed].points

    @property
    def better_index(self) -> int | None:
        """The index of the better agent, 0 or 1; None if the games do not show a difference."""
        difference = self.difference
        if not difference.excludes_zero:
            return None
        return 1 if difference.estimate > 0 else 0

    def as_dict(self) -> dict[str, Any]:
        return {
            "difference": self.difference.as_dict(),
            "confidence": CONFIDENCE,
            "better": self.better_index,
            "seeds": [
                {"seed": seed, "points": [first_points, second_points]}
                for seed, first_points, second_points in self.most_different_games()
            ],
        }
