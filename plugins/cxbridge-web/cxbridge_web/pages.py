"""The page, and the files that belong to it."""

from __future__ import annotations

import json
from collections.abc import MutableMapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse, Response
from starlette.staticfiles import StaticFiles

from cxbridge.trace.html.page import asset, base_script

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

FOLDER: Final = Path(__file__).resolve().parent / "static"
"""The served folder: ``index.html`` is at ``/``."""

POLICY: Final = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
"""Pages may load from this server and talk to it, and to no other."""

_HEADERS: Final = ((b"content-security-policy", POLICY.encode()), (b"cache-control", b"no-cache"))

SHARED: Final = "/shared/"
"""Where the files are, seen from the page."""


VIEWS: Final = FOLDER / "js" / "views"
"""Each file here is a view of the page."""


def views_module() -> str:
    """Return the module that names the views: the files there are now."""
    return f"export default {json.dumps(sorted(path.stem for path in VIEWS.glob('*.js')))};\n"


def site_module(runs: Sequence[tuple[str, str]] | None) -> str:
    """Return the module that tells the page its source of data.

    :param runs: recorded runs, by path and name; None: a daemon or a run, with the API.
    """
    found = None if runs is None else [{"path": path, "name": name} for path, name in runs]
    return f"export default {json.dumps({'runs': found})};\n"


def shared_file(path: str, runs: Sequence[tuple[str, str]] | None = None) -> tuple[str, str] | None:
    """Return a shared file's text and media type; None: there is no such file.

    :param path: of the request.
    :param runs: see :func:`site_module`.
    """
    match path.removeprefix(SHARED):
        case "base.css":
            return asset("base.css"), "text/css"
        case "base.js":
            return base_script(), "text/javascript"
        case "site.js":
            return site_module(runs), "text/javascript"
        case "views.js":
            return views_module(), "text/javascript"
        case _:
            return None


class Pages:
    """Serves the files of a folder, with ETag. An ASGI application.

    :param runs: see :func:`site_module`.
    """

    def __init__(self, runs: Sequence[tuple[str, str]] | None = None) -> None:
        self._runs = runs
        self._files = StaticFiles(directory=FOLDER, html=True, check_dir=False)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one file."""

        async def sender(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), *_HEADERS]
            await send(message)

        path = scope["path"]
        if path.startswith(SHARED) and scope["method"] in {"GET", "HEAD"}:
            shared = shared_file(path, self._runs)
            if shared is not None:
                text, kind = shared
                await Response(text, media_type=kind)(scope, receive, sender)
                return
        if "\0" in path:  # old starlette asks the system for such a file
            await PlainTextResponse("Not Found\n", 404)(scope, receive, sender)
            return
        try:
            await self._files(scope, receive, sender)
        except HTTPException as error:
            await PlainTextResponse(f"{error.detail}\n", error.status_code)(scope, receive, sender)
