"""Performers on hubs of ROS 2 as a component: callers on a hub have our skills executed."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.skiller.board.service import LocalSkillCalls
from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.performer import HubPerformer, PerformerSettings
from cxbridge_ros2.hub.settings import TREE, performer_settings
from cxbridge_ros2.node import Node


class Ros2Performers(Component):
    """Serves the hubs that the configuration names with skills of the skill board.

    :raises CxbridgeError: when the configuration is invalid, or a domain cannot be joined.
    """

    hooks = (Hook.SKILL,)
    description = "Skills for PlanSys2 and for the executive of the thesis"

    def __init__(self, context: Run) -> None:
        self._context = context
        self._nodes: list[Node] = []
        self._performers: list[HubPerformer] = []
        agents = () if context.skill_board is None else context.skill_board.agents
        names = [agent.name for agent in agents]
        found = performer_settings(context.config, names, context.paths.confdir)
        try:
            for key, settings in found.items():
                self._serve(key, settings)
        except Exception:
            self.close()
            raise

    def _serve(self, key: str, settings: PerformerSettings) -> None:
        context = self._context
        log = context.bus.logger(f"performer {key}")
        node = settings.node.join(settings.name, settings.node.definitions(), log.warn, context.rights)
        self._nodes.append(node)
        performer = HubPerformer(settings, self._skills, node, context.clock, log)
        self._performers.append(performer)
        self._refuse_circle(key, settings, performer)

    def _refuse_circle(self, key: str, settings: PerformerSettings, performer: HubPerformer) -> None:
        """Refuse performers whose skills are executed by asking on the same hub."""
        service = self._context.skill_service
        for host in () if service is None else service.hosts:
            executor = host.executor
            if (
                isinstance(executor, HubSkills)
                and (executor.topic, executor.agent) == (performer.topic, settings.agent)
                and (both := performer.served & set(executor.skills))
            ):
                raise self._context.config.error(
                    f"{TREE}/{key}/",
                    f"the performer {key} would ask itself for {', '.join(sorted(both))}:"
                    f" {host.name} lets performers on {performer.topic} execute it",
                    f"leave it out of {TREE}/{key}/actions, or of the skills of {host.name}",
                )

    def _skills(self) -> LocalSkillCalls | None:
        """Return the skill board of now: a daemon may have made another one."""
        service = self._context.skill_service
        return None if service is None else service.local_calls

    def loop(self) -> None:
        """Receive, answer, and give signs of life."""
        for performer in self._performers:
            performer.loop()

    @property
    def running(self) -> bool:
        """Whether something is being executed."""
        return any(performer.running for performer in self._performers)

    @property
    def is_quiet(self) -> bool:
        """Whether nothing is being executed."""
        return not self.running

    def close(self) -> None:
        """Stop all executions, and leave the hubs."""
        for performer in self._performers:
            performer.close()
        for node in self._nodes:
            node.close()
        self._performers, self._nodes = [], []
