"""The component that serves an agent's world model to clients of PlanSys2.

PlanSys2 has a domain expert and a problem expert, nodes with a PDDL domain and a PDDL problem, and a planner.
Clients of these nodes see and edit the world model of the agent.
"""

from __future__ import annotations

import re
from typing import Any

from cxbridge.errors import ConfigError
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.run.features import FEATURES
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.experts.plan_server import PlanServer
from cxbridge_ros2.experts.server import SECTION, ExpertServer, read_expert_settings
from cxbridge_ros2.problem_expert import shared_problem_expert_feature
from cxbridge_ros2.settings import locate_errors


class Ros2Experts(Component):
    """Serves the domain, the problem and the planner of an agent."""

    hooks = (Hook.THINK,)
    steady = True  # clients are served while a daemon is paused
    description = "The world model for clients of PlanSys2"

    def __init__(self, context: Run) -> None:
        settings, served_nodes = read_expert_settings(context.config, context.paths.confdir)
        with locate_errors(context.config, SECTION):
            if not context.spec:
                raise ConfigError("the experts need an executive", hint="name a spec, or remove ros2/experts")
            if not context.source.has_fawkes_configuration:
                raise ConfigError("the experts do not work with --ros2cx", hint="remove ros2/experts")
        namespace = settings.namespace
        if context.name:  # each agent of a team has separate experts
            namespace += "/" + re.sub(r"\W", "_", context.name)  # ROS has names of letters, digits and _
        log = context.bus.logger("Ros2Experts")
        self._node = settings.join(
            f"cxbridge_experts_{context.name}".rstrip("_"),
            settings.load_definitions(TYPE_DEFINITIONS),
            log.warn,
            context.rights,
        )
        self._server = ExpertServer(
            served_nodes,
            settings.distribution,
            namespace,
            self._node,
            shared_problem_expert_feature(context),
            PlanServer(lambda: _make_planner(context)),
            log,
        )

    def loop(self) -> None:
        self._server.loop()

    @property
    def is_quiet(self) -> bool:
        """False, since a client may change the world model at any time."""
        return False

    def close(self) -> None:
        self._server.close()
        self._node.close()


def _make_planner(context: Run) -> Any:
    """Return the feature with the planners.

    :raises PluginError: if the package of the feature is not installed.
    """
    return FEATURES.load_target(FEATURES.find("planner"))(context)
