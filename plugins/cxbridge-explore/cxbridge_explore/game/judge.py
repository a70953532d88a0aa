"""The interface of judges, which report the state and the score of a game, and the record of the states.

The production is the phase of a game in which teams are awarded points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge_explore.game.score import POST_GAME, Score
from cxbridge_explore.game.timeline import Span, clip_spans

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

PRODUCTION: Final = "PRODUCTION"


class GameState(NamedTuple):
    """The state of a game.

    :param phase: the phase of the game, such as :data:`PRODUCTION`.
    :param machines: the state of each machine.
    """

    phase: str
    machines: Mapping[str, str]


class Judge(Protocol):
    """Reports the state and the score of a game, without influence on the game."""

    def watch(self, run: Run | Team) -> None:
        """Watch a run that has not started yet."""

    def state(self) -> GameState:
        """Return the current state; called after each loop."""

    def score(self, agents: Sequence[Run]) -> Score:
        """Return the score at the end of the game."""


class GameWatch:
    """Records the start and the end of the production, and the states of machines.

    :param clock: the run's clock; the run starts now.
    """

    def __init__(self, judge: Judge, clock: Clock) -> None:
        self._judge, self._clock = judge, clock
        self._run_start_us = clock.now_us()
        # the times of the loops after which the production had begun and had ended
        self._production_begin_us: int | None = None
        self._production_end_us: int | None = None
        self._changes: dict[str, list[tuple[int, str]]] = {}

    def record(self) -> None:
        """Record the current state, after each loop."""
        if self._production_end_us is not None:
            return
        now_us, (phase, machines) = self._clock.now_us(), self._judge.state()
        if phase == PRODUCTION and self._production_begin_us is None:
            self._production_begin_us = now_us
        elif phase == POST_GAME:
            self._production_end_us = now_us
        for name, state in machines.items():
            changes = self._changes.setdefault(name, [])
            if not changes or changes[-1][1] != state:
                changes.append((now_us, state))

    def seconds_at(self, time_us: int) -> float:
        """Return the seconds from the start of the production, or of the run before the production."""
        begin_us = self._run_start_us if self._production_begin_us is None else self._production_begin_us
        return round((time_us - begin_us) / MICROSECONDS, 3)

    @property
    def production_seconds(self) -> float:
        """The duration of the production so far."""
        return self.seconds_at(self._production_end_us or self._clock.now_us())

    def machine_spans(self) -> dict[str, tuple[Span, ...]]:
        """Return the states of each machine during the production."""
        spans_of_machines = {}
        for name, changes in sorted(self._changes.items()):
            end_times_us = [
                *(time_us for time_us, _ in changes[1:]),
                self._production_end_us or self._clock.now_us(),
            ]
            spans = (
                Span(self.seconds_at(begin_us), self.seconds_at(end_us), state)
                for (begin_us, state), end_us in zip(changes, end_times_us, strict=True)
            )
            spans_of_machines[name] = tuple(clip_spans(spans, self.production_seconds))
        return spans_of_machines
