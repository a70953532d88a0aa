"""Fawkes' plugins `pddl-robot-memory` and `pddl-planner` as a component, for agents that plan with them."""

from __future__ import annotations

from cxbridge.executive.planning.plugins import PddlPlanner, PddlRobotMemory, ProblemFiles
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.run.specs import needs_memory


class PlanningPlugins(Component):
    """Generates problems from the robot memory, and plans; for specs that wait for that (``pddl-init.clp``).

    :raises CxbridgeError: when the configuration lacks a setting, or an interface has another writer.
    """

    hooks = (Hook.ACT_EXEC,)
    description = "Makes problems from the robot memory, and plans"

    def __init__(self, context: Run) -> None:
        if needs_memory(context.config, context.spec):
            context.memory.open()
        paths, config, store = context.paths, context.config, context.memory.store
        on_disk = config.get_bool("/planner/write-problem", default=False)
        files = ProblemFiles(paths.substitutions, paths.confdir, on_disk=on_disk)
        self._generator = PddlRobotMemory(context.board, context.bus, config, store, files)
        try:
            service = None if context.make_planning is None else context.make_planning(context.name)
            self._planner = PddlPlanner(
                context.board, context.clock, context.bus, config, store, files, service
            )
        except BaseException:
            self._generator.close()
            raise

    def loop(self) -> None:
        """Carry out the requests."""
        self._generator.loop()
        self._planner.loop()

    def close(self) -> None:
        """Close the interfaces."""
        self._planner.close()
        self._generator.close()
