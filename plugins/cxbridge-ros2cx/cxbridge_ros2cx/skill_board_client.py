"""The client of the skill board for the thesis' executive: an action without an executor gets a dummy.

The thesis' executive is ros2-clips-executive (2021). A dummy pretends to execute the action, as an example
node of that executive does. The mode ``original`` of :mod:`.settings` repeats the executive's defects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.skiller.board.executor import ExecutorContext, SkillExecutor, load_executor
from cxbridge.skiller.board.host import make_host
from cxbridge_ros2cx.executors import DummyExecutor, ThesisDummyExecutor
from cxbridge_ros2cx.thesis_board import NO_AGENT, ThesisMaster

if TYPE_CHECKING:
    from cxbridge.executive.features.skill_board import SkillAction
    from cxbridge.run.agent import Run
    from cxbridge.skiller.board.master import Master
    from cxbridge.skiller.board.service import SkillBoardService
    from cxbridge.skiller.board.settings import BoardSettings
    from cxbridge.skiller.board.watch import ExecutorInfo
    from cxbridge_ros2cx.settings import Ros2CxSettings


class SkillBoardClient:
    """Requests executors for skills, and creates dummies.

    No dummy replaces a vanished executor. An unconfigured agent without executors gets no dummy either if
    other agents are configured or have executors. In both cases a dummy would hide an error, which the
    timeout of the request reports.

    :param service: the skill board, which also runs the executors of this process.
    :param run: the run, for new executors.
    :param board_settings: the configured agents, and whether this process may have executors.
    :param settings: the settings of the thesis' executive.
    """

    def __init__(
        self,
        service: SkillBoardService,
        run: Run,
        board_settings: BoardSettings,
        settings: Ros2CxSettings,
    ) -> None:
        self._service, self._run = service, run
        self._agents = {agent.name for agent in board_settings.agents}
        self._allows_dummies = board_settings.in_process
        self._repeats_defects = settings.repeats_defects
        self._unsensed_executors = set(settings.unsensed_executors)  # dummies are added
        self._dummy_skills: set[tuple[str, str]] = set()  # agent and skill of each dummy

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        return self._service.local_calls.executors

    def request(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[Master], None],
        skill_id: str = "",
    ) -> Master:
        """Request the execution of a skill, by a dummy if necessary; return the master of the skill.

        :param on_change: called after each change of the master.
        :param skill_id: the id of the call in the facts of the agent, and the display name of the master.
        :raises SkillError: if names or parameters do not fit into messages.
        """
        self._service.settle()  # register executors that appeared since the last loop
        has_executor = any(
            executor.agent == agent and skill in executor.skills for executor in self.executors
        )
        if not has_executor and self._may_get_dummy(agent, skill):
            dummy_name = f"{agent}-{skill}-dummy"
            self._run.bus.logger(dummy_name).warn(
                f"No executor of {agent} has the skill {skill}: a dummy pretends to execute it"
            )
            dummy_class = ThesisDummyExecutor if self._repeats_defects else DummyExecutor
            self._start_executor(make_skill_class(dummy_class, skill), agent, dummy_name)
            self._unsensed_executors.add(dummy_name)
            self._dummy_skills.add((agent, skill))
            self._service.settle()
        return self._service.local_calls.request(skill, parameters, agent, on_change, skill_id)

    def _may_get_dummy(self, agent: str, skill: str) -> bool:
        # the board remembers the skills of vanished executors, too
        offered_skills = self._service.skill_board.offered_skills
        if not self._allows_dummies or (agent, skill) in offered_skills:
            return False
        if agent == NO_AGENT or agent in self._agents:
            return True
        # An agent with an executor gets dummies for its remaining skills. If no agent is configured or has an
        # executor, each agent gets dummies.
        served_agents = {name for name, _ in offered_skills - self._dummy_skills}
        return agent in served_agents if served_agents or self._agents else True

    def apply_timeout(self, action: SkillAction) -> None:
        """Fail an action without a response after the timeout of the thesis' executive.

        Only the mode ``original`` needs this call; otherwise the board times out actions itself.
        """
        if isinstance(action, ThesisMaster):
            action.apply_timeout(self._run.clock.now_us())

    def cancel(self, number: int) -> bool:
        """Cancel an action; return whether the action was still running.

        An executor of this process ends the action at once, and is ready for the next action.
        """
        self._service.settle()
        was_cancelled = self._service.local_calls.cancel(number)
        self._service.settle()
        return was_cancelled

    def lacks_sensors(self, executor: str) -> bool:
        """Return whether the effects of an executor have no sensor; always False in the mode ``original``."""
        return not self._repeats_defects and executor in self._unsensed_executors

    def add_executor(self, executor_option: str) -> None:
        """Create an executor for the agent without a name.

        :param executor_option: ``ACTION=MODULE:CLASS`` or ``ACTION=FILE.py:CLASS``, relative to the current
            folder.
        :raises SkillError: if the option does not have this form or the class is missing.
        """
        action, separator, class_location = executor_option.partition("=")
        if not action or not separator:
            raise SkillError(f"--executor cannot be '{executor_option}'", hint="write ACTION=FILE.py:CLASS")
        executor_class = load_executor(class_location, Path.cwd())
        self._service.settle()  # register executors that appeared since the last loop
        previous_count = sum(
            executor.agent == NO_AGENT and action in executor.skills for executor in self.executors
        )
        name = f"{action}-{executor_class.__name__}-{previous_count + 1}"
        self._start_executor(make_skill_class(executor_class, action), NO_AGENT, name)

    def _start_executor(self, executor_class: type[SkillExecutor], agent: str, name: str) -> None:
        run = self._run
        context = ExecutorContext(agent, run.board, run.clock, run.bus.logger(name))
        self._service.add(
            make_host(executor_class, context, name, verbatim=self._service.skill_board.is_verbatim)
        )


def make_skill_class(executor_class: type[SkillExecutor], skill: str) -> type[SkillExecutor]:
    """Return a subclass of an executor class for a single skill."""
    return type(executor_class.__name__, (executor_class,), {"skills": (skill,)})
