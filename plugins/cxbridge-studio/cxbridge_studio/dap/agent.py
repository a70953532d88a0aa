"""An agent of a run that is debugged, and how it stands when its rules are stopped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from clips._clips import lib

from cxbridge.clipstext.syntax import rule_lines
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.executive.host.agenda import agenda
from cxbridge.executive.host.capi import EXTRA, NULL, decode, encode
from cxbridge.executive.host.facts.copying import FactTemplate, template_of
from cxbridge.executive.service import EnvironmentService
from cxbridge.operations.operation import OperationContext
from cxbridge.operations.table import carry_out
from cxbridge.rights import EVERYTHING
from cxbridge_studio.dap.expressions import expanded
from cxbridge_studio.dap.probes import Probes
from cxbridge_studio.dap.target import FileLine, Firing, StoppedEnvironment
from cxbridge_studio.explain.rules.environment import take

if TYPE_CHECKING:
    from cxbridge.clipstext.values import Value
    from cxbridge.executive.breakpoints import Breakpoint, Stop
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.evaluating import Evaluation
    from cxbridge.run.agent import Run
    from cxbridge_studio.explain.rules.snapshot import Snapshot


class DebuggedAgent:
    """An agent of the run.

    :param actions: whether it can stop within right-hand sides.
    """

    def __init__(self, assembly: Run, *, actions: bool) -> None:
        self.assembly = assembly
        self.debugger: Debugger = assembly.executive.debugger
        self.service = EnvironmentService(assembly.manager)
        self.env: ClipsEnvironment = assembly.executive.env
        self.probes = Probes(self.env, self.debugger) if actions else None
        self.debugger.expand = self._expand
        self.ids: dict[int, int] = {}
        """The client's numbers of breakpoints, by the debugger's."""
        self._groups: dict[str, list[int]] = {}
        self.fired: RuleFired | None = None
        self.gone: dict[int, FactChange] = {}
        self._context = OperationContext(EVERYTHING, self)
        self._places: dict[str, FileLine] = {}
        self._read = 0
        assembly.bus.subscribe(self._take, RuleFired, FactChange)
        self._watches = False
        self._watch()

    def _watch(self) -> None:
        self.env.watcher.rules.set((), on=True)
        self.env.watcher.facts.set((), on=True)

    def watch_again(self) -> None:
        """Have rules and facts reported, once: the configuration of an agent may have turned that off."""
        if not self._watches:
            self._watches = True
            self._watch()

    def raise_error(self) -> None:
        """Raise what went wrong while a right-hand side was stopped, if anything did."""
        if self.probes is not None and self.probes.error is not None:
            raise self.probes.error

    def set_breakpoints(self, group: str, wanted: Mapping[int, Breakpoint]) -> None:
        """Put breakpoints in the place of those of this group."""
        for own in self._groups.pop(group, ()):
            self.debugger.remove(own)
            self.ids.pop(own)
        made = {self.debugger.add(each, checked=False).number: number for number, each in wanted.items()}
        self.ids |= made
        self._groups[group] = list(made)

    def _take(self, event: Event) -> None:
        """Remember the rule that fires, and the facts that it retracts."""
        if isinstance(event, RuleFired) and event.env == self.env.name:
            self.fired = event
            self.gone.clear()
        elif isinstance(event, FactChange) and event.env == self.env.name and not event.asserted:
            self.gone[event.index] = event

    def ask(self, name: str, **given: Any) -> Any:
        """Carry out an operation on the executive's environment."""
        return carry_out(self._context, name, env=self.env.name, **given)

    def _expand(self, text: str, stop: Stop) -> str:
        return expanded(text, LiveMoment(self, stop)) if "?" in text else text

    def place(self, rule: str) -> FileLine | None:
        """Return where a rule is written, in the last of the loaded files that define it."""
        files = self.env.loader.files
        for file in files[self._read :]:
            try:
                text = file.read_bytes().decode("utf-8", "surrogateescape")
            except OSError:
                continue
            path = file.resolve()
            self._places |= {name: FileLine(path, line) for name, line in rule_lines(text).items()}
        self._read = len(files)
        return self._places.get(rule)


class LiveMoment(StoppedEnvironment):
    """An agent whose rules are stopped."""

    def __init__(self, agent: DebuggedAgent, stop: Stop) -> None:
        fired, env = agent.fired, agent.env
        firing = None
        following = next(agenda(env), None)
        if stop.line or stop.kind in ("transition", "after") or following is None:
            firing = None if fired is None else Firing(fired.rule, fired.basis, stop.line)
        else:
            firing = Firing(following[1], following[2])
        super().__init__(agent.assembly.name, firing, stop.event)
        self._agent = agent
        self._env = env
        self._within = bool(stop.line)

    def place(self, rule: str) -> FileLine | None:
        """Return where a rule is written."""
        return self._agent.place(rule)

    def bare(self, rule: str) -> Snapshot:
        """Return a rule without facts."""
        return take(self._env, rule, most_facts=0)

    def templates(self) -> Mapping[str, int]:
        """Return how many facts there are, by their deftemplates."""
        counts: dict[str, int] = {}
        for _, name, _ in self._env.facts():
            counts[name] = counts.get(name, 0) + 1
        return counts

    def template(self, name: str) -> FactTemplate | None:
        """Return a deftemplate."""
        pointer = lib.FindDeftemplate(self._env.env, encode(name))
        return None if pointer == NULL else template_of(pointer)

    def facts(self, template: str) -> Sequence[FactChange]:
        """Return the facts of a deftemplate."""
        if not self._env.has_template(template):
            return ()
        indices = [index for index, _, _ in self._env.facts(template)]
        return [fact for fact in map(self.fact, indices) if fact is not None]

    def fact(self, index: int) -> FactChange | None:
        """Return a fact, also one that the rule has just retracted."""
        pointer = self._env.maker.find(index)
        if pointer == NULL:
            return self._agent.gone.get(index)
        template = decode(lib.DeftemplateName(lib.FactDeftemplate(pointer)))
        text = self._env.watcher.text(pointer)
        return FactChange(0, self._env.name, asserted=True, index=index, template=template, text=text)

    def agenda(self) -> Sequence[tuple[int, str, str]] | None:
        """Return what would fire, in order."""
        return [(int(salience), str(rule), str(basis)) for salience, rule, basis in self._agent.ask("agenda")]

    def locals(self) -> Mapping[str, Value] | None:
        """Return the variables of the right-hand side that it is in."""
        probes = self._agent.probes
        return None if probes is None or not self._within else probes.values()

    def is_function(self, name: str) -> bool:
        """Whether CLIPS has a function of this name."""
        found = EXTRA.FindFunction(self._env.env, encode(name))
        return bool(found != NULL) or self._env.loader.is_function(name)

    def evaluate(self, expression: str) -> Evaluation:
        """Evaluate an expression, which may change facts."""
        return self._agent.service.evaluate(self._env.name, expression)

    def modify(self, index: int, slot: str, text: str) -> int:
        """Give a slot of a fact another value."""
        return int(self._agent.ask("modify", index=index, slots={slot: text}))
