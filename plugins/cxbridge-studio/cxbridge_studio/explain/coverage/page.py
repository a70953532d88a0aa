"""Coverage as an HTML page: rules with their source, goals, actions, skills."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cxbridge.run.program.finished import write_document
from cxbridge_studio.explain.coverage.model import MODES, Coverage
from cxbridge_studio.explain.coverage.report import plain, short_names


def write_page(path: Path, coverage: Coverage, texts: Mapping[str, str], *, firings_known: bool) -> None:
    """Write the page.

    :param texts: source texts by file name.
    :param firings_known: whether any run has recorded firings.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    document = as_document(coverage, texts, firings_known=firings_known)
    write_document(path, "coverage", "Coverage", document)


def as_document(coverage: Coverage, texts: Mapping[str, str], *, firings_known: bool) -> dict[str, Any]:
    """Return the data of the page: the coverage as JSON values, with the source texts."""
    document = {**plain(coverage), "modes": list(MODES), "firings_known": firings_known}
    document["rules"]["files"] = [
        {
            "name": name,
            "total": file.counted,
            "fired": file.fired,
            "rules": [
                {"name": rule.name, "lines": rule.lines, "firings": count} for rule, count in file.rules
            ],
            "text": texts.get(file.file, "") if firings_known else "",
        }
        for name, file in zip(short_names(coverage.files), coverage.files, strict=True)
    ]
    return document
