"""One run of an exploration, whose properties are watched from the start to the end of the run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge_explore.graph import BAD_INPUT, DIVERGED, Leaf
from cxbridge_explore.properties.monitor import Ending, Property, RunEnd
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.used_parts import UsedPart, UseWatch
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import Chooser, DivergedError
from cxbridge_explore.worlds.run import MakeAssembly, WorldResult, WorldRun, make_scenario


class ExploredRun(WorldRun):
    """A run with watched properties.

    :param options: the options of ``cxbridge run``.
    :param chooser: decides at each choice point.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make_assembly: makes the program to run.
    :param stops_at_violation: whether the run ends at the first violation.
    :param records_used_parts: whether to record the used parts of the agent.
    """

    def __init__(
        self,
        options: RunOptions,
        properties: Sequence[Property],
        chooser: Chooser,
        *,
        world: WorldModel | None = None,
        make_assembly: MakeAssembly = make_scenario,
        stops_at_violation: bool = False,
        records_used_parts: bool = False,
    ) -> None:
        super().__init__(options, chooser, world, make_assembly=make_assembly)
        self._stops_at_violation = stops_at_violation
        self._use_watch = UseWatch(self.assembly.bus, self.assembly.agents) if records_used_parts else None
        self.property_watch = PropertyWatch(properties, self.assembly.agents, self.assembly.clock)
        self.watchers.append(self.property_watch)

    def collect_used_parts(self) -> tuple[UsedPart, ...]:
        """Return the parts of the agent that were used for the first time since the last call.

        :returns: an empty tuple if the used parts are not recorded.
        """
        return () if self._use_watch is None else self._use_watch.take_new_parts()

    def play(self) -> WorldResult:
        """Play the run to its end and evaluate the properties; see :meth:`WorldRun.play`."""
        result = super().play()
        verdict = result.verdict
        ending = Ending.OVER if result.is_over else Ending.STUCK if verdict.is_stuck else Ending.CUT
        self.property_watch.check_end(RunEnd(ending, "" if result.is_over else verdict.reason))
        self.assembly.finalize()
        self.property_watch.check_shutdown()
        return result

    def play_to_leaf(self) -> Leaf:
        """Play the run to its end and return the result as a leaf of the graph.

        :raises CxbridgeError: if the agent is broken.
        """
        verdict = self.play().verdict
        return Leaf(
            verdict.word,
            verdict.reason,
            verdict.run_seconds,
            tuple(self.property_watch.violations),
            tuple(sorted(self.property_watch.evaluated_names)),
        )

    def _must_stop(self) -> bool:
        """Check the run after a loop, and return whether the run cannot continue or stops at a violation."""
        is_violated = self.property_watch.check()
        return super()._must_stop() or (self._stops_at_violation and is_violated)


MakeRun = Callable[[Chooser], ExploredRun]  # makes a run with a chooser


def make_failure_leaf(error: Exception) -> Leaf:
    """Return the leaf for a run that has raised an exception; its duration is unknown."""
    if isinstance(error, DivergedError):
        return Leaf(DIVERGED, str(error), seconds=0.0)
    if isinstance(error, CxbridgeError):
        return Leaf(BAD_INPUT, str(error), seconds=0.0)
    return Leaf("fault", f"{type(error).__name__}: {error}", seconds=0.0)
