"""Loading of CLIPS files: `load`, `load*`, `batch`, `batch*`.

As in Fawkes, loading continues after a broken construct. CLIPS' message about the construct becomes a
:class:`Diagnostic` with file and line. Users' files are rewritten before CLIPS reads them
(:mod:`cxbridge.executive.host.source`); files of the built-in core, the native files, almost never.
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

from cxbridge.clipstext.syntax import rule_lines
from cxbridge.events import Level, Logger
from cxbridge.executive.host.capi import CData, encode, executing_rule
from cxbridge.executive.host.output import OutputRouter
from cxbridge.executive.host.shims import free_names
from cxbridge.executive.host.source import (
    ClipsSource,
    find_exceeded_limit,
    prepare_core_source,
    prepare_source,
)

# a message of CLIPS: [CODE] FILE, Line NUMBER: TEXT
_MESSAGE = re.compile(r"\[([A-Z]+\d+)\] (?:(?P<file>[^\n]*?), Line (?P<line>\d+): )?(?P<text>[^\n]*)")
# the text after a message about a construct: the construct up to the mistake
_BROKEN_CONSTRUCT = re.compile(r"ERROR:\n\((def\w+) (?:\w+::)?([^\s()]+)")
# the host builds these deffacts again for each feature, which is no redefinition by the agent
_FEATURE_DEFFACTS_PREFIX = "ff-features-"
# a command at the start of a line: all constructs have names that begin with def
_COMMAND = re.compile(r"^\((?!def)", re.MULTILINE)
_FUNCTION_KINDS = ("deffunction", "defgeneric", "defmethod")

UNCLOSED = "UNCLOSED"
"""The code of diagnostics about unclosed parentheses."""

_FIND_CONSTRUCT: dict[str, Callable[[CData, bytes], CData]] = {
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
    """A mistake in a file of the agent.

    :param file: the path, or the type of an interface whose definition has no known file.
    :param line: the line of the mistake, or of the rule that uses a wrong file; None if unknown.
    :param construct: the construct that CLIPS has not defined, e.g. ``defrule NAME``; may be empty.
    :param code: CLIPS' code of the message, e.g. ``EXPRNPSR3``, or cxbridge's own, e.g. ``FILE`` or ``PDDL``.
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
    :param log: gets the log lines about mistakes.
    :param is_native: returns whether a file belongs to the built-in core, which keeps 6.4's `modify`.
    :param owner: the environment's name in events.
    :ivar diagnostics: the mistakes of all files.
    :ivar files: the loaded files in order.
    :ivar warn_redefinitions: whether redefined constructs are logged, see Fawkes' feature redefine-warning.
    """

    def __init__(
        self,
        env: CData,
        output: OutputRouter,
        log: Logger,
        is_native: Callable[[Path], bool],
        owner: str = "",
    ) -> None:
        self._env, self._output, self._log = env, output, log
        self._is_native, self._owner = is_native, owner
        self._loading: list[str] = []
        self._declared_functions: set[str] = set()  # forward declarations: functions without actions
        self.is_parsing = False
        """Whether CLIPS is parsing constructs. CLIPS cannot load another file then."""
        self.diagnostics: list[Diagnostic] = []
        self.files: list[Path] = []
        self.warn_redefinitions = False
        self.is_quiet = False
        """Whether mistakes are logged at debug level only, because the caller reports them together."""
        self.rewrite: Callable[[str, str], str] | None = None
        """A debugger's change of each text before CLIPS reads the text. The function gets path and text, and
        returns a text with as many lines."""

    def load(self, file: str) -> bool:
        """Load the constructs of a file; return whether all are valid."""
        return self._load_file(file, batch=False)

    def batch(self, file: str) -> bool:
        """Execute the commands and constructs of a file; return whether CLIPS has read the file."""
        return self._load_file(file, batch=True)

    def _load_file(self, file: str, *, batch: bool) -> bool:
        path = Path(file)
        try:
            if not path.is_file() and path.exists() and not path.is_dir():
                # reading a pipe may block forever
                self._report_and_log(
                    Diagnostic(file, None, "", "FILE", "the path is not a regular file"), Level.ERROR
                )
                return False
            content = path.read_bytes()
        except (OSError, ValueError) as error:  # ValueError: a path with a NUL character
            reason = getattr(error, "strerror", None) or error
            self._report_and_log(
                Diagnostic(file, None, "", "FILE", f"the file cannot be read: {reason}"), Level.ERROR
            )
            return False
        is_native = self._is_native(path)
        text = content.decode("utf-8", "surrogateescape")
        excess = None if is_native else find_exceeded_limit(text)
        if excess is not None:
            self._report_and_log(
                Diagnostic(file, excess.line, "", "LIMIT", f"the file is not loaded: {excess.message}"),
                Level.ERROR,
            )
            return False
        source = prepare_core_source(text) if is_native else prepare_source(text, self.has_clips_function)
        if self.rewrite is not None:
            source = replace(source, text=self.rewrite(file, source.text), is_changed=True)
        self.files.append(path)
        if not is_native:
            free_names(self._env, (item.name for item in source.constructs if item.kind in _FUNCTION_KINDS))
        if self.warn_redefinitions:
            self._warn_about_redefinitions(source)
        self._emit_source(file, content, batch=batch, is_native=is_native)
        self._loading.append(file)
        try:
            # a core file without commands is loaded, because a batch is slow, but succeeds like a batch,
            # which continues after a broken construct
            is_batched = batch and not (is_native and _COMMAND.search(text) is None)
            load = lib.BatchStar if is_batched else lib.Load
            is_loaded = self._read_source(file, source, load) or batch != is_batched
        finally:
            self._loading.pop()
        if source.unclosed_line is not None:
            mistake = "a parenthesis that opens here is never closed: the rest of the file is not loaded"
            unclosed = [item for item in source.constructs if item.line == source.unclosed_line]
            construct_name = f"{unclosed[0].kind} {unclosed[0].name}" if unclosed else ""
            self._report_and_log(
                Diagnostic(file, source.unclosed_line, construct_name, UNCLOSED, mistake), Level.WARN
            )
        return is_loaded

    def _emit_source(self, file: str, content: bytes, *, batch: bool, is_native: bool) -> None:
        """Emit a file as a source of the run before it is loaded."""
        self._log.bus.emit_source(
            "clips",
            self._owner,
            file,
            content,
            how="batch" if batch else "load",
            modify="6.4" if is_native else "6.3",
            within=self.current_file,
        )

    @contextmanager
    def recorded_inner_load(self, file: str, *, batch: bool) -> Iterator[None]:
        """Record a file that CLIPS loads without this loader, as a source of the run."""
        self.files.append(Path(file))
        # rules may have removed the file: then its text is not recorded
        with suppress(OSError):
            # CLIPS reads the file itself, without our rewriting, so that `modify` is that of 6.4
            self._emit_source(file, Path(file).read_bytes(), batch=batch, is_native=True)
        self._loading.append(file)
        try:
            yield
        finally:
            self._loading.pop()

    @property
    def current_file(self) -> str:
        """The file that is being loaded; empty if none is."""
        return self._loading[-1] if self._loading else ""

    def report_missing_file(self, file: str) -> None:
        """Report a missing file that a rule of the agent loads."""
        # the core's rules load files that the configuration names, which are checked already
        caller, line = self.executing_rule_location()
        if caller is not None and not self._is_native(Path(caller)):
            self.report(Diagnostic(caller, line, "", "FILE", f"there is no file {file}"))

    def executing_rule_location(self) -> tuple[str | None, int | None]:
        """Return file and line of the active rule, or None twice if they are unknown."""
        rule = executing_rule(self._env)
        location = self.rule_location(rule) if rule else None
        return (None, None) if location is None else (str(location[0]), location[1])

    def rule_location(self, rule: str) -> tuple[Path, int] | None:
        """Return file and line of a rule; None if no readable file has the rule."""
        for file in reversed(self.files):
            with suppress(OSError):  # rules may have removed the file since it was loaded
                line = rule_lines(file.read_text("utf-8", "surrogateescape")).get(rule)
                if line is not None:
                    return file, line
        return None

    def has_clips_function(self, name: str) -> bool:
        """Return whether a deffunction or defgeneric exists."""
        c_name = encode(name)
        return bool(lib.FindDeffunction(self._env, c_name) or lib.FindDefgeneric(self._env, c_name))

    def _read_source(self, file: str, source: ClipsSource, load: Callable[[CData, bytes], object]) -> bool:
        """Let CLIPS read a file, or a temporary file with the rewritten text, see :meth:`_read_file`."""
        if not source.is_changed:
            return self._read_file(file, file, source, load)
        import tempfile  # noqa: PLC0415 - slow to import and rarely needed

        handle, copy_path = tempfile.mkstemp(suffix=".clp", prefix="cxbridge-")
        try:
            with os.fdopen(handle, "wb") as copy:
                copy.write(encode(source.text))
            return self._read_file(copy_path, file, source, load)
        finally:
            Path(copy_path).unlink()

    def _read_file(
        self, read_path: str, file: str, source: ClipsSource, load: Callable[[CData, bytes], object]
    ) -> bool:
        """Let CLIPS read a file; return whether all constructs are valid, or CLIPS could open a batch.

        :param read_path: the file, or the temporary copy with the rewritten text.
        :param file: the file in messages.
        :param load: CLIPS' function ``Load`` or ``BatchStar``.
        """
        outer, was_parsing = self._output.begin_error_capture(), self.is_parsing
        self.is_parsing = load is lib.Load
        try:
            result = load(self._env, encode(read_path))
        finally:
            self.is_parsing = was_parsing
            errors = self._output.end_error_capture(outer)
        if errors.strip():
            self._diagnose(errors, read_path, file, source)
        return result == lib.LE_NO_ERROR if load is lib.Load else bool(result)

    def _diagnose(self, errors: str, read_path: str, file: str, source: ClipsSource) -> None:
        """Convert CLIPS' output on stderr to diagnostics."""
        construct_lines = {
            (construct.kind, construct.name): construct.line for construct in source.constructs
        }
        starts = [match.start() for match in _MESSAGE.finditer(errors)]
        for start, end in pairwise((*starts, len(errors))):
            block = errors[start:end]
            head = _MESSAGE.match(block)
            assert head is not None  # each block begins with a message
            broken = _BROKEN_CONSTRUCT.search(block)
            construct = f"{broken[1]} {broken[2]}" if broken else ""
            line = int(head["line"]) if head["line"] else None
            if line is None and broken:
                line = construct_lines.get((broken[1], broken[2]))
            message_file = file if head["file"] in (read_path, None) else str(head["file"])
            self._report_and_log(
                Diagnostic(message_file, line, construct, head[1], head["text"].strip()), Level.ERROR
            )

    def _report_and_log(self, diagnostic: Diagnostic, level: Level) -> None:
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
            (log or self._log).log(Level.DEBUG if self.is_quiet else level, text)

    def _warn_about_redefinitions(self, source: ClipsSource) -> None:
        """Log constructs that exist already or occur twice, for Fawkes' feature redefine-warning."""
        defined: set[tuple[str, str]] = set()
        for construct in source.constructs:
            find = _FIND_CONSTRUCT.get(construct.kind)
            if find is None or construct.name.startswith(_FEATURE_DEFFACTS_PREFIX):
                continue
            name = construct.name.removeprefix("MAIN::")
            if construct.kind == "defglobal":
                name = name.strip("?*")
            exists = (construct.kind, name) in defined or find(self._env, encode(name))
            if exists and name not in self._declared_functions:
                self._log.error(f"Redefining {construct.kind}: {name}")
            defined.add((construct.kind, name))
            # a function that is declared and then defined is not redefined; a further definition is
            if construct.kind == "deffunction":
                (
                    self._declared_functions.add
                    if construct.is_declaration
                    else self._declared_functions.discard
                )(name)
