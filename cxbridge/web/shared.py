"""What the page has in common with pages about recorded runs: their style, their helpers, how states look."""

from __future__ import annotations

import json
from functools import cache
from typing import Final

from cxbridge.trace.html.look import plain_looks
from cxbridge.trace.html.page import asset

FOLDER: Final = "/shared/"
"""Where the files are, seen from the page."""


@cache
def shared_file(path: str) -> tuple[str, str] | None:
    """Return a shared file's text and media type; None: there is no such file.

    :param path: of the request.
    """
    match path.removeprefix(FOLDER):
        case "base.css":
            return asset("base.css"), "text/css"
        case "base.js":
            return asset("base.js"), "text/javascript"
        case "looks.js":
            return f"export default {json.dumps(plain_looks(), ensure_ascii=False)};\n", "text/javascript"
        case _:
            return None
