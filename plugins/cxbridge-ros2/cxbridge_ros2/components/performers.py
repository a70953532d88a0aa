"""The component of performers, which execute skills on request of PlanSys2 and of ros2-clips-executive.

Callers and performers talk on a topic, the hub; see :mod:`cxbridge_ros2.hub`.
"""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.skiller.board.service import LocalSkillCalls
from cxbridge_ros2.hub.performer import HubPerformer, PerformerSettings
from cxbridge_ros2.hub.settings import read_performer_settings


class Ros2Performers(Component):
    """Serves the configured hubs with skills of the skill board."""

    hooks = (Hook.SKILL,)
    description = "Skills for PlanSys2 and for ros2-clips-executive"

    def __init__(self, context: Run) -> None:
        self._context = context
        self._performers: list[HubPerformer] = []
        agents = () if context.skill_board is None else context.skill_board.agents
        agent_names = [agent.name for agent in agents]
        performers = read_performer_settings(context.config, agent_names, context.paths.confdir)
        try:
            for key, settings in performers.items():
                self._add_performer(key, settings)
        except Exception:
            self.close()  # the nodes of the other performers leave the domain
            raise

    def _add_performer(self, key: str, settings: PerformerSettings) -> None:
        context = self._context
        log = context.bus.logger(f"performer {key}")
        performer = HubPerformer(settings, self._find_skill_calls, context.rights, context.clock, log)
        self._performers.append(performer)

    def _find_skill_calls(self) -> LocalSkillCalls | None:
        """Return the calls to the skill board; None without a skill board.

        The result must not be stored, since a reset of the daemon makes a new board.
        """
        service = self._context.skill_service
        return None if service is None else service.local_calls

    def loop(self) -> None:
        """Handle messages on the hubs, and publish heartbeats."""
        for performer in self._performers:
            performer.loop()

    @property
    def running(self) -> bool:
        return any(performer.has_running_skills for performer in self._performers)

    @property
    def is_quiet(self) -> bool:
        return not self.running

    def close(self) -> None:
        for performer in self._performers:
            performer.close()
