"""The base class of executors of skills, :class:`SkillExecutor`. See docs/skill-board.md."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple, TypeAlias, TypeVar

from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.skiller.board.protocol import SkillCall

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import Logger

T = TypeVar("T")
_NEEDED: Final[Any] = object()


class SkillFailedError(SkillError):
    """Raise it in a skill that cannot be carried out; the message is the action's error.

    :param progress: how far it came, from 0 to 1; None: as far as it has reported.
    """

    def __init__(self, message: str, *, progress: float | None = None) -> None:
        super().__init__(message)
        self.progress = progress


class Progress(NamedTuple):
    """How far a skill is.

    :param fraction: from 0 to 1.
    :param text: the current work.
    """

    fraction: float
    text: str = ""


Steps: TypeAlias = Generator["float | Progress | None", None, Any]
"""The steps of a skill, one a loop; each yields how far it is, or None when there is nothing new.

It may return its last word, a :class:`Progress`; most return nothing, and need no ``return`` for that.
"""


@dataclass(frozen=True, slots=True)
class ExecutorContext:
    """What an executor works with.

    :param settings: what its configuration says, or ``--set``.
    :param folder: what relative files in the settings are seen from.
    """

    agent: str
    board: BlackBoard
    clock: Clock
    log: Logger
    settings: Mapping[str, Any] = field(default_factory=dict)
    folder: Path = field(default_factory=Path)


class SkillExecutor:
    """Executes skills for one agent, one at a time.

    For example::

        class Wave(SkillExecutor):
            skills = ("wave",)

            def execute(self, call: SkillCall) -> Steps:
                for done in range(3):
                    yield done / 3

    :param context: its environment.
    """

    skills: tuple[str, ...] = ()
    """The names of the skills that it executes."""

    known_settings: ClassVar[tuple[str, ...]] = ()
    """The names of the settings that it takes."""

    def __init__(self, context: ExecutorContext) -> None:
        self.agent = context.agent
        self.board = context.board
        self.clock = context.clock
        self.log = context.log
        self.settings = context.settings
        self.folder = context.folder
        for name in self.settings:
            if name not in self.known_settings:
                known = ", ".join(self.known_settings) or "none"
                raise ConfigError(f"{type(self).__name__} has no setting '{name}'", hint=f"it has: {known}")

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:  # noqa: ARG003  some depend on them
        """Return the names of the skills that an executor with these settings executes."""
        return cls.skills

    @classmethod
    def mistakes(cls, settings: Mapping[str, Any], folder: Path) -> Iterable[CxbridgeError]:  # noqa: ARG003
        """Return the mistakes in settings, as far as they can be found without making an executor.

        :param folder: what relative files in the settings are seen from.
        """
        return ()

    def setting(self, name: str, default: T = _NEEDED) -> T:
        """Return a setting, of the type of the default if there is one.

        :raises ConfigError: when it is missing, or of another type.
        """
        value: T = self.settings.get(name, default)
        if value is _NEEDED:
            raise ConfigError(f"{type(self).__name__} needs the setting '{name}'")
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            return type(default)(value)
        if default is not _NEEDED and not isinstance(value, type(default)):
            kind = type(default).__name__
            raise ConfigError(f"{type(self).__name__} needs a {kind} as '{name}', not {value!r}")
        return value

    def start(self) -> None:
        """Get ready, before the executor is seen on the blackboard."""

    def execute(self, call: SkillCall) -> Steps:
        """Execute a skill, step by step.

        A step must not block. The end is success, any exception is failure; when the skill is cancelled the
        generator is closed.
        """
        raise NotImplementedError

    def idle(self) -> None:
        """Do the idle work of a loop."""

    def close(self) -> None:
        """Let go of everything; no skill is executed any more."""


Execution: TypeAlias = Callable[[SkillExecutor, SkillCall], Steps]
"""How calls are executed: by their executor, or as a test or a simulation says."""


def as_executor(executor: SkillExecutor, call: SkillCall) -> Steps:
    """Return the steps of the executor."""
    return executor.execute(call)
