"""Makes the diagnostics of a file from the findings of the last check and from the mistakes in its text.

After a change of a file, the findings that need only its text come from the changed text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from lsprotocol.types import Diagnostic, DiagnosticSeverity

from cxbridge_studio.agent.names import SourceFile
from cxbridge_studio.lsp.diagnostics import TEXT_CODES, UNKNOWN_NAME_CODES, find_mistakes
from cxbridge_studio.lsp.positions import PositionConverter
from cxbridge_studio.lsp.session import Session

SOURCE: Final = "cxbridge"
_SEVERITIES: Final = {
    "error": DiagnosticSeverity.Error,
    "warning": DiagnosticSeverity.Warning,
    "note": DiagnosticSeverity.Information,
}
# The text that a diagnostic marks, from the position of a finding on.
_WORD: Final = re.compile(r"[^\s()]+|\(")


class FileFindings:
    """The findings of the last check by file, and the files that have changed since the check began.

    :ivar changed_paths: the paths of files with a text that may differ from the checked text.
    :ivar by_path: the findings of the last check by path, as in ``cxbridge check --json``.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.changed_paths: set[str] = set()
        self._paths_changed_since_begin: set[str] = set()
        self.by_path: dict[str, list[Mapping[str, Any]]] = {}

    def begin_check(self) -> None:
        """Record the start of a check, which reads the files on the disk."""
        self._paths_changed_since_begin = set()

    def record_change(self, path: str) -> None:
        """Record a change of a file's text."""
        self.changed_paths.add(path)
        self._paths_changed_since_begin.add(path)

    def finish_check(self, unsaved_paths: set[str]) -> None:
        """Read the findings of a finished check from the session's knowledge.

        :param unsaved_paths: the paths of the files with unsaved text.
        """
        # The check has not read the present text of these files.
        self.changed_paths = self._paths_changed_since_begin | unsaved_paths
        self.by_path = {}
        for finding in self._session.knowledge.findings:
            if finding["file"]:
                path = str(Path(finding["file"]).resolve())
                self.by_path.setdefault(path, []).append(finding)

    def make_diagnostics(self, file: SourceFile, positions: PositionConverter) -> list[Diagnostic]:
        """Return the diagnostics of a file, each mistake once."""
        is_changed = file.path in self.changed_paths
        # The keys are code and line: check and text may report the same mistake at different columns.
        unique_diagnostics: dict[tuple[str, int], Diagnostic] = {}
        for finding in self.by_path.get(file.path, ()):
            if not (is_changed and finding["code"] in TEXT_CODES):
                diagnostic = _convert_check_finding(file, finding, positions)
                unique_diagnostics[finding["code"], diagnostic.range.start.line] = diagnostic
        if (
            is_changed
            or file.path not in self._session.knowledge.loaded_files
            or not self._session.knowledge.is_complete
        ):
            for diagnostic in _find_text_diagnostics(self._session, file, positions):
                unique_diagnostics.setdefault((str(diagnostic.code), diagnostic.range.start.line), diagnostic)
        return list(unique_diagnostics.values())


def _convert_check_finding(
    file: SourceFile, finding: Mapping[str, Any], positions: PositionConverter
) -> Diagnostic:
    # The line is 0 for the whole file, and the column for the whole line.
    start = file.lines.position(max(finding["line"], 1), max(finding["column"], 1))
    word_match = _WORD.match(file.text, start)
    end = word_match.end() if word_match else start
    return Diagnostic(
        range=positions.to_range(file, min(start, len(file.text)), min(end, len(file.text))),
        message=_format_message(finding["message"], finding["hint"]),
        severity=_SEVERITIES.get(finding["severity"]),
        code=finding["code"],
        source=SOURCE,
    )


def _find_text_diagnostics(
    session: Session, file: SourceFile, positions: PositionConverter
) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each mistake in a file's text.

    Without an agent, an unknown name is only a warning, because unread files may define the name.
    """
    for finding in find_mistakes(session, file):
        is_sure = bool(session.knowledge.loaded_files) or finding.code not in UNKNOWN_NAME_CODES
        yield Diagnostic(
            range=positions.to_range(file, finding.start, finding.end),
            message=_format_message(finding.message, finding.hint),
            severity=_SEVERITIES[finding.code.severity.value] if is_sure else DiagnosticSeverity.Warning,
            code=finding.code.name,
            source=SOURCE,
        )


def _format_message(message: str, hint: str) -> str:
    return f"{message}\nhint: {hint}" if hint else message
