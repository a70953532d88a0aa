"""A skill board with an executor for each action: a dummy if no other executor exists."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.skiller.board.executor import ExecutorContext, SkillExecutor, load_executor
from cxbridge.skiller.board.host import make_host
from cxbridge_ros2cx.executors import DummyExecutor, OriginalDummy
from cxbridge_ros2cx.original_board import NO_AGENT, OriginalMaster

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus
    from cxbridge.executive.features.skill_board import SkillAction
    from cxbridge.skiller.board.master import Master
    from cxbridge.skiller.board.service import SkillBoardService
    from cxbridge.skiller.board.settings import BoardSettings
    from cxbridge.skiller.board.watch import ExecutorInfo


class Ros2CxSkills:
    """The skill board of a service; an action without an executor gets a dummy.

    A vanished executor gets no dummy, nor does an agent without executors while further agents have some:
    these are errors.

    :param service: the skill board, which also runs the executors of this process.
    :param settings: the configured agents, and whether executors are created here.
    :param original: whether the original's defects are repeated.
    :param unsensed: executors other than dummies whose effects have no sensor.
    """

    def __init__(
        self,
        service: SkillBoardService,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        settings: BoardSettings,
        *,
        original: bool = False,
        unsensed: Iterable[str] = (),
    ) -> None:
        self._service = service
        self._original = original
        self._agents = {agent.name for agent in settings.agents}
        self._allows_dummies = settings.in_process
        self._dummies: set[str] = set(unsensed)
        self._pretended: set[tuple[str, str]] = set()
        self._board, self._clock, self._bus = board, clock, bus

    @property
    def version(self) -> int:
        return self._service.local_calls.version

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        return self._service.local_calls.executors

    def ask(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[Master], None],
        name: str = "",
    ) -> Master:
        """Request the execution of a skill, by a dummy if necessary.

        :param name: the id of the skill.
        :raises SkillError: if names or parameters do not fit into messages.
        """
        self._service.settle()  # register executors that appeared since the last loop
        has_executor = any(info.agent == agent and skill in info.skills for info in self.executors)
        if not has_executor and self._may_get_dummy(agent, skill):
            dummy = f"{agent}-{skill}-dummy"
            self._bus.logger(dummy).warn(
                f"No executor of {agent} knows {skill}: a dummy pretends to execute it"
            )
            self._add(for_skill(OriginalDummy if self._original else DummyExecutor, skill), agent, dummy)
            self._dummies.add(dummy)
            self._pretended.add((agent, skill))
            self._service.settle()
        return self._service.local_calls.ask(skill, parameters, agent, on_change, name)

    def _may_get_dummy(self, agent: str, skill: str) -> bool:
        offered = self._service.skills.offered
        if not self._allows_dummies or (agent, skill) in offered:
            return False
        if agent == NO_AGENT or agent in self._agents:
            return True
        # An agent with an executor gets dummies for its other skills. Without any executor or configured
        # agent, each agent gets dummies.
        served = {name for name, _ in offered - self._pretended}
        return agent in served if served or self._agents else True

    def ask_for(self, skill_string: str, agent: str, on_change: Callable[[Master], None]) -> Master:
        return self._service.local_calls.ask_for(skill_string, agent, on_change)

    def check_timeout(self, action: SkillAction) -> None:
        """Fail an action without a response after the original's timeout, if its defects are repeated."""
        if isinstance(action, OriginalMaster):
            action.check_timeout(self._clock.now_us())

    def stop(self, number: int) -> bool:
        """Cancel an action; return whether there was something to cancel.

        Executors of this process end the action at once and are free again.
        """
        self._service.settle()
        stopped = self._service.local_calls.stop(number)
        self._service.settle()
        return stopped

    def pretends(self, executor: str) -> bool:
        """Return whether the effects of an executor have no sensor, as with a dummy."""
        return not self._original and executor in self._dummies

    def add_executor(self, text: str) -> None:
        """Create an executor for the agent without a name.

        :param text: ``ACTION=MODULE:CLASS`` or ``ACTION=FILE.py:CLASS``, relative to the current folder.
        :raises SkillError: if the text does not have this form or the class is missing.
        """
        action, equals, target = text.partition("=")
        if not action or not equals:
            raise SkillError(f"--executor cannot be '{text}'", hint="write ACTION=FILE.py:CLASS")
        kind = load_executor(target, Path.cwd())
        self._service.settle()  # register executors that appeared since the last loop
        number = sum(info.agent == NO_AGENT and action in info.skills for info in self.executors)
        self._add(for_skill(kind, action), NO_AGENT, f"{action}-{kind.__name__}-{number + 1}")

    def _add(self, kind: type[SkillExecutor], agent: str, name: str) -> None:
        context = ExecutorContext(agent, self._board, self._clock, self._bus.logger(name))
        self._service.add(make_host(kind, context, name, verbatim=self._service.skills.is_verbatim))


def for_skill(kind: type[SkillExecutor], skill: str) -> type[SkillExecutor]:
    """Return a subclass of an executor class for a single skill."""
    return type(kind.__name__, (kind,), {"skills": (skill,)})
