""":class:`SkillExecutor`, the base class of executors. See docs/skill-board.md."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeAlias, TypeVar

from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.skiller.board.protocol import REQUIRED, SkillCall

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import Logger

CLASS_FORM = "write MODULE:CLASS, e.g. cxbridge.skiller.navigation:Move, or FILE.py:CLASS"
"""The notation of executor classes, for hints."""


def load_executor(target: str, folder: Path) -> type[SkillExecutor]:
    """Import an executor class.

    :param target: ``MODULE:CLASS`` or ``FILE.py:CLASS``.
    :param folder: the base of a relative file.
    :raises SkillError: if the class is missing or not an executor, or its module does not load.
    """
    module_name, name = split_target(target)
    module = _load_file(folder / module_name) if module_name.endswith(".py") else _load_module(module_name)
    executor_class = getattr(module, name, None)
    if not isinstance(executor_class, type) or not issubclass(executor_class, SkillExecutor):
        raise SkillError(f"{module_name} has no executor '{name}'", hint=CLASS_FORM)
    return check_executor(executor_class)


def split_target(target: str) -> tuple[str, str]:
    """Return the name of the module or file in a target, and the name of the class.

    :raises SkillError: if the target has another form.
    """
    module_name, _, name = target.rpartition(":")
    if not module_name or not name:
        raise SkillError(f"'{target}' is not the name of an executor class", hint=CLASS_FORM)
    return module_name, name


def check_executor(executor_class: type[SkillExecutor]) -> type[SkillExecutor]:
    """Check that a class can execute skills, before any skill is requested; return the class.

    :raises SkillError: if the class has no method ``execute``.
    """
    if executor_class.execute is SkillExecutor.execute:
        raise SkillError(
            f"{executor_class.__name__} has no execute()", hint="write: def execute(self, call): yield 0.5"
        )
    return executor_class


def _load_module(name: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise SkillError(f"there is no Python module '{name}': {error}", hint=CLASS_FORM) from None
    except (Exception, SystemExit) as error:
        raise SkillError(f"the Python module '{name}' does not load: {error_text(error)}") from error


def _load_file(file: Path) -> Any:
    name = f"cxbridge_executors_{file.resolve().as_posix().replace('/', '_')}"
    # several executors of one file share its module, and its state
    if name in sys.modules:
        return sys.modules[name]
    if not file.is_file():
        raise SkillError("there is no such file", file=file)
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    # before the execution of the module: dataclasses and pickle look for the module of a class there
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # e.g. sys.exit() in a script must not end the run
        del sys.modules[name]
        line = error.lineno if isinstance(error, SyntaxError) else _find_line(error, file)
        raise SkillError(f"the file does not load: {error_text(error)}", file=file, line=line) from error
    return module


def _find_line(error: BaseException, file: Path) -> int | None:
    line, trace = None, error.__traceback__
    # the last line of the file itself: the error may come from a library that the file calls
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(file):
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def error_text(error: BaseException) -> str:
    """Return the text of an error, with its type unless it is a `CxbridgeError` or a syntax error."""
    if isinstance(error, CxbridgeError):
        return error.message
    return error.msg if isinstance(error, SyntaxError) else f"{type(error).__name__}: {error}"


SettingT = TypeVar("SettingT")


class SkillFailedError(SkillError):
    """Fails the skill that raises the error. The message becomes the action's error.

    :param progress: the final progress from 0 to 1; None: the last reported progress.
    """

    def __init__(self, message: str, *, progress: float | None = None) -> None:
        super().__init__(message)
        self.progress = progress


class Progress(NamedTuple):
    """The progress of a skill.

    :param fraction: the finished part, from 0 to 1.
    :param text: the current activity.
    """

    fraction: float
    text: str = ""


Steps: TypeAlias = Generator["float | Progress | None", None, Any]
"""The steps of a skill, one per loop. Each yields the progress; None for unchanged progress.

The generator may return a final message, a :class:`Progress`.
"""


@dataclass(frozen=True, slots=True)
class ExecutorContext:
    """The environment of an executor.

    :param settings: the settings from the configuration or ``--set``.
    :param folder: the base of relative files in the settings.
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

    :raises ConfigError: if the context has an unknown setting.
    """

    skills: tuple[str, ...] = ()
    """The names of the skills that the executor executes."""

    known_settings: ClassVar[tuple[str, ...]] = ()
    """The names of the accepted settings."""

    def __init__(self, context: ExecutorContext) -> None:
        self.agent = context.agent
        self.board = context.board
        self.clock = context.clock
        self.log = context.log
        self.settings = context.settings
        self.folder = context.folder
        for name in self.settings:
            if name not in self.known_settings:
                settings_text = ", ".join(self.known_settings) or "none"
                raise ConfigError(
                    f"{type(self).__name__} has no setting '{name}'",
                    hint=f"the settings are: {settings_text}",
                )

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:  # noqa: ARG003 - for subclasses whose skills depend on settings
        """Return the skills of an executor with these settings."""
        return cls.skills

    @classmethod
    def mistakes(cls, settings: Mapping[str, Any], folder: Path) -> Iterable[CxbridgeError]:  # noqa: ARG003 - for subclasses
        """Return mistakes in the settings without making an executor.

        :param folder: the base of relative files in the settings.
        """
        return ()

    def setting(self, name: str, default: SettingT = REQUIRED) -> SettingT:
        """Return a setting, which must have the default's type. Without a default, the setting is required.

        :raises ConfigError: if the setting is missing or has the wrong type.
        """
        value: SettingT = self.settings.get(name, default)
        if value is REQUIRED:
            raise ConfigError(f"{type(self).__name__} needs the setting '{name}'")
        # YAML has 1 for 1.0
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            return type(default)(value)
        if default is not REQUIRED and not isinstance(value, type(default)):
            type_name = type(default).__name__
            raise ConfigError(f"{type(self).__name__} needs a {type_name} as '{name}', not {value!r}")
        return value

    def start(self) -> None:
        """Prepare, before the executor appears on the blackboard."""

    def execute(self, call: SkillCall) -> Steps:
        """Execute a skill in steps.

        A step must not block. Returning is success, an exception is failure. Cancelling closes the generator.
        """
        raise NotImplementedError

    def idle(self) -> None:
        """Do the work of a loop without a running skill."""

    def close(self) -> None:
        """Release all resources."""


Execution: TypeAlias = Callable[[SkillExecutor, SkillCall], Steps]
"""A function that executes a call: the executor's own method, or its replacement in tests and simulations."""


def execute_itself(executor: SkillExecutor, call: SkillCall) -> Steps:
    """Execute a call with the executor's own method."""
    return executor.execute(call)
