"""Draws what the world does."""

from __future__ import annotations

import random
from collections import Counter

from cxbridge.worlds.points import ChoicePoint


class SeededChooser:
    """Draws an option at each choice point, by weight.

    What is drawn depends on the seed, on what the choice is about, and on how often that came before. So two
    versions of an agent meet the same world with one seed, even when one of them does something in between.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._before: Counter[str] = Counter()

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - other choosers count
        """Return the index of the option that is drawn."""
        times = self._before[point.subject]
        self._before[point.subject] += 1
        rng = random.Random(f"{self._seed}/{point.subject}/{times}")  # noqa: S311 - a simulation repeats
        return rng.choices(range(len(point.options)), [option.weight for option in point.options])[0]
