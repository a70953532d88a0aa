"""HTML pages about runs and results, which plug-ins make."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from cxbridge.file_access import write_file
from cxbridge.plugins import Table

VIEWS: Final[Table[Callable[..., str]]] = Table(
    "VIEWS", callable, "a function that makes a page, as HTML, of a recorded run"
)
"""Functions of plug-ins that return HTML pages.

The function of the row ``document`` makes a page from the kind, the title and the values of a JSON document.
"""


def write_document(path: Path, kind: str, title: str, document: Mapping[str, Any]) -> None:
    """Write a page that shows a JSON document.

    :param kind: the kind of the document, e.g. ``comparison``, which decides how the page shows the values.
    :raises CxbridgeError: if no plug-in makes pages or the file cannot be written.
    """
    write_file(path, VIEWS.load_target(VIEWS.find("document"))(kind, title, document))
