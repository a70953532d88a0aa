"""Imports the class of an executor from a module or a file."""

from __future__ import annotations

import importlib.util
import inspect
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from cxbridge.errors import SkillError
from cxbridge.skiller.board.executor import SkillExecutor

CLASS_FORM = "write MODULE:CLASS, e.g. cxbridge.skiller.navigation:Move, or FILE.py:CLASS"
"""How a class of an executor is named, for hints."""


def load_executor(target: str, folder: Path) -> type[SkillExecutor]:
    """Import the class of an executor.

    :param target: ``MODULE:CLASS`` or ``FILE.py:CLASS``.
    :param folder: the base of a relative file.
    :raises SkillError: when there is no such class, or it is none of an executor; with file and line.
    """
    place, colon, name = target.rpartition(":")
    if not colon or not place or not name:
        raise SkillError(f"'{target}' names no class of an executor", hint=CLASS_FORM)
    module = _load_file(folder / place) if place.endswith(".py") else _load_module(place)
    kind = getattr(module, name, None)
    if not isinstance(kind, type) or not issubclass(kind, SkillExecutor):
        found = [key for key, value in vars(module).items() if _is_executor(value)]
        raise SkillError(
            f"{place} has no executor '{name}'", hint=f"it has: {', '.join(found) or 'no SkillExecutor'}"
        )
    return checked_executor(kind)


def checked_executor(kind: type[SkillExecutor]) -> type[SkillExecutor]:
    """Return a class that can execute something: an error now is better than one when a skill is asked for.

    :raises SkillError: when it cannot; with file and line.
    """
    execute: Any = kind.execute
    if execute is SkillExecutor.execute:
        raise _misshapen(
            kind, f"{kind.__name__} has no execute()", "write: def execute(self, call): yield 0.5"
        )
    try:
        inspect.signature(execute).bind(None, None)
    except TypeError:
        hint = "write: def execute(self, call)"
        raise _misshapen(execute, f"{kind.__name__}.execute() does not take a call", hint) from None
    return kind


def _misshapen(what: Any, message: str, hint: str) -> SkillError:
    try:
        file, line = inspect.getsourcefile(what), inspect.getsourcelines(what)[1]
    except (OSError, TypeError):
        file, line = None, None
    return SkillError(message, file=file, line=line, hint=hint)


def _is_executor(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, SkillExecutor) and value is not SkillExecutor


def _load_module(name: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise SkillError(f"there is no Python module '{name}': {error}", hint=CLASS_FORM) from None
    except (Exception, SystemExit) as error:
        raise SkillError(f"the Python module '{name}' does not load: {_words(error)}") from error


def _load_file(file: Path) -> Any:
    name = f"cxbridge_executors_{file.resolve().as_posix().replace('/', '_')}"
    if name in sys.modules:
        return sys.modules[name]
    if not file.is_file():
        raise SkillError("there is no such file", file=file)
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a script that ends itself must not end the run
        del sys.modules[name]
        line = error.lineno if isinstance(error, SyntaxError) else _line_in(error, file)
        raise SkillError(f"it does not load: {_words(error)}", file=file, line=line) from error
    return module


def _line_in(error: BaseException, file: Path) -> int | None:
    """Return the last line of a file that an error came through."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(file):
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def _words(error: BaseException) -> str:
    return error.msg if isinstance(error, SyntaxError) else f"{type(error).__name__}: {error}"
