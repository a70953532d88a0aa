"""The component of performers on hubs of ROS 2: callers on a hub let this run execute skills."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.skiller.board.service import LocalSkillCalls
from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.performer import HubPerformer, PerformerSettings
from cxbridge_ros2.hub.settings import SECTION, performer_settings
from cxbridge_ros2.node import Node


class Ros2Performers(Component):
    """Serves the configured hubs with skills of the skill board."""

    hooks = (Hook.SKILL,)
    description = "Skills for PlanSys2 and for the executive of the thesis"

    def __init__(self, context: Run) -> None:
        self._context = context
        self._nodes: list[Node] = []
        self._performers: list[HubPerformer] = []
        agents = () if context.skill_board is None else context.skill_board.agents
        names = [agent.name for agent in agents]
        performers = performer_settings(context.config, names, context.paths.confdir)
        try:
            for key, settings in performers.items():
                self._serve(key, settings)
        except Exception:  # otherwise the nodes that have joined would stay in the domain
            self.close()
            raise

    def _serve(self, key: str, settings: PerformerSettings) -> None:
        context = self._context
        log = context.bus.logger(f"performer {key}")
        node = settings.node.join(settings.name, settings.node.load_definitions(), log.warn, context.rights)
        self._nodes.append(node)
        performer = HubPerformer(settings, self._skills, node, context.clock, log)
        self._performers.append(performer)
        self._reject_circle(key, settings, performer)

    def _reject_circle(self, key: str, settings: PerformerSettings, performer: HubPerformer) -> None:
        """Reject performers whose skills are executed by a call on the same hub, which would never end."""
        service = self._context.skill_service
        for host in () if service is None else service.hosts:
            executor = host.executor
            if (
                isinstance(executor, HubSkills)
                and (executor.topic, executor.agent) == (performer.topic, settings.agent)
                and (circular := performer.served & set(executor.skills))
            ):
                raise self._context.config.error(
                    f"{SECTION}/{key}/",
                    f"the performer {key} would ask itself for {', '.join(sorted(circular))}:"
                    f" {host.name} lets performers on {performer.topic} execute it",
                    f"leave it out of {SECTION}/{key}/actions, or of the skills of {host.name}",
                )

    def _skills(self) -> LocalSkillCalls | None:
        """Return the current skill board: a reset of the daemon makes a new board."""
        service = self._context.skill_service
        return None if service is None else service.local_calls

    def loop(self) -> None:
        """Receive and answer messages, and publish heartbeats."""
        for performer in self._performers:
            performer.loop()

    @property
    def running(self) -> bool:
        return any(performer.running for performer in self._performers)

    @property
    def is_quiet(self) -> bool:
        return not self.running

    def close(self) -> None:
        # the performers first: they report the end of their skills
        for performer in self._performers:
            performer.close()
        for node in self._nodes:
            node.close()
