"""One run of an exploration: its properties are watched from its start, and decided at its end."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge.run.result import COMPLETED, UNSUCCESSFUL, RunResult
from cxbridge_explore.graph import BAD_INPUT, DIVERGED, Leaf
from cxbridge_explore.properties.monitor import Ending, Property, RunEnd
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.use import Used, UseWatch
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.judged import JudgedRun
from cxbridge_explore.worlds.points import Chooser, DivergedError
from cxbridge_explore.worlds.run import MakeAssembly, WorldResult, make_scenario


class ExploredRun(JudgedRun):
    """A run with watched properties.

    :param options: the options of ``cxbridge run``.
    :param chooser: decides at each choice point.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make: makes the program to run.
    :param briefly: whether to stop at the first violation.
    :param coverage: whether to record the used parts of the agent.
    """

    def __init__(
        self,
        options: RunOptions,
        properties: Sequence[Property],
        chooser: Chooser,
        *,
        world: WorldModel | None = None,
        make: MakeAssembly = make_scenario,
        briefly: bool = False,
        coverage: bool = False,
    ) -> None:
        super().__init__(options, chooser, world, make=make)
        self._briefly = briefly
        assembly = self.world.assembly
        self._use = UseWatch(assembly.bus, assembly.agents) if coverage else None
        self.properties = PropertyWatch(properties, assembly.agents, assembly.clock)
        self.world.watchers.append(self.properties)

    def used(self) -> tuple[Used, ...]:
        """Return the parts of the agent that were used for the first time since the last call."""
        return () if self._use is None else self._use.new_parts()

    def play(self) -> tuple[RunResult, WorldResult]:
        """Play the run to its end and evaluate the properties; see :class:`JudgedRun`."""
        ended, result = super().play()
        is_over = ended.status in (COMPLETED, UNSUCCESSFUL)
        ending = Ending.OVER if is_over else Ending.STUCK if ended.is_stuck else Ending.CUT
        self.properties.end(RunEnd(ending, "" if is_over else ended.reason))
        self.world.assembly.finalize()
        self.properties.finalized()
        return ended, result

    def leaf(self) -> Leaf:
        """Play the run to its end and return the result.

        :raises CxbridgeError: if the agent is broken.
        """
        ended, result = self.play()
        return Leaf(
            ended.word,
            ended.reason,
            result.seconds,
            tuple(self.properties.violations),
            tuple(sorted(self.properties.evaluated)),
        )

    def _is_cut(self) -> bool:
        """Return whether the run cannot continue, or need not: a violation suffices if it is brief."""
        is_violated = self.properties.check()
        return super()._is_cut() or (self._briefly and is_violated)


MakeRun = Callable[[Chooser], ExploredRun]  # makes a run with a chooser


def failure(error: Exception) -> Leaf:
    """Return the leaf of a run that raised an exception."""
    if isinstance(error, DivergedError):
        return Leaf(DIVERGED, str(error), 0.0)
    if isinstance(error, CxbridgeError):
        return Leaf(BAD_INPUT, str(error), 0.0)
    return Leaf("fault", f"{type(error).__name__}: {error}", 0.0)
