"""The components of a run, made and joined."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Self

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.closing import Closing
from cxbridge.mainloop import Hook
from cxbridge.run.agent_context import AgentContext, make_only_agent_context
from cxbridge.run.components.component import Component
from cxbridge.run.components.executive import ExecutiveComponent
from cxbridge.run.components.table import COMPONENTS, EXECUTIVE, needed_components
from cxbridge.run.context import RunContext
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NOTHING, Additions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cxbridge.run.replay.replay import Replay

MakeComponent = Callable[[RunContext], Component]
"""Makes a component of a run."""


class Assembly(Closing):
    """A run: everything is there after construction, loaded after :meth:`start`. A context manager.

    :param options: those of the run; checked.
    :param agent_context: the clock, bus, loop and configuration, when it is not alone in its run.
    :param replay: plays the environment, in place of Skillers and of executors of this process.
    :param additions: what a program adds to the run.
    :param components: each makes a component that no configuration names; they begin before the others.
    :raises CxbridgeError: when something that the options or the configuration name is missing or wrong.
    """

    def __init__(
        self,
        options: RunOptions,
        agent_context: AgentContext | None = None,
        replay: Replay | None = None,
        additions: Additions = NOTHING,
        components: Sequence[MakeComponent] = (),
    ) -> None:
        self.options = options
        self._replay = replay
        self._more = components
        self.context = context = RunContext.make(
            agent_context or make_only_agent_context(options),
            options,
            board_class=LocalBlackBoard if replay is None else replay.board_class,
            make_planning=additions.planning if replay is None else replay.make_planning,
            additions=additions,
        )
        self.name, self.spec, self.config, self.paths = (
            context.name,
            context.spec,
            context.config,
            context.paths,
        )
        self.clock, self.bus, self.loop, self.early = context.clock, context.bus, context.loop, context.early
        self.registry, self.board, self.memory = context.registry, context.board, context.memory
        self._thinking = ExecutiveComponent(context)
        self.manager, self.executive = self._thinking.manager, self._thinking.executive
        self._components: list[Component] = [self._thinking]

    @property
    def firings(self) -> int:
        """How many rules have fired."""
        return self._thinking.firings

    def start(self) -> None:
        """Start the components, and join them to the main loop."""
        for warning in self.context.warnings:
            self.bus.logger("Config").warn(warning)
        if not self.executive.env.loader.quiet:
            for missing in self.context.missing:
                self.bus.logger("Config").warn(f"{missing.location}: {missing.message}")
        self._thinking.watch()
        if self._replay is not None:
            for component in self._replay.components(self.context):
                self._start(component)
        for make in self._more:
            self._start(make(self.context))
        for row in needed_components(self.context, replayed=self._replay is not None):
            if row.name != EXECUTIVE:
                self._start(COMPONENTS.load(row)(self.context))
        self._thinking.configure()
        self._join(self._thinking)

    def _start(self, component: Component) -> None:
        self._components.append(component)
        component.configure()
        component.activate()
        self._join(component)

    def _join(self, component: Component) -> None:
        for hook in component.hooks:
            self.loop.add(hook, component.loop)

    def attend(self) -> None:
        """Let the steady components work while the main loop rests."""
        for component in self._components:
            if component.steady:
                component.loop()

    @property
    def agents(self) -> tuple[Self, ...]:
        """The agents of the run: this one."""
        return (self,)

    @property
    def is_over(self) -> bool:
        """Whether every root goal is retracted or gone or maintains, no skill runs and the agenda is empty.

        Of a replay: whether the recorded run has been played.
        """
        over = self.executive.is_over and not any(component.running for component in self._components)
        if self._replay is None:
            return over
        return self._replay.is_over(self.clock.now_us(), run_is_over=over)

    @property
    def is_quiet(self) -> bool:
        """Whether nothing happens by itself, but by rules: no component works, nothing comes from outside."""
        return (
            self._replay is None
            and not self.memory.is_open
            and all(component.is_quiet for component in self._components)
        )

    @property
    def loss(self) -> str:
        """Why the run cannot come to its end: a component of it is gone; empty while all are there."""
        return next((component.loss for component in self._components if component.loss), "")

    def interrupt(self) -> None:
        """End what the rules do now, and let none fire any more. From any thread."""
        self.executive.env.interrupt()

    def stop(self) -> None:
        """Let the executive's rules run their finalization."""
        self._thinking.finalize()

    def kill(self) -> None:
        """Do nothing any more, as a process that was killed: no rule fires for the shutdown.

        What it has is kept until :meth:`close`.
        """
        self._thinking.forgo_finalization()
        self.leave_loop()

    def leave_loop(self) -> None:
        """Take no steps in the main loop until :meth:`enter_loop`."""
        for component in self._components:
            for hook in component.hooks:
                self.loop.remove(hook, component.loop)
        self.loop.remove(Hook.WORLDSTATE, self.memory.attend)

    def enter_loop(self) -> None:
        """Take steps in the main loop again, after those of all others."""
        self.loop.add(Hook.WORLDSTATE, self.memory.attend)
        for component in self._components:
            self._join(component)

    def close(self) -> None:
        """Stop everything and release it."""
        self.stop()
        for component in reversed(self._components):
            component.close()
        self._components.clear()
        self.context.close()
