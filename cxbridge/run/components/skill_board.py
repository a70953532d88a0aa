"""The skill board as a component: masters, executors of this process, Skillers of the agents."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.context import RunContext
from cxbridge.run.ros2cx_features import ros2cx_skills
from cxbridge.skiller.board.settings import BoardSettings
from cxbridge.skiller.board.station import SkillStation


class SkillBoard(Component):
    """Finds executors for skills.

    :param settings: those of a recording; None: those of the configuration.
    :raises CxbridgeError: when an executor cannot be made, or somebody else writes an interface.
    """

    hooks = (Hook.SKILL,)

    def __init__(self, context: RunContext, settings: BoardSettings | None = None) -> None:
        executors = context.options.executors if settings is None else ()
        settings = settings or context.skill_board
        assert settings is not None  # else it is not needed
        manners = None
        if context.paths.ros2cx is not None:
            from cxbridge.ros2cx.original_board import manners_of  # noqa: PLC0415 - for those who need it

            manners = manners_of(context.config)
        self.station = SkillStation(context.board, context.clock, context.bus, settings, manners)
        self._shared = context.skills
        self._shared.station = self.station
        try:
            for text in executors:
                skills = ros2cx_skills(context)
                assert skills is not None  # there is a station now
                skills.add_executor(text)
        except Exception:
            self.close()
            raise

    def loop(self) -> None:
        """Let masters and executors work."""
        self.station.loop()

    @property
    def running(self) -> bool:
        """Whether a skill is executed."""
        return self.station.running

    def close(self) -> None:
        """End all skills."""
        self._shared.station = self._shared.ros2cx = None
        self.station.close()
