"""The skill board as a component. Only runs with a skill board import this module."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.run.skillers import make_deciders
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.executor import Execution, execute_itself
from cxbridge.skiller.board.service import SkillBoardService
from cxbridge.skiller.board.settings import BoardSettings


class SkillBoardComponent(Component):
    """Runs the skill board, which finds executors for the skills that agents call.

    :param settings: the settings of a replay; None: the configured settings.
    :raises CxbridgeError: if an executor cannot be made or an interface has another writer.
    """

    hooks = (Hook.SKILL,)

    def __init__(self, context: Run, settings: BoardSettings | None = None) -> None:
        is_replay = settings is not None
        settings = settings or context.skill_board
        assert settings is not None  # the table makes this component only with a skill board
        self.service = SkillBoardService(
            context.board,
            context.clock,
            context.bus,
            settings,
            context.source.board_class(context.config) or SkillBoard,
            _make_execution(context),
        )
        self._context = context
        context.skill_service = self.service
        try:
            if not is_replay:
                context.source.prepare_board(context)
        except Exception:
            self.close()
            raise

    def loop(self) -> None:
        self.service.loop()

    @property
    def running(self) -> bool:
        return self.service.running

    @property
    def is_quiet(self) -> bool:
        return not self.running

    def close(self) -> None:
        self._context.skill_service = None
        self.service.close()


def _make_execution(context: Run) -> Execution:
    """Return the function that executes calls. With ``--skiller simulator`` the function simulates failures.

    :raises CxbridgeError: if the configuration of failures is wrong.
    """
    if context.execution is not None:
        return context.execution
    if context.options.skiller != "simulator":
        return execute_itself
    # import on use, because only simulations need the estimators
    from cxbridge.skiller.simulation.execution import DecidedExecution  # noqa: PLC0415
    from cxbridge.skiller.simulation.make import make_failure_injector  # noqa: PLC0415

    make_failure_injector(context.config, "")  # raises configuration errors now rather than at the first call
    return DecidedExecution(
        lambda agent: [make_failure_injector(context.config, agent), *make_deciders(context, agent)]
    )
