"""Many games of one agent, or of two agents on the same seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.spawning import spawned_pool
from cxbridge_explore.game.kinds import Game
from cxbridge_explore.game.score import GameResult
from cxbridge_explore.sweep.statistics import CONFIDENCE, Interval, Quantiles, mean_interval

_SHOWN_SEEDS: Final = 10  # seeds with the largest differences that are listed


def play_games(
    games: Mapping[str, Game], seeds: Sequence[int], processes: int, advance: Callable[[], None]
) -> dict[str, dict[int, GameResult]]:
    """Play each game with each seed, in child processes.

    :param advance: called after each game.
    :returns: the results by name and seed, in order.
    :raises CxbridgeError: if a scenario is invalid, or a process dies.
    """
    found: dict[str, dict[int, GameResult]] = {name: {} for name in games}
    with spawned_pool(processes) as pool:
        pending = {
            pool.submit(game.play, seed): (name, seed) for seed in seeds for name, game in games.items()
        }
        try:
            for future in as_completed(pending):
                name, seed = pending[future]
                found[name][seed] = future.result()
                advance()
        except BrokenProcessPool:
            raise CxbridgeError(
                "a process that played a game has died", hint="play fewer at once: --jobs 1"
            ) from None
        finally:
            pool.shutdown(cancel_futures=True)
    return {name: {seed: results[seed] for seed in seeds} for name, results in found.items()}


@dataclass(frozen=True, slots=True)
class GamesSummary:
    """The games of one agent.

    :param results: by seed; at least one.
    """

    results: Mapping[int, GameResult]

    @property
    def points(self) -> Interval:
        return mean_interval([float(each.points) for each in self.results.values()])

    def as_dict(self) -> dict[str, Any]:
        quantiles = Quantiles.of([float(each.points) for each in self.results.values()])
        return {
            "games": len(self.results),
            "complete": sum(each.is_over for each in self.results.values()),
            "points": None if quantiles is None else quantiles.as_dict(),
            "mean": self.points.as_dict(),
            "deliveries": sum(len(each.score.deliveries) for each in self.results.values()),
            "by_seed": {seed: each.points for seed, each in self.results.items()},
        }


@dataclass(frozen=True, slots=True)
class Match:
    """The games of two agents on the same seeds.

    :param first: results of the first agent by seed.
    :param second: results of the second agent by seed.
    """

    first: Mapping[int, GameResult]
    second: Mapping[int, GameResult]

    @property
    def difference(self) -> Interval:
        """The mean difference in points, second minus first."""
        return mean_interval([float(value) for value in self._differences().values()])

    def _differences(self) -> dict[int, int]:
        return {seed: self.second[seed].points - each.points for seed, each in self.first.items()}

    def farthest(self) -> Iterator[tuple[int, int, int]]:
        """Yield the seeds with the largest differences, with both agents' points."""
        differences = {seed: value for seed, value in self._differences().items() if value}
        for seed in sorted(differences, key=lambda seed: (-abs(differences[seed]), seed))[:_SHOWN_SEEDS]:
            yield seed, self.first[seed].points, self.second[seed].points

    @property
    def better(self) -> int | None:
        """The index of the better agent; None if the games do not show a difference."""
        difference = self.difference
        if not difference.excludes_zero:
            return None
        return 1 if difference.estimate > 0 else 0

    def as_dict(self) -> dict[str, Any]:
        return {
            "difference": self.difference.as_dict(),
            "confidence": CONFIDENCE,
            "better": self.better,
            "seeds": [
                {"seed": seed, "points": [first_points, second_points]}
                for seed, first_points, second_points in self.farthest()
            ],
        }
