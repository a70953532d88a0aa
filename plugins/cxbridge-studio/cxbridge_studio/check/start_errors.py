"""Adds the findings of the check to the error of a failed start."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Final

from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.run.mistakes import contains_call_to
from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge_studio.check.checks.constructs import (
    UNKNOWN_FUNCTION,
    UNKNOWN_GLOBAL,
    UNKNOWN_SLOT,
    UNKNOWN_TEMPLATE,
)
from cxbridge_studio.check.checks.files import MISSING_FILE
from cxbridge_studio.check.findings import Finding, Severity
from cxbridge_studio.check.run import check

_DROPPED_TEMPLATE: Final = re.compile(r"deftemplate ([^\s:]+)")
# The codes of unknown names. A missing file may define the name, and then only the missing file is reported.
_UNKNOWN_NAME_CODES: Final = frozenset({UNKNOWN_TEMPLATE, UNKNOWN_SLOT, UNKNOWN_FUNCTION, UNKNOWN_GLOBAL})


def add_findings(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error with the check's findings, and with the mistakes in files without findings.

    The error is unchanged if the check finds no errors, the options are wrong, or the run is lenient: a
    lenient run starts despite the defects of a Fawkes checkout, which the check would report.
    """
    findings = find_errors(options)
    if not findings:
        return error
    if any(finding.code is MISSING_FILE for finding in findings):
        findings = [finding for finding in findings if finding.code not in _UNKNOWN_NAME_CODES]
    dropped_templates = {
        match[1] for finding in findings if (match := _DROPPED_TEMPLATE.match(finding.message))
    }
    # After CLIPS has dropped a deftemplate, it takes the slots in the facts of the template for calls of
    # unknown functions. Such findings are consequences.
    findings = [
        finding
        for finding in findings
        if finding.code is not UNKNOWN_FUNCTION
        or not contains_call_to(finding.place.file, finding.place.line, dropped_templates)
    ]
    files = {finding.place.file for finding in findings}
    mistakes = [
        *map(_make_error, findings),
        *(mistake for mistake in error.mistakes if mistake.file not in files),
    ]
    return BrokenAgentError(mistakes, started=error.started)


def find_errors(options: RunOptions) -> list[Finding]:
    """Return the errors that the check finds in a run's agents; none for a lenient run, or wrong options."""
    if source_of(options).is_lenient:
        return []
    options = replace(options, trace=None, log=None, bblog=None, replay=())  # the check records nothing
    try:
        findings = check(options, errors_only=True)
    except CxbridgeError:
        return []
    return [finding for finding in findings if finding.code.severity is Severity.ERROR]


def _make_error(finding: Finding) -> CxbridgeError:
    place = finding.place
    return CxbridgeError(
        f"{finding.message} [{finding.code.name}]",
        file=place.file,
        line=place.line or None,
        column=place.column or None,
        hint=finding.hint or None,
    )
