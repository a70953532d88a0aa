"""One run of an exploration, from its start or from where it was forked, to how it ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cxbridge.errors import CxbridgeError
<<<<<<< HEAD
from cxbridge.events import LogLine
from cxbridge.explore.graph import BAD_INPUT, DIVERGED, Leaf
from cxbridge.properties.monitor import Ending, Property, RunEnd
from cxbridge.properties.watch import PropertyWatch
from cxbridge.run.ending.mistakes import AgentChecks
from cxbridge.run.ending.stuck import RuleErrors, StuckWatch
from cxbridge.run.options import RunOptions
from cxbridge.run.run import sum_up_run
from cxbridge.worlds.points import Chooser, DivergedError
from cxbridge.worlds.run import WorldRun
=======
from cxbridge.explore.graph import BAD_INPUT, Leaf
from cxbridge.worlds.judged import JudgedRun
>>>>>>> main


class ExploredRun(JudgedRun):
    """A run of which only its end is kept."""

<<<<<<< HEAD
    :param options: as for ``cxbridge run``.
    :param properties: those that it is to have.
    :param chooser: is asked at each choice point.
    :raises CxbridgeError: when the scenario is wrong.
    """

    def __init__(self, options: RunOptions, properties: Sequence[Property], chooser: Chooser) -> None:
        self.world = WorldRun(options, chooser)
        self._options = options
        assembly = self.world.assembly
        self.properties = PropertyWatch(properties, assembly.agents, assembly.clock)
        self._checks = AgentChecks(assembly.agents, on=not options.is_lenient)
        self._errors = RuleErrors()
        assembly.bus.subscribe(self._errors, LogLine)
        self._watch = StuckWatch(assembly.agents, on=True)
        self._is_stuck = self._is_checked = False
        self._loss = ""

    def play(self) -> Leaf:
=======
    def leaf(self) -> Leaf:
>>>>>>> main
        """Play it to its end.

        :raises CxbridgeError: when the agent is broken.
        """
<<<<<<< HEAD
        result = self.world.play(self._look)
        ending = Ending.OVER if result.is_over else Ending.STUCK if self._is_stuck else Ending.CUT
        ended = sum_up_run(
            self.world.assembly,
            self._options,
            self._loss,
            None,
            (result.seconds, 0.0),
            over=result.is_over,
            rule_errors=self._errors if self._is_stuck else None,
        )
        self.properties.end(RunEnd(ending, "" if result.is_over else ended.reason))
        self.world.assembly.stop()
        self.properties.released()
        return Leaf(
            ended.word,
            ended.reason,
            result.seconds,
            tuple(self.properties.violations),
            tuple(sorted(self.properties.evaluated)),
        )

    def _look(self) -> bool:
        """Return whether the run cannot go on; called after each loop."""
        if not self._is_checked:
            self._is_checked = True
            self._checks.start()
        self._checks.look()
        self.properties.look()
        self._loss = self.world.assembly.loss
        self._is_stuck = not self._loss and self._watch.look()
        return bool(self._loss) or self._is_stuck

    def close(self) -> None:
        """End it and let go of everything."""
        self.world.close()

=======
        ended, result = self.play()
        return Leaf(ended.word, ended.reason, result.seconds)

>>>>>>> main

MakeRun = Callable[[Chooser], ExploredRun]
"""Makes a run in which somebody chooses."""


def failure(error: Exception) -> Leaf:
    """Return how a run ended that an error of Python has ended."""
    if isinstance(error, DivergedError):
        return Leaf(DIVERGED, str(error), 0.0)
    if isinstance(error, CxbridgeError):
        return Leaf(BAD_INPUT, str(error), 0.0)
    return Leaf("fault", f"{type(error).__name__}: {error}", 0.0)
