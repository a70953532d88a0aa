"""The component that serves an agent's world model to clients of PlanSys2.

PlanSys2 has a domain expert and a problem expert, nodes with a PDDL domain and a PDDL problem, and a planner.
Clients of these nodes see and edit the world model of the agent.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from cxbridge.errors import ConfigError
from cxbridge.executive.planning.settings import PlannerSettings
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.experts.planner import PlanServer
from cxbridge_ros2.experts.server import SECTION, ExpertServer, ExpertSettings
from cxbridge_ros2.problem_expert import shared_problem_expert_feature
from cxbridge_ros2.settings import locate_errors

if TYPE_CHECKING:
    from cxbridge.executive.planning import PlanningService


class Ros2Experts(Component):
    """Serves the domain, the problem and the planner of an agent."""

    hooks = (Hook.THINK,)
    steady = True  # clients are served while a daemon is paused
    description = "The world model for clients of PlanSys2"

    def __init__(self, context: Run) -> None:
        settings = ExpertSettings.parse(context.config, context.paths.confdir)
        with locate_errors(context.config, SECTION):
            if not context.spec:
                raise ConfigError("the experts need an executive", hint="name a spec, or remove ros2/experts")
            if not context.source.has_fawkes_configuration:
                raise ConfigError("the experts do not work with --ros2cx", hint="remove ros2/experts")
        planning = PlannerSettings.from_config(context.config)
        namespace = settings.node.namespace
        if context.name:  # each agent of a team has separate experts
            namespace += "/" + re.sub(r"\W", "_", context.name)
        log = context.bus.logger("Ros2Experts")
        self._node = settings.node.join(
            f"cxbridge_experts_{context.name}".rstrip("_"),
            settings.node.load_definitions(TYPE_DEFINITIONS),
            log.warn,
            context.rights,
        )
        try:
            self._server = ExpertServer(
                settings,
                namespace,
                self._node,
                shared_problem_expert_feature(context),
                PlanServer(planning, lambda: _make_planning_service(planning)),
                log,
            )
        except Exception:
            self._node.close()
            raise

    def loop(self) -> None:
        self._server.loop()

    @property
    def is_quiet(self) -> bool:
        """False, since a client may change the world model at any time."""
        return False

    def close(self) -> None:
        self._server.close()
        self._node.close()


def _make_planning_service(settings: PlannerSettings) -> PlanningService:
    from cxbridge.executive.planning import PlanningService  # noqa: PLC0415 - slow, and few clients request plans

    return PlanningService(settings.at_once, settings.memory)
