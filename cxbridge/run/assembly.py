"""The parts of a run, made and joined."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from types import TracebackType
from typing import TYPE_CHECKING, Self
from uuid import UUID, uuid4

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.events import GoalTransition
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.mainloop import Hook
from cxbridge.process.blackboard_urls import open_board
from cxbridge.run.agent_context import Seat, make_only_seat
from cxbridge.run.goal_history import GoalHistory
from cxbridge.run.options import RunOptions
from cxbridge.run.parts import (
    Component,
    SkillBoardPart,
    Surroundings,
    make_executive,
    make_planning_plugins,
    make_speech,
    skill_board_settings,
    watch_for_recording,
)
from cxbridge.run.paths import check_places, find_places
from cxbridge.run.remote_skiller import RemoteSkiller, is_url
from cxbridge.run.skillers import make_skillers, skiller_settings
from cxbridge.run.specs import check_spec, choose_spec
from cxbridge.run.think_rate import make_refresh, think

if TYPE_CHECKING:
    from cxbridge.run.replay.replay import Replay
    from cxbridge.skiller.backend import SkillerBackend


class Assembly:
    """A run: everything is there after construction, loaded after :meth:`start`. A context manager.

    :param options: what the run was told; checked.
    :param seat: what it finds, when it is not alone in its run.
    :param replay: plays the environment, in place of Skillers and of executors of this process.
    :raises CxbridgeError: when something that the options or the configuration name is missing or wrong.
    """

    def __init__(self, options: RunOptions, seat: Seat | None = None, replay: Replay | None = None) -> None:
        seat = seat or make_only_seat(options)
        self.options = options
        self._replay = replay
        self.name = seat.name
        self.config = seat.config
        self.spec = choose_spec(self.config, options.spec)
        warnings = [*map(str, self.config.warnings), *check_spec(self.config, self.spec)]
        self.places = find_places(options, self.config, seat.config_file)
        self._warnings = warnings + check_places(self.config, self.spec, self.places)
        self._skill_board = skill_board_settings(self.config, self.places)
        self.clock, self.bus, self.loop = seat.clock, seat.bus, seat.loop
        self.early = seat.early
        self.registry = InterfaceRegistry(self.places.interface_dirs)
        kind = LocalBlackBoard if replay is None else replay.board_class
        self.board = kind(self.registry, self.clock, self.bus, serials=self._serials())
        self.memory = RobotMemory(self.config, self.clock, self.bus, self.board, embedded=seat.embedded)
        self.loop.add(Hook.WORLDSTATE, self.memory.attend)
        self.around = Surroundings(
            self.config,
            self.clock,
            self.bus,
            self.board,
            self.places,
            self.memory,
            make_planning=None if replay is None else replay.make_planning,
            refresh=make_refresh(self.config, self.clock, self.places),
        )
        self.manager, self.executive = make_executive(self.around, self.spec, self.name)
        self.goal_history = GoalHistory(self.executive.goals)
        self.firings = 0
        self._components: list[Component] = []
        self._skiller: SkillerBackend | None = None
        self._remote_skiller: RemoteSkiller | None = None
        self._started = False

    def _serials(self) -> Callable[[], UUID]:
        """Return what makes instances' serials: on a virtual clock runs repeat, so these must."""
        if not self.clock.is_virtual:
            return uuid4
        numbers = count(1)
        return lambda: UUID(int=next(numbers), version=4)

    def start(self) -> None:
        """Start skiller and executive, and join them to the main loop."""
        for warning in self._warnings:
            self.bus.logger("Config").warn(warning)
        self.executive.env.watcher.start()
        self.executive.follow_transitions()
        self.bus.subscribe(self.goal_history.note, GoalTransition)
        watch_for_recording(self.executive, self.config, self.options.trace_level)
        if self._replay is not None:
            self._skiller = self._replay.install(self.around, self._skill_board, self._add)
        else:
            self._start_skiller()
            self._start_skill_board()
        for plugin in make_planning_plugins(self.around, self.spec):
            self._add(Hook.ACT_EXEC, plugin)
        self._started = True
        self.executive.init()
        if self.around.refresh is not None:
            self.around.refresh.start()
        self.loop.add(Hook.THINK, self._think)

    def _start_skiller(self) -> None:
        """Make the Skiller that the options ask for, and the speech that its skills need."""
        kind = self.options.skiller
        served = self._skill_board.skillers if self._skill_board else ()
        if kind == "none" or self.options.is_without_skiller:
            return
        if is_url(kind):
            self._remote_skiller = RemoteSkiller(kind, self.board, self.bus, self._open_board)
            self._components.append(self._remote_skiller)
            return
        settings = skiller_settings(self.config, kind, served)
        if not settings:
            return
        speaks = any(item.kind == "lua" for item in settings)
        speech = make_speech(self.around, self.options.speech) if speaks else None
        self._skiller = make_skillers(self.around, settings)
        self._add(Hook.SKILL, self._skiller)
        if speech is not None:
            self._add(Hook.ACT, speech)

    def _start_skill_board(self) -> None:
        """Make the skill board that the configuration asks for."""
        if self._skill_board is not None:
            self._add(Hook.SKILL, SkillBoardPart(self.around, self._skill_board, self.options.executors))

    def _open_board(self, url: str) -> BlackBoard:
        return open_board(url, self.registry, self.clock, self.bus)

    def _add(self, hook: Hook, component: Component) -> None:
        self._components.append(component)
        self.loop.add(hook, component.loop)

    def _think(self) -> None:
        """Let the executive think if it is time to."""
        self.firings += think(self.executive, self.around.refresh)

    @property
    def agents(self) -> tuple[Self, ...]:
        """The agents of the run: this one."""
        return (self,)

    @property
    def is_over(self) -> bool:
        """Whether every root goal is retracted or gone, no skill runs and the agenda is empty.

        Of a replay: whether the recorded run has been played.
        """
        station = self.around.skills.station
        over = (
            self.executive.is_over
            and not (self._skiller is not None and self._skiller.running)
            and not (station is not None and station.running)
        )
        if self._replay is None:
            return over
        return self._replay.is_over(self.clock.now_us(), run_is_over=over)

    @property
    def loss(self) -> str:
        """Why the run cannot come to its end: a part of it is gone; empty while all are there."""
        return "" if self._remote_skiller is None else self._remote_skiller.loss

    def interrupt(self) -> None:
        """End what the rules do now, and let none fire any more. From any thread."""
        self.executive.env.interrupt()

    def stop(self) -> None:
        """Let the executive's rules say good-bye."""
        if self._started:
            self._started = False
            self.executive.finalize()

    def close(self) -> None:
        """Stop everything and let go of it."""
        self.stop()
        for component in reversed(self._components):
            component.close()
        self._components.clear()
        self.executive.close()
        self.manager.close()
        self.memory.close()
        self.board.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
