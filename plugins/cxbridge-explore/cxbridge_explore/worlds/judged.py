"""A run in a chosen world, with the verdict of ``cxbridge run``."""

from __future__ import annotations

from cxbridge.closing import Closing
from cxbridge.run.mistakes import AgentChecks
from cxbridge.run.options import RunOptions
from cxbridge.run.result import RunResult
from cxbridge.run.run import sum_up_run
from cxbridge.run.stuck import StuckWatch
from cxbridge.run.watchdog import make_spin_watchdog
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import Chooser
from cxbridge_explore.worlds.run import MakeAssembly, WorldResult, WorldRun, make_scenario


class JudgedRun(Closing):
    """A run in a chosen world that is played once, with the verdict of ``cxbridge run``. A context manager.

    :param options: the options of ``cxbridge run``.
    :param chooser: decides at each choice point.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make_assembly: makes the program to run.
    :raises CxbridgeError: if the scenario or the world is invalid.
    """

    def __init__(
        self,
        options: RunOptions,
        chooser: Chooser,
        world: WorldModel | None = None,
        *,
        make_assembly: MakeAssembly = make_scenario,
    ) -> None:
        self.world = WorldRun(options, chooser, world, make_assembly=make_assembly)
        self._options = options
        assembly = self.world.assembly
        self._checks = AgentChecks(assembly.agents)
        self._stuck_watch = StuckWatch(assembly)
        self.world.watchers.append(self._checks)
        self._watchdog = make_spin_watchdog(assembly)
        self._watchdog.start()
        self._is_checked = False
        self._loss_reason = ""

    def play(self) -> tuple[RunResult, WorldResult]:
        """Play the run to its end; return the verdict and the choices. Real time is not measured.

        :raises CxbridgeError: if the agent is broken.
        """
        result = self.world.play(self._is_cut)
        run_result = sum_up_run(
            self.world.assembly,
            self._options,
            self._loss_reason,
            None,
            (result.seconds, 0.0),
            self._stuck_watch,
            is_over=result.is_over,
        )
        return run_result, result

    def _is_cut(self) -> bool:
        """Return whether the run cannot continue, since it is stuck or has lost a component."""
        if not self._is_checked:
            self._is_checked = True
            self._checks.check_loaded_files()
        self._checks.check_new_files()
        self._loss_reason = self.world.assembly.loss_reason
        # A team that waits for a restart is not stuck, since the restarted agent can change its state.
        return bool(self._loss_reason) or (not self.world.awaits_restart and self._stuck_watch.check())

    def close(self) -> None:
        self._watchdog.stop()
        self.world.close()
