"""An environment with the behaviour of an unmodified CLIPS 6.4, for agents of the ROS 2 CX.

The environments of cxbridge behave like CLIPS 6.30, as agents of Fawkes expect. The ROS 2 CX embeds an
unmodified ("stock") CLIPS 6.4, with its functions and trace lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, Final

from clips._clips import ffi, lib

from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, encode
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.output import OutputRouter
from cxbridge.executive.host.shims import Clips630Functions
from cxbridge.executive.host.values import Value, to_python

# the items that an environment can watch from its start
WATCH_ITEMS: Final = frozenset(
    {
        *("all", "facts", "instances", "slots", "rules", "activations", "messages", "message_handlers"),
        *("generic_functions", "methods", "deffunctions", "compilations", "statistics", "globals", "focus"),
    }
)

# Firings between two checks for endless rules. The number is large, since CLIPS begins a new count of
# firings, which its trace lines show, with each chunk.
_MAX_CHUNK_FIRINGS: Final = 10_000

# logical names that the ROS 2 CX adds for coloured output
_COLOUR_NAMES: Final = (b"red", b"green", b"blue", b"yellow", b"magenta", b"cyan", b"white", b"bold")
_LEVEL_BY_NAME: Final[Mapping[bytes, Level]] = MappingProxyType(
    {
        **dict.fromkeys((b"l", b"t", b"info", b"loginfo", b"stdout", *_COLOUR_NAMES), Level.INFO),
        **dict.fromkeys((b"debug", b"logdebug"), Level.DEBUG),
        **dict.fromkeys((b"warn", b"logwarn", b"stdwrn"), Level.WARN),
        **dict.fromkeys((b"error", b"logerror", b"stderr"), Level.ERROR),
    }
)


class StockOutput(OutputRouter):
    """Collects output into lines: one buffer serves all logical names.

    The logical name of a line's last piece determines the level of the line.
    """

    levels: ClassVar[Mapping[bytes, Level]] = _LEVEL_BY_NAME

    stdout_level = Level.INFO
    logical_name = ""  # the logical name of the last piece of output

    _buffer = ""

    def _emit_complete_lines(self, target: bytes, text_piece: str) -> None:
        *lines, self._buffer = (self._buffer + text_piece).split("\n")
        self.logical_name = target.decode()
        level = self.stdout_level if target == b"stdout" else self.levels[target]
        for line in lines:
            self._sink(level, line)

    def flush(self) -> None:
        """Do nothing: as in the ROS 2 CX, an unfinished line is never logged."""


class StockEnvironment(ClipsEnvironment):
    """An environment without the functions that imitate CLIPS 6.30, and without those of Fawkes."""

    output_router: ClassVar[type[OutputRouter]] = StockOutput

    def _apply_shims(self) -> None:
        """Replace the functions of CLIPS that end the process, and those whose effects the host follows."""
        self._clips630_functions = Clips630Functions(self.c_env, self.udfs, self.build_unrecorded)
        self._open_files: list[Path] = []
        for name, function, min_arguments, max_arguments, types in (
            ("exit", self._exit, 0, 1, "*"),
            ("clear", self._clear, 0, 0, "*"),
            ("load*", self._load_star, 1, 1, "*;sy"),
            ("batch*", self.batch, 1, 1, "*;sy"),
        ):
            EXTRA_FUNCTIONS.RemoveUDF(self.c_env, encode(name))
            self.define(name, function, min_arguments, max_arguments, types)
        self.define("cx-shutdown", self._quit)
        # CLIPS watches compilations from the start, a node only the items in its parameters
        EXTRA_FUNCTIONS.UnwatchString(self.c_env, b"all")

    def _build_clips630_functions(self) -> None:
        """Do nothing: a cleared environment has all functions of CLIPS."""

    def watch_items(self, items: tuple[str, ...]) -> None:
        """Watch items of :data:`WATCH_ITEMS`, in upper or lower case.

        :raises ClipsError: if an item is unknown.
        """
        for item in items:
            if item.lower() not in WATCH_ITEMS:
                raise ClipsError(f"Unknown watch item: {item}", hint=f"use: {', '.join(sorted(WATCH_ITEMS))}")
            EXTRA_FUNCTIONS.WatchString(self.c_env, encode(item.lower().replace("_", "-")))

    def redirect_stdout_to_debug(self) -> None:
        """Log the output to stdout at the level DEBUG."""
        assert isinstance(self.output, StockOutput)
        self.output.stdout_level = Level.DEBUG

    def clear(self) -> None:
        """Remove all constructs and facts, like ``(clear)``."""
        self._clear()

    def reset(self) -> None:
        lib.Reset(self.c_env)

    def load(self, path: Path | str) -> bool:
        """Load a file's constructs like ``load*``; return whether the file could be opened."""
        with self._mark_reading(Path(path)):
            return bool(lib.Load(self.c_env, encode(str(path))) != lib.LE_OPEN_FILE_ERROR)

    def batch(self, path: Path | str) -> bool:
        """Execute a file like ``batch*``; return whether the file could be opened."""
        with self._mark_reading(Path(path), is_batch=True):
            return bool(lib.BatchStar(self.c_env, encode(str(path))))

    @contextmanager
    def _mark_reading(self, path: Path, *, is_batch: bool = False) -> Iterator[None]:
        """Mark a file as being read.

        :param is_batch: whether the file has commands, as for ``batch*``; otherwise it has constructs.
        :raises ClipsError: if the file is being read already, since the file would read itself without end.
        """
        file = path.resolve()
        if file in self._open_files:
            chain = " -> ".join(open_file.name for open_file in (*self._open_files, file))
            raise ClipsError("this file reads itself", file=path, hint=f"files that read each other: {chain}")
        self.watcher.forget_names()  # the file may define deftemplates again
        self._open_files.append(file)
        try:
            with self.loader.recorded_inner_load(str(path), batch=is_batch):
                yield
        finally:
            self._open_files.pop()

    def _load_star(self, file: str) -> bool:
        """Load a file for rules; return whether the file has no error, as CLIPS' function ``load*`` does."""
        with self._mark_reading(Path(file)):
            return bool(lib.Load(self.c_env, encode(file)) == lib.LE_NO_ERROR)

    def eval(self, expression: str) -> Value:
        """Evaluate an expression and return its value.

        :raises ClipsError: if the expression does not parse or fails.
        """
        value = ffi.new("CLIPSValue *")
        outer_capture = self.output.begin_error_capture()
        error_code = lib.Eval(self.c_env, encode(expression), value)
        error_text = self.output.end_error_capture(outer_capture)
        if error_code != lib.EE_NO_ERROR:
            self.api.clear_halt()
            raise ClipsError(f"CLIPS cannot evaluate {expression}: {' '.join(error_text.split())}")
        return to_python(value)

    def fire(self, limit: int = -1, fired_before: int = 0) -> int:
        """Fire rules of a run in chunks; an evaluation error and ``(halt)`` end the run.

        :returns: the number of firings.
        :param limit: the maximum number of firings; -1 for no limit.
        :param fired_before: the number of firings in previous calls for the same run.
        """
        fired_count = 0
        self._is_ended_by_host = self._is_ended_by_halt = False
        if not fired_before:
            self.endless.begin()
        while not self.is_ended:
            max_firings = _MAX_CHUNK_FIRINGS if limit < 0 else min(_MAX_CHUNK_FIRINGS, limit - fired_count)
            if max_firings <= 0:
                break
            self.is_firing = self.output.is_firing = True
            chunk_fired_count = int(lib.Run(self.c_env, max_firings))
            self.is_firing = self.output.is_firing = False
            fired_count += chunk_fired_count
            if self.api.is_halted() or self.api.is_halt_requested():
                self.api.clear_halt()
                break
            if chunk_fired_count < max_firings:
                break
            # a run with a limit ends anyway, unless this call continues a longer run
            has_limit = limit >= 0 and not fired_before
            if reason := self.endless.check(chunk_fired_count, has_limit=has_limit):
                self.end_faulty_run(reason)
                self.api.clear_halt()
        return fired_count
