"""Loading of CLIPS files: `load`, `load*`, `batch`, `batch*`.

As in Fawkes, loading continues after a broken construct, which is reported with file and line.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path

from clips._clips import lib
from msgspec import Struct
from msgspec.structs import replace

from cxbridge.clipstext.syntax import CONSTRUCT, blank, rule_lines, top_level
from cxbridge.events import Level, Logger
from cxbridge.executive.host.capi import NULL, CData, encode, executing_rule
from cxbridge.executive.host.output import OutputRouter
from cxbridge.executive.host.shims import give_way
from cxbridge.executive.host.source import ClipsSource, find_excess, prepare, prepare_core

_MESSAGE = re.compile(r"\[([A-Z]+\d+)\] (?:(?P<file>[^\n]*?), Line (?P<line>\d+): )?(?P<text>[^\n]*)")
_BROKEN = re.compile(r"ERROR:\n\((def\w+) (?:\w+::)?([^\s()]+)")
# the host builds these deffacts again for each feature, which is no redefinition by the agent
_DEFFACTS_OF_FEATURES = "ff-features-"
# a command at the start of a line: all constructs have names that begin with def
_COMMAND = re.compile(r"^\((?!def)", re.MULTILINE)
_FUNCTION_KINDS = ("deffunction", "defgeneric", "defmethod")

UNCLOSED = "UNCLOSED"
"""The code for a parenthesis without end."""

_FINDERS: dict[str, Callable[[CData, bytes], CData]] = {
    "defrule": lib.FindDefrule,
    "deftemplate": lib.FindDeftemplate,
    "deffacts": lib.FindDeffacts,
    "deffunction": lib.FindDeffunction,
    "defglobal": lib.FindDefglobal,
    "defclass": lib.FindDefclass,
    "defgeneric": lib.FindDefgeneric,
    "definstances": lib.FindDefinstances,
}


class Diagnostic(Struct, frozen=True):
    """A mistake in a CLIPS file.

    :param line: the line reported by CLIPS or by the scanner; None if unknown.
    :param construct: the undefined construct, e.g. ``defrule NAME``; may be empty.
    :param code: CLIPS' code of the message, e.g. ``EXPRNPSR3``.
    :param message: the mistake.
    :param hint: the remedy; may be empty.
    """

    file: str
    line: int | None
    construct: str
    code: str
    message: str
    hint: str = ""

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        construct = f"{self.construct} is not defined: " if self.construct else ""
        return f"{place}: {construct}{self.message} [{self.code}]"


class ClipsLoader:
    """Loads files into one environment and collects their mistakes.

    :param env: the environment's pointer.
    :param log: gets a line for each mistake.
    :param is_native: returns whether a file of the built-in core keeps 6.4's `modify`.
    :param owner: the environment's name in events.
    """

    def __init__(
        self,
        env: CData,
        output: OutputRouter,
        log: Logger,
        is_native: Callable[[Path], bool],
        owner: str = "",
    ) -> None:
        self._env = env
        self._output = output
        self._log = log
        self._is_native = is_native
        self._owner = owner
        self._loading: list[str] = []
        self._declared: set[str] = set()  # declared functions without actions
        self.is_parsing = False
        """Whether CLIPS is parsing constructs. It cannot load another file then."""
        self.diagnostics: list[Diagnostic] = []
        self.files: list[Path] = []
        self.warn_redefinitions = False
        self.quiet = False
        """Whether mistakes are logged at debug level only, because the caller reports them together."""
        self.rewrite: Callable[[str, str], str] | None = None
        """Rewrites a text before CLIPS reads it: gets path and text, returns a text with as many lines."""

    def load(self, file: str) -> bool:
        """Load the constructs of a file; return whether all are valid."""
        return self._load_file(file, batch=False)

    def batch(self, file: str) -> bool:
        """Execute the commands and constructs of a file; return whether it is readable."""
        return self._load_file(file, batch=True)

    def _load_file(self, file: str, *, batch: bool) -> bool:
        path = Path(file)
        try:
            if not path.is_file() and path.exists() and not path.is_dir():
                # reading a pipe may block forever
                self._report(Diagnostic(file, None, "", "FILE", "this is not a regular file"), Level.ERROR)
                return False
            data = path.read_bytes()
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            self._report(Diagnostic(file, None, "", "FILE", f"cannot read it: {reason}"), Level.ERROR)
            return False
        native = self._is_native(path)
        text = data.decode("utf-8", "surrogateescape")
        excess = None if native else find_excess(text)
        if excess is not None:
            message = f"the file is not loaded: {excess.message}"
            self._report(Diagnostic(file, excess.line, "", "LIMIT", message), Level.ERROR)
            return False
        source = (
            prepare_core(text) if native else prepare(text, rewrite_modify=True, is_known=self.is_function)
        )
        if self.rewrite is not None:
            source = replace(source, text=self.rewrite(file, source.text), changed=True)
        self.files.append(path)
        if not native:
            give_way(self._env, (item.name for item in source.constructs if item.kind in _FUNCTION_KINDS))
        if self.warn_redefinitions:
            self._warn_of_redefinitions(source)
        self._emit_source(file, data, batch=batch, native=native)
        self._loading.append(file)
        try:
            # load and batch have equal results for constructs, but CLIPS finds the end of a command slowly
            has_commands = batch and not (native and _COMMAND.search(text) is None)
            load = (self._batch_parts if native else lib.BatchStar) if has_commands else lib.Load
            is_loaded = self._call(file, source, load)
            is_loaded = is_loaded or batch != has_commands  # a batch continues after a broken construct
        finally:
            self._loading.pop()
        if source.unclosed_line is not None:
            text = "a parenthesis opens here that never closes: what follows it in the file is lost"
            construct = next(
                (
                    f"{item.kind} {item.name}"
                    for item in source.constructs
                    if item.line == source.unclosed_line
                ),
                "",
            )
            self._report(Diagnostic(file, source.unclosed_line, construct, UNCLOSED, text), Level.WARN)
        return bool(is_loaded)

    def _emit_source(self, file: str, data: bytes, *, batch: bool, native: bool) -> None:
        """Emit a file as a source of the run before it is loaded."""
        how, modify = "batch" if batch else "load", "6.4" if native else "6.3"
        self._log.bus.emit_source(
            "clips", self._owner, file, data, how=how, modify=modify, within=self.within
        )

    @contextmanager
    def noting(self, file: str, *, batch: bool) -> Iterator[None]:
        """Record a file that CLIPS itself loads within another load, as a source of the run."""
        self.files.append(Path(file))
        # the file may have been removed by the rules; then only its source is not recorded
        with suppress(OSError):
            self._emit_source(file, Path(file).read_bytes(), batch=batch, native=True)
        self._loading.append(file)
        try:
            yield
        finally:
            self._loading.pop()

    @property
    def within(self) -> str:
        """The file that is being loaded; empty if no file is."""
        return self._loading[-1] if self._loading else ""

    def not_found(self, file: str) -> None:
        """Report a missing file that a rule of the agent loads."""
        # files named by the configuration are loaded by the core's rules, and already checked with their
        # place in it
        caller, line = self.place_of_executing()
        if caller is not None and not self._is_native(Path(caller)):
            self.report(Diagnostic(caller, line, "", "FILE", f"there is no file {file}"))

    def place_of_executing(self) -> tuple[str | None, int | None]:
        """Return file and line of the active rule; None if unknown."""
        rule = executing_rule(self._env)
        location = self.place_of(rule) if rule else None
        return (None, None) if location is None else (str(location[0]), location[1])

    def place_of(self, rule: str) -> tuple[Path, int] | None:
        """Return file and line of a rule if its file is still readable."""
        for file in reversed(self.files):
            with suppress(OSError):  # the file may have been removed since it was loaded
                line = rule_lines(file.read_text("utf-8", "surrogateescape")).get(rule)
                if line is not None:
                    return file, line
        return None

    def is_function(self, name: str) -> bool:
        """Return whether a deffunction or defgeneric exists."""
        data = encode(name)
        return bool(lib.FindDeffunction(self._env, data) or lib.FindDefgeneric(self._env, data))

    def _call(self, file: str, source: ClipsSource, load: Callable[[CData, bytes], object]) -> bool:
        """Let CLIPS read a file, or a temporary file with the rewritten text."""
        if not source.changed:
            return self._read(file, file, source, load)
        import tempfile  # noqa: PLC0415 - slow to import and rarely needed

        handle, name = tempfile.mkstemp(suffix=".clp", prefix="cxbridge-")
        try:
            with os.fdopen(handle, "wb") as copy:
                copy.write(encode(source.text))
            return self._read(name, file, source, load)
        finally:
            Path(name).unlink()

    def _read(
        self, name: str, file: str, source: ClipsSource, load: Callable[[CData, bytes], object]
    ) -> bool:
        outer, was_parsing = self._output.begin_errors(), self.is_parsing
        self.is_parsing = load is lib.Load
        try:
            result = load(self._env, encode(name))
        finally:
            self.is_parsing = was_parsing
            errors = self._output.end_errors(outer)
        if errors.strip():
            self._diagnose(errors, name, file, source)
        return result == lib.LE_NO_ERROR if load is lib.Load else bool(result)

    @staticmethod
    def _batch_parts(env: CData, name: bytes) -> bool:
        """Do the work of ``BatchStar`` in linear time."""
        # BatchStar's time grows with the square of a part's length
        text = Path(os.fsdecode(name)).read_bytes().decode("utf-8", "surrogateescape")
        for start, end in top_level(blank(text)):
            part = encode(text[start:end])
            if CONSTRUCT.match(text, start):
                lib.Build(env, part)
            else:
                lib.Eval(env, part, NULL)
        return True

    def _diagnose(self, errors: str, name: str, file: str, source: ClipsSource) -> None:
        """Convert CLIPS' output on stderr to diagnostics."""
        lines = {(construct.kind, construct.name): construct.line for construct in source.constructs}
        starts = [match.start() for match in _MESSAGE.finditer(errors)]
        for start, end in pairwise((*starts, len(errors))):
            block = errors[start:end]
            head = _MESSAGE.match(block)
            assert head is not None
            broken = _BROKEN.search(block)
            construct = f"{broken[1]} {broken[2]}" if broken else ""
            line = int(head["line"]) if head["line"] else None
            if line is None and broken:
                line = lines.get((broken[1], broken[2]))
            where = file if head["file"] in (name, None) else str(head["file"])
            self._report(Diagnostic(where, line, construct, head[1], head["text"].strip()), Level.ERROR)

    def _report(self, diagnostic: Diagnostic, level: Level) -> None:
        self.report(diagnostic, str(diagnostic), self._log, level)

    def report(
        self, diagnostic: Diagnostic, text: str = "", log: Logger | None = None, level: Level = Level.ERROR
    ) -> None:
        """Record a mistake in a file of the agent, found by CLIPS or by a feature.

        :param text: the log line; empty: no log line.
        :param log: by default the environment's log.
        """
        self.diagnostics.append(diagnostic)
        if text:
            (log or self._log).log(Level.DEBUG if self.quiet else level, text)

    def _warn_of_redefinitions(self, source: ClipsSource) -> None:
        """Report constructs that exist already or occur twice, for Fawkes' feature redefine-warning."""
        defined: set[tuple[str, str]] = set()
        for construct in source.constructs:
            find = _FINDERS.get(construct.kind)
            if find is None or construct.name.startswith(_DEFFACTS_OF_FEATURES):
                continue
            name = construct.name.removeprefix("MAIN::")
            if construct.kind == "defglobal":
                name = name.strip("?*")
            exists = (construct.kind, name) in defined or find(self._env, encode(name))
            if exists and name not in self._declared:
                self._log.error(f"Redefining {construct.kind}: {name}")
            defined.add((construct.kind, name))
            if construct.kind == "deffunction":
                (self._declared.add if construct.declares else self._declared.discard)(name)
