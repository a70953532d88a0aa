"""The skill board as a component: masters, executors of this process, Skillers of the agents."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.skiller.board.executor import Execution, as_executor
from cxbridge.skiller.board.service import SkillBoardService
from cxbridge.skiller.board.settings import BoardSettings


class SkillBoardComponent(Component):
    """Finds executors for skills.

    :param settings: those of a recording; None: those of the configuration.
    :raises CxbridgeError: when an executor cannot be made, or somebody else writes an interface.
    """

    hooks = (Hook.SKILL,)

    def __init__(self, context: Run, settings: BoardSettings | None = None) -> None:
        from_recording = settings is not None
        settings = settings or context.skill_board
        assert settings is not None  # else it is not needed
        policy = context.source.board_policy(context.config)
        self.service = SkillBoardService(
            context.board, context.clock, context.bus, settings, policy, _execution(context)
        )
        self._run = context
        context.skill_service = self.service
        try:
            if not from_recording:
                context.source.prepare_board(context)
        except Exception:
            self.close()
            raise

    def loop(self) -> None:
        """Let masters and executors work."""
        self.service.loop()

    @property
    def running(self) -> bool:
        """Whether a skill is executed."""
        return self.service.running

    @property
    def is_quiet(self) -> bool:
        """Whether no skill is executed."""
        return not self.running

    def close(self) -> None:
        """End all skills."""
        self._run.skill_service = None
        self.service.close()


def _execution(context: Run) -> Execution:
    """Return how calls are executed: failures are simulated where the Skillers are.

    :raises SkillerError: when the configuration of the failures is wrong.
    """
    if context.execution is not None:
        return context.execution
    if context.options.skiller != "simulator":
        return as_executor
    from cxbridge.run.components.skillers import make_deciders  # noqa: PLC0415 - for simulations
    from cxbridge.skiller.simulation.deciders import Deciders  # noqa: PLC0415
    from cxbridge.skiller.simulation.execution import DecidedExecution  # noqa: PLC0415
    from cxbridge.skiller.simulation.make import make_failures  # noqa: PLC0415

    make_failures(context.config, "")  # what is wrong shows now, not with the first call
    return DecidedExecution(
        lambda agent: Deciders([make_failures(context.config, agent), *make_deciders(context, agent)])
    )
