"""Fawkes' plugins ``pddl-robot-memory`` and ``pddl-planner`` as a component."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_planning.fawkes.plugins import PddlPlanner, PddlRobotMemory, ProblemFiles
from cxbridge_planning.feature.base import service_maker
from cxbridge_planning.settings import PlannerSettings
from cxbridge_robot_memory.component import robot_memory


class PlanningPlugins(Component):
    """Generates PDDL problems from the robot memory, and plans.

    The component is for agents that load Fawkes' file ``pddl-init.clp``.

    :raises CxbridgeError: if a setting is missing, the robot memory cannot be opened, or an interface has
        another writer.
    """

    hooks = (Hook.ACT_EXEC,)
    description = "Makes problems from the robot memory, and plans"

    def __init__(self, context: Run) -> None:
        paths, config, store = context.paths, context.config, robot_memory(context).open()
        files = ProblemFiles(
            paths.substitutions,
            paths.confdir,
            writes_to_disk=config.get_bool("/planner/write-problem", default=False),
        )
        self._generator = PddlRobotMemory(context.board, context.bus, config, store, files)
        try:
            service = service_maker(context, PlannerSettings.from_config(config))(context.name)
            self._planner = PddlPlanner(context.board, context.bus, config, store, files, service)
        except BaseException:
            self._generator.close()  # its interface would keep its writer
            raise

    def loop(self) -> None:
        self._generator.loop()
        self._planner.loop()

    def close(self) -> None:
        self._planner.close()
        self._generator.close()
