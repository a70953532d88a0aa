"""CLIPS' output as log lines, at Fawkes' levels.

6.4 prints to fewer routers than 6.30: trace, dialog and ``printout t`` all arrive on ``stdout``, warnings on
``stdwrn``, errors on ``stderr``. Agents may print to 6.30's routers, and to the colour routers of ros2_cx;
the log has no colours.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from clips._clips import ffi, lib

from cxbridge.events import Level
from cxbridge.executive.host.capi import CData, callback, decode
from cxbridge.executive.host.loggers import LineSink
from cxbridge.executive.host.shims import OWN_NAMES

# Levels by logical name, from Fawkes' CLIPS environment manager, which drops output to wdialog. Colours:
# ``cx_clips_env_manager`` of ros2_cx, which logs them at the same level.
_LEVELS = {
    b"stdout": Level.INFO,
    b"t": Level.INFO,
    b"l": Level.INFO,
    b"info": Level.INFO,
    b"loginfo": Level.INFO,
    b"debug": Level.DEBUG,
    b"logdebug": Level.DEBUG,
    b"warn": Level.WARN,
    b"logwarn": Level.WARN,
    b"stdwrn": Level.WARN,
    b"error": Level.ERROR,
    b"logerror": Level.ERROR,
    b"stderr": Level.ERROR,
    b"wdisplay": Level.INFO,
    b"wclips": Level.INFO,
    b"wtrace": Level.DEBUG,
    b"wdialog": Level.DEBUG,
    b"wwarning": Level.WARN,
    b"werror": Level.ERROR,
    **dict.fromkeys(
        (b"red", b"green", b"blue", b"yellow", b"magenta", b"cyan", b"white", b"bold"), Level.INFO
    ),
}

_LIMIT_REACHED = "rule firing limit reached\n"
_ROUTER = b"cxbridge-log"
_PRIORITY = 40  # above the priority of CLIPS' router for the standard streams


class OutputRouter:
    """Collects CLIPS' output and passes it on line by line.

    :param env: the environment's pointer.
    :param sink: gets each non-blank line without its line end.
    """

    levels: ClassVar[Mapping[bytes, Level]] = _LEVELS
    """The handled logical names and the levels of their lines."""

    def __init__(self, env: CData, sink: LineSink) -> None:
        self.is_firing = False
        """Whether the host runs the agenda in chunks. CLIPS' message at the end of a chunk is dropped."""
        self.quiet = False
        """Whether CLIPS' error messages are dropped."""
        self._last_message: str | None = None  # the text of the last permitted message, None without a limit
        self._env = env
        self._sink = sink
        self._open: dict[bytes, str] = {}
        self._capture: list[str] | None = None
        self._calls = (
            callback("bool(Environment *, char *, void *)", self._query),
            callback("void(Environment *, char *, char *, void *)", self._write),
            callback("void(Environment *, int, void *)", lambda _env, _code, _context: None),
        )
        query, write, leave = self._calls
        lib.AddRouter(env, _ROUTER, _PRIORITY, query, write, ffi.NULL, ffi.NULL, leave, ffi.NULL)

    def _query(self, _env: CData, name: CData, _context: CData) -> bool:
        return ffi.string(name) in self.levels

    def _write(self, _env: CData, name: CData, text: CData, _context: CData) -> None:
        piece = decode(text)
        target = ffi.string(name)
        if target == b"stdwrn" and self.quiet:
            return
        if target == b"stderr":
            piece = OWN_NAMES.get(piece, piece)
            if self.quiet:
                return
            self._count_message(piece)
            if self._capture is not None:
                self._capture.append(piece)
                return
        if not (self.is_firing and piece == _LIMIT_REACHED):
            self._gather(target, piece)

    def _gather(self, target: bytes, piece: str) -> None:
        """Pass on complete lines of a text and keep the unfinished line."""
        if "\n" not in piece:
            self._open[target] = self._open.get(target, "") + piece
            return
        *lines, rest = (self._open.pop(target, "") + piece).split("\n")
        if rest:
            self._open[target] = rest
        level = self.levels[target]
        for line in lines:
            if line.strip():
                self._sink(level, line)

    def hush(self) -> None:
        """Drop error messages after the next one. Further calls change nothing."""
        if self._last_message is None:
            self._last_message = ""

    def speak(self) -> None:
        """Stop dropping error messages."""
        self.quiet, self._last_message = False, None

    def _count_message(self, piece: str) -> None:
        """Start dropping if this piece completes the last permitted message."""
        if self._last_message is not None:
            self._last_message += piece
            if "\n" in self._last_message.lstrip():
                self.quiet, self._last_message = True, None

    def redirect(self, sink: LineSink) -> LineSink:
        """Change the sink; return the former one. Unfinished lines are flushed."""
        self.flush()
        previous, self._sink = self._sink, sink
        return previous

    def end_run(self) -> None:
        """Reset after a run of the rules: flush unfinished lines and stop dropping."""
        self.speak()
        if self._open:
            self.flush()

    def flush(self) -> None:
        """Pass on unfinished lines."""
        for target, text in list(self._open.items()):
            del self._open[target]
            if text.strip():
                self._sink(self.levels[target], text)

    def begin_errors(self) -> list[str] | None:
        """Start capturing error messages; return the state to pass to :meth:`end_errors`."""
        outer, self._capture = self._capture, []
        return outer

    def end_errors(self, outer: list[str] | None) -> str:
        """Return the captured error messages and restore the earlier state."""
        text = "".join(self._capture or ())
        self._capture = outer
        self.speak()
        return text

    def pause(self) -> None:
        """Deactivate the router."""
        # CLIPS queries each active router for each piece of text, which is slow
        lib.DeactivateRouter(self._env, _ROUTER)

    def resume(self) -> None:
        lib.ActivateRouter(self._env, _ROUTER)

    def close(self) -> None:
        """Remove the router."""
        self.flush()
        lib.DeleteRouter(self._env, _ROUTER)
