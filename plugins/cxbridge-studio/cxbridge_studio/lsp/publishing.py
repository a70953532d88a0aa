"""Makes the published diagnostics from the findings of the last check and, for changed files, of the text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from lsprotocol.types import Diagnostic, DiagnosticSeverity

from cxbridge_studio.agent.names import SourceFile
from cxbridge_studio.lsp.diagnostics import LIVE_CODES, UNKNOWN_NAMES, live_findings
from cxbridge_studio.lsp.positions import Positions
from cxbridge_studio.lsp.session import Session

SOURCE: Final = "cxbridge"
_SEVERITIES: Final = {
    "error": DiagnosticSeverity.Error,
    "warning": DiagnosticSeverity.Warning,
    "note": DiagnosticSeverity.Information,
}
_WORD: Final = re.compile(r"[^\s()]+|\(")


class FindingsOfFiles:
    """The findings of the last check by file, and the files that have changed since the check began.

    :ivar changed: the paths of files with a text that differs from the checked text.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.changed: set[str] = set()
        self._changed_since_begin: set[str] = set()
        self._checked: dict[str, list[Mapping[str, Any]]] = {}  # the findings of the last check, by file

    @property
    def paths(self) -> set[str]:
        """The paths of the files with findings of the last check."""
        return set(self._checked)

    def begin(self) -> None:
        """Record the start of a check, which reads the files on the disk."""
        self._changed_since_begin = set()

    def change(self, path: str) -> None:
        """Record a change of a file's text."""
        self.changed.add(path)
        self._changed_since_begin.add(path)

    def finish(self, unsaved: set[str]) -> None:
        """Take the findings from the session's knowledge at the end of a check.

        :param unsaved: the paths of the files with unsaved text.
        """
        self.changed = self._changed_since_begin | unsaved  # the check has read another text of these files
        self._checked = {}
        for finding in self._session.knowledge.findings:
            if finding["file"]:
                path = str(Path(finding["file"]).resolve())
                self._checked.setdefault(path, []).append(finding)

    def diagnostics(self, file: SourceFile, positions: Positions) -> list[Diagnostic]:
        """Return the diagnostics of a file, each mistake once."""
        is_changed = file.path in self.changed
        # The keys are code and line, because the check may report a mistake in another column than the text.
        unique_diagnostics: dict[tuple[str, int], Diagnostic] = {}
        for finding in self._checked.get(file.path, ()):
            if not (is_changed and finding["code"] in LIVE_CODES):
                diagnostic = _of_check(file, finding, positions)
                unique_diagnostics[finding["code"], diagnostic.range.start.line] = diagnostic
        if is_changed or file.path not in self._session.loaded or not self._session.knowledge.is_complete:
            for diagnostic in _of_text(self._session, file, positions):
                unique_diagnostics.setdefault((str(diagnostic.code), diagnostic.range.start.line), diagnostic)
        return list(unique_diagnostics.values())


def _of_check(file: SourceFile, finding: Mapping[str, Any], positions: Positions) -> Diagnostic:
    start = file.lines.place(max(finding["line"], 1), max(finding["column"], 1))
    word = _WORD.match(file.text, start)
    end = word.end() if word else start
    return Diagnostic(
        range=positions.range(file, min(start, len(file.text)), min(end, len(file.text))),
        message=_message(finding["message"], finding["hint"]),
        severity=_SEVERITIES.get(finding["severity"]),
        code=finding["code"],
        source=SOURCE,
    )


def _of_text(session: Session, file: SourceFile, positions: Positions) -> Iterator[Diagnostic]:
    """Yield the mistakes in a file's text.

    Without an agent, an unknown name is only a warning, because unread files may define the name.
    """
    for finding in live_findings(session, file):
        is_sure = bool(session.loaded) or finding.code not in UNKNOWN_NAMES
        yield Diagnostic(
            range=positions.range(file, finding.start, finding.end),
            message=_message(finding.message, finding.hint),
            severity=_SEVERITIES[finding.code.severity.value] if is_sure else DiagnosticSeverity.Warning,
            code=finding.code.name,
            source=SOURCE,
        )


def _message(message: str, hint: str) -> str:
    return f"{message}\nhint: {hint}" if hint else message
