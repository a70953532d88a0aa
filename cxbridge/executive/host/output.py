"""CLIPS' output as log lines, at Fawkes' levels.

CLIPS prints to logical names, and asks its routers which of them handles a name. 6.4 has fewer logical names
than 6.30: trace, dialog and ``printout t`` all arrive on ``stdout``, warnings on ``stdwrn``, errors on
``stderr``. Agents may still print to 6.30's names, and to the names of colours in ros2_cx (the CLIPS
Executive for ROS 2). The log has no colours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

from clips._clips import ffi, lib

from cxbridge.events import Level
from cxbridge.executive.host.capi import CData, decode, make_callback
from cxbridge.executive.host.shims import OWN_NAMES

LineSink = Callable[[Level, str], None]
"""Gets the level and text of a line."""

# levels by logical name, from Fawkes' CLIPS environment manager. Only wdialog differs, on purpose: Fawkes
# drops its lines, and cxbridge logs them at debug level. Names that Fawkes does not handle are t, wclips, and
# stdwrn and stderr, which are 6.4's. The names of colours and their level come from ``cx_clips_env_manager``
# of ros2_cx.
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
        """Whether rules are firing, in chunks: CLIPS' message about the limit of a chunk is dropped."""
        self.is_quiet = False
        """Whether CLIPS' warnings and error messages are dropped."""
        self._env, self._sink = env, sink
        self._unfinished_lines: dict[bytes, str] = {}
        self._captured_errors: list[str] | None = None
        # the callbacks of CLIPS, kept alive here because CLIPS keeps only their addresses
        self._callbacks = (
            make_callback("bool(Environment *, char *, void *)", self._is_handled),
            make_callback("void(Environment *, char *, char *, void *)", self._write),
            make_callback("void(Environment *, int, void *)", lambda _env, _code, _context: None),
        )
        query, write, leave = self._callbacks
        # NULL: the router has no input, and the callbacks need no context
        lib.AddRouter(env, _ROUTER, _PRIORITY, query, write, ffi.NULL, ffi.NULL, leave, ffi.NULL)

    def _is_handled(self, _env: CData, name: CData, _context: CData) -> bool:
        return ffi.string(name) in self.levels

    def _write(self, _env: CData, name: CData, text: CData, _context: CData) -> None:
        text_piece, target = decode(text), ffi.string(name)
        if self.is_quiet and target in (b"stdwrn", b"stderr"):
            return
        if target == b"stderr":
            # CLIPS prints a function's name as a separate piece; agents know the originals by other names
            text_piece = OWN_NAMES.get(text_piece, text_piece)
            if self._captured_errors is not None:
                self._captured_errors.append(text_piece)
                return
        if not (self.is_firing and text_piece == _LIMIT_REACHED):
            self._emit_complete_lines(target, text_piece)

    def _emit_complete_lines(self, target: bytes, text_piece: str) -> None:
        """Pass the complete lines of a text to the sink, and keep the unfinished line."""
        if "\n" not in text_piece:
            self._unfinished_lines[target] = self._unfinished_lines.get(target, "") + text_piece
            return
        *lines, unfinished = (self._unfinished_lines.pop(target, "") + text_piece).split("\n")
        if unfinished:
            self._unfinished_lines[target] = unfinished
        level = self.levels[target]
        for line in lines:
            if line.strip():
                self._sink(level, line)

    def redirect(self, sink: LineSink) -> LineSink:
        """Change the sink; return the former sink. Unfinished lines are flushed."""
        self.flush()
        previous, self._sink = self._sink, sink
        return previous

    def end_run(self) -> None:
        """Flush unfinished lines, and show messages again, after a run of the rules."""
        self.is_quiet = False
        self.flush()

    def flush(self) -> None:
        """Pass unfinished lines to the sink."""
        for target, text in list(self._unfinished_lines.items()):
            del self._unfinished_lines[target]
            if text.strip():
                self._sink(self.levels[target], text)

    def begin_error_capture(self) -> list[str] | None:
        """Start capturing error messages instead of logging them.

        :returns: the messages that an outer capture has collected so far, for :meth:`end_error_capture`; None
            if there is no outer capture.
        """
        outer, self._captured_errors = self._captured_errors, []
        return outer

    def end_error_capture(self, outer: list[str] | None) -> str:
        """Return the captured error messages, and continue the outer capture."""
        text = "".join(self._captured_errors or ())
        self._captured_errors = outer
        self.is_quiet = False  # an endless recursion within the capture may have silenced CLIPS
        return text

    def pause(self) -> None:
        """Deactivate the router while CLIPS prints to another destination, such as a string."""
        # CLIPS queries each active router for each piece of text, which is slow
        lib.DeactivateRouter(self._env, _ROUTER)

    def resume(self) -> None:
        lib.ActivateRouter(self._env, _ROUTER)

    def close(self) -> None:
        """Remove the router."""
        self.flush()
        lib.DeleteRouter(self._env, _ROUTER)
