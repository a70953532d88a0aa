"""Python services for Lua: log, clock, random numbers, configuration, skill files.

Functions that may fail return ``(True, values...)`` or ``(False, message)``; the functions of log, clock and
random numbers return a number or nil. Neither Python objects nor exceptions enter Lua. No Lua object, whose
methods may run a skill's code, enters Python: functions take plain values, except ``set`` and ``send`` of
:mod:`.boardaccess`, which check their arguments themselves. Texts are passed with one character per byte,
because Lua's strings are bytes. No function returns a secret
(:mod:`cxbridge.config.secrets`).
"""

from __future__ import annotations

import functools
import os
import random
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cxbridge.clock import Clock
from cxbridge.config.secrets import MASKED_TEXT, is_secret, mask
from cxbridge.errors import CxbridgeError, SkillError
from cxbridge.events import Level, Logger
from cxbridge.lua_syntax import decode_lua_text
from cxbridge.skiller.lua.modulepath import ModulePath

if TYPE_CHECKING:
    from cxbridge.config import Configuration


def to_lua(text: str) -> str:
    """Return a text with one character per UTF-8 byte."""
    return text if text.isascii() else text.encode("utf-8", "surrogateescape").decode("latin-1")


def from_lua(text: str) -> str:
    """Return a text from Lua. Bytes other than UTF-8 become surrogates."""
    return text if text.isascii() else text.encode("latin-1").decode("utf-8", "surrogateescape")


_PLAIN_TYPES = frozenset([str, int, float, bool, type(None)])


def is_plain(value: object) -> bool:
    """Return whether a Lua value is a text, number, boolean or nil."""
    return type(value) in _PLAIN_TYPES


def guard(function: Callable[..., Any], *, takes_tables: bool = False) -> Callable[..., tuple[Any, ...]]:
    """Wrap a function to return its result or error as a tuple for Lua.

    :param takes_tables: whether the function checks its arguments itself; otherwise they must be plain.
    """

    @functools.wraps(function)
    def call(*args: Any) -> tuple[Any, ...]:
        try:
            # a Lua object is refused, because its methods may run a skill's code
            if not takes_tables and not _PLAIN_TYPES.issuperset(map(type, args)):
                return False, "bad argument (a string or a number expected)"
            result = function(*args)
        except CxbridgeError as error:
            return False, to_lua(str(error))
        except Exception as error:  # noqa: BLE001 - Lua would get the exception itself, and could keep it
            return False, to_lua(f"{error}")
        return (True, *result) if type(result) is tuple else (True, result)

    return call


def _nil_after_errors(function: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a function to return nil instead of an error."""
    guarded_function = guard(function)

    def call(*args: Any) -> Any:
        ok, *values = guarded_function(*args)
        return values[0] if ok else None

    return call


_TRACEBACK_MARK = "\nstack traceback:"

MAX_LOG_BYTES = 8192
"""The maximum number of bytes of a text that Lua logs; the rest is cut. Chosen freely."""


def log_text(logger: Logger, level: Level, text: str, modules: ModulePath) -> None:
    """Log a text. A Lua error becomes one line with the skill's file; its stack goes to the debug level."""
    line, mark, stack = text.partition(_TRACEBACK_MARK)
    if not mark:
        logger.log(level, text)
        return
    logger.log(level, modules.insert_paths(line))
    logger.debug(f"{mark.strip()}{stack}")


class HostFunctions:
    """The host functions of one engine.

    :param logger: gets the output of skills.
    :param clock: the run's clock, the only time in Lua.
    :param config: the configuration that skills may read; None: skills have no configuration.
    :param seed: the seed of random numbers.
    """

    def __init__(
        self, logger: Logger, clock: Clock, modules: ModulePath, config: Configuration | None, seed: int
    ) -> None:
        self._logger = logger
        self._clock = clock
        self._modules = modules
        self._config = config
        self._random = random.Random(seed)  # noqa: S311 - runs with the same seed must be equal
        self._start_us = clock.now_us()

    def functions_by_name(self) -> dict[str, Callable[..., Any]]:
        """Return the functions by their Lua names."""
        # randomseed gets repr(seed), because seed(None) would take a seed from the operating system
        return {
            "log": _nil_after_errors(self._log),
            "now_usec": self._clock.now_us,
            "elapsed_usec": lambda: self._clock.now_us() - self._start_us,
            "random": self._random.random,
            "randomseed": _nil_after_errors(lambda seed=None: self._random.seed(repr(seed))),
            "find_module": guard(self._find_module),
            "config_exists": guard(lambda path: self._config is not None and self._config.exists(path)),
            "config_get": guard(self._config_get),
            "config_is": guard(self._config_is),
            "getenv": guard(self._getenv),
        }

    def _log(self, level: str, text: str) -> None:
        log_text(self._logger, Level[level.upper()], decode_lua_text(text[:MAX_LOG_BYTES]), self._modules)

    def _find_module(self, name: str) -> tuple[str, str]:
        return self._modules.read(name)

    def _config_get(self, path: str, kind: str) -> bool | int | float | str:
        if self._config is None:
            raise SkillError(f"there is no configuration with the value {path}")
        # a boolean of a secret path says only whether a protection is on
        if kind != "bool" and is_secret(path):
            raise SkillError(f"{path} is secret: skills cannot read it")
        value: bool | float | str = _GETTERS[kind](self._config, path)
        return to_lua(_mask_or_refuse(path, value)) if isinstance(value, str) else value

    def _config_is(self, path: str, kind: str) -> bool:
        try:
            self._config_get(path, kind)
        except CxbridgeError:
            return False
        return True

    @staticmethod
    def _getenv(name: str) -> str | None:
        value = os.environ.get(from_lua(name))
        if value is None:
            return None
        return to_lua(_mask_or_refuse(from_lua(name), value))


def _mask_or_refuse(path: str, value: str) -> str:
    """Return a value with masked secrets.

    :raises SkillError: if the whole value is secret.
    """
    masked_text = mask(path, value)
    if masked_text == MASKED_TEXT != value:  # nothing of the value is left
        raise SkillError(f"{path} is secret: skills cannot read it")
    return masked_text


_GETTERS: dict[str, Callable[[Configuration, str], Any]] = {
    "float": lambda config, path: config.get_float(path),
    "uint": lambda config, path: config.get_uint(path),
    "int": lambda config, path: config.get_int(path),
    "bool": lambda config, path: config.get_bool(path),
    "string": lambda config, path: config.get_str(path),
}
