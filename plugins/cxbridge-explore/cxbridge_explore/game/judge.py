"""The interface of judges, which report the state and the score of a game, and the record of the states.

The production is the phase of a game in which teams are awarded points.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Protocol

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge_explore.game.score import POST_GAME, Score

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

PRODUCTION: Final = "PRODUCTION"


class Judge(Protocol):
    """Reports the state and the score of a game, without influence on the game."""

    @property
    def phase(self) -> str:
        """The phase of the game, such as :data:`PRODUCTION`."""

    @property
    def machine_states(self) -> Mapping[str, str]:
        """The state of each machine."""

    @property
    def faults(self) -> Sequence[str]:
        """The errors of the program that judges."""

    def score(self) -> Score:
        """Return the score at the end of the game.

        :raises CxbridgeError: if the run is not a game.
        """


# Makes the judge of a run that has not started yet.
MakeJudge = Callable[["Run | Team"], Judge]


class GameWatch:
    """Records the start and the end of the production, and the states of machines.

    :param clock: the run's clock; the run starts now.
    """

    def __init__(self, judge: Judge, clock: Clock) -> None:
        self._judge, self._clock = judge, clock
        self._phase = ""
        # the start of the production, or of the run before the production; and the end of the last loop
        self._begin_us = self._last_us = clock.now_us()
        self._states: Mapping[str, str] = {}  # of the machines after the last loop
        self._state_times_us: dict[str, Counter[str]] = {}  # the time in each state, by machine

    def record(self) -> None:
        """Record the current state, after each loop."""
        if self._phase == POST_GAME:
            return
        now_us, last_phase = self._clock.now_us(), self._phase
        for name, state in self._states.items():
            self._state_times_us.setdefault(name, Counter())[state] += now_us - self._last_us
        self._phase, self._states, self._last_us = self._judge.phase, dict(self._judge.machine_states), now_us
        if self._phase == PRODUCTION != last_phase:  # the production begins
            self._begin_us = now_us
            self._state_times_us.clear()

    def seconds_at(self, time_us: int) -> float:
        """Return the seconds from the start of the production, or of the run before the production."""
        return round((time_us - self._begin_us) / MICROSECONDS, 3)

    @property
    def production_seconds(self) -> float:
        """The duration of the production so far; before the production, of the run."""
        return self.seconds_at(self._last_us)

    def machine_seconds(self) -> dict[str, dict[str, float]]:
        """Return the seconds that each machine was in each state, the longest first, by machine.

        The time counts from the start of the production; before the production, from the start of the run.
        """
        return {
            name: {state: round(time_us / MICROSECONDS, 1) for state, time_us in counter.most_common()}
            for name, counter in sorted(self._state_times_us.items())
        }
