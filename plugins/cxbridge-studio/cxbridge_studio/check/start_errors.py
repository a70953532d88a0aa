"""Adds the findings of the check to the error of a failed start."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Final

from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.run.mistakes import names_any
from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge_studio.check.checks.constructs import FUNCTION, GLOBAL, SLOT, TEMPLATE
from cxbridge_studio.check.checks.files import MISSING
from cxbridge_studio.check.findings import Finding, Severity
from cxbridge_studio.check.run import check

_TEMPLATE: Final = re.compile(r"deftemplate ([^\s:]+)")
# The codes of unknown names: a missing file may define such a name.
_UNKNOWN_NAMES: Final = frozenset({TEMPLATE, SLOT, FUNCTION, GLOBAL})


def with_findings(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error with the check's findings, and with those of its mistakes that the check misses.

    The error of a lenient run is returned unchanged, because the check would add known defects of a Fawkes
    checkout.
    """
    if source_of(options).is_lenient:
        return error
    options = replace(options, trace=None, log=None, bblog=None, replay=())  # the check records nothing
    try:
        findings = check(options, errors_only=True)
    except CxbridgeError:
        return error
    findings = [finding for finding in findings if finding.code.severity is Severity.ERROR]
    if any(finding.code is MISSING for finding in findings):
        findings = [finding for finding in findings if finding.code not in _UNKNOWN_NAMES]
    dropped_templates = {match[1] for finding in findings if (match := _TEMPLATE.match(finding.message))}
    # If CLIPS drops a deftemplate, it takes the slots of the template's facts for calls of unknown functions.
    findings = [
        finding
        for finding in findings
        if finding.code is not FUNCTION
        or not names_any(finding.place.file, finding.place.line, dropped_templates)
    ]
    files = {finding.place.file for finding in findings}
    mistakes = [*map(_error, findings), *(mistake for mistake in error.mistakes if mistake.file not in files)]
    return BrokenAgentError(mistakes, started=error.started)


def _error(finding: Finding) -> CxbridgeError:
    place = finding.place
    return CxbridgeError(
        f"{finding.message} [{finding.code.name}]",
        file=place.file,
        line=place.line or None,
        column=place.column or None,
        hint=finding.hint or None,
    )
