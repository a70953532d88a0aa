"""A bench for the built-in core: its files in an environment; the test plays the rest of the world."""

from __future__ import annotations

from typing import ClassVar

from cxbridge.clock import MICROSECONDS, VIRTUAL_EPOCH_US, Clock
from cxbridge.events import Event, EventBus, LogLine
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.values import TRUE, Symbol, Value

GOAL_TYPES = ("run-one", "run-all", "try-all", "run-parallel", "retry", "timeout", "automatic")
GOAL_FILES = (
    "plan.clp",
    "goal.clp",
    "goal-tree.clp",
    *(f"goals/{name}.clp" for name in GOAL_TYPES),
)
"""Files for goals, without domain and world model."""


class StoppedClock(Clock):
    """A clock that only the test moves."""

    name = "virtual"

    def __init__(self) -> None:
        self.time_us = VIRTUAL_EPOCH_US

    def now_us(self) -> int:
        """Return the time that the test has set."""
        return self.time_us

    def sleep_until(self, time_us: int, wake: object = None) -> None:
        """Jump to the time."""
        self.time_us = max(self.time_us, time_us)


class Bench:
    """An environment with files of the core.

    ``conftest.py`` closes the benches of a test, for each takes 2 MB.

    :param files: names below ``clips/cx``, executed in this order.
    """

    made: ClassVar[list[Bench]] = []
    """The benches of the running test."""

    def __init__(self, *files: str) -> None:
        self.clock = StoppedClock()
        bus = EventBus(self.clock)
        self.lines: list[LogLine] = []
        bus.subscribe(self._keep, LogLine)
        self.env = ClipsEnvironment("executive", bus)
        self.made.append(self)
        for name in ("utils", "time", "path", "ff-config", "blackboard"):
            self.load(f"host/{name}.clp")
        for name in ("saliences.clp", *files):
            self.load(f"cx/{name}")

    def close(self) -> None:
        """Free the environment. Once more does no harm."""
        self.env.destroy()

    def _keep(self, event: Event) -> None:
        assert isinstance(event, LogLine)
        self.lines.append(event)

    def load(self, name: str) -> None:
        """Execute a file below ``clips``; it must be free of mistakes."""
        assert self.env.batch(CORE_DIR / name), name
        assert not self.env.loader.diagnostics

    def config(self, path: str, value: Value) -> None:
        """Assert a ``confval`` with the type of the value."""
        kind = {int: "UINT", float: "FLOAT", str: "STRING", Symbol: "BOOL", tuple: "STRING"}[type(value)]
        slots: dict[str, Value] = {"path": path, "type": Symbol(kind)}
        if isinstance(value, tuple):
            slots |= {"is-list": TRUE, "list-value": value}
        else:
            slots["value"] = value
        self.env.assert_fact("confval", slots)

    def retract_automatically(self) -> None:
        """Switch on the clean-up of goals."""
        self.config("/clips-executive/automatic-goal-retraction", TRUE)

    def tick(self, seconds: float = 0.0) -> int:
        """Let time pass, assert the time, and run; return the number of firings."""
        self.clock.time_us += round(seconds * MICROSECONDS)
        sec, usec = divmod(self.clock.time_us, MICROSECONDS)
        self.env.assert_string(f"(time {sec} {usec})")
        self.env.refresh_agenda()
        return self.env.run()

    def one(self, template: str, **slots: str) -> dict[str, Value]:
        """Return the slots of the only fact of the template with these values (dashes as underscores)."""
        found = self.all(template, **slots)
        assert len(found) == 1, f"{len(found)} facts {template} with {slots}"
        return found[0]

    def all(self, template: str, **slots: str) -> list[dict[str, Value]]:
        """Return the slots of all facts of the template with these values."""
        wanted = {name.replace("_", "-"): value for name, value in slots.items()}
        return [
            fact
            for _, _, fact in self.env.facts(template)
            if all(str(fact[name]) == value for name, value in wanted.items())
        ]

    def modify(self, template: str, change: str, **slots: str) -> None:
        """Change slots of matching facts as a rule of the core would: ``change`` is CLIPS text."""
        test = " ".join(f'(eq (str-cat ?f:{n.replace("_", "-")}) "{v}")' for n, v in slots.items())
        self.env.eval(f"(do-for-all-facts ((?f {template})) (and TRUE {test}) (modify ?f {change}))")

    def goal(self, goal_id: str) -> dict[str, Value]:
        """Return the slots of a goal."""
        return self.one("goal", id=goal_id)

    def state(self, goal_id: str) -> tuple[str, str]:
        """Return mode and outcome of a goal."""
        goal = self.goal(goal_id)
        return str(goal["mode"]), str(goal["outcome"])

    def texts(self, level: str | None = None) -> list[str]:
        """Return the lines printed so far; of a level (``I``, ``W`` ...) if given."""
        return [line.text for line in self.lines if level is None or line.level.value == level]
