"""The page, and the files that belong to it."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping, MutableMapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse, Response
from starlette.staticfiles import StaticFiles

from cxbridge.history.outcome import plain_outcomes

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send


def digest(text: str) -> str:
    """Return how a content security policy names an inline script."""
    return f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode()}'"


FOLDER: Final = Path(__file__).resolve().parent / "static"
"""The served folder: ``index.html`` is at ``/``."""

_INDEX: Final = (FOLDER / "index.html").read_text(encoding="utf-8")
_IMPORTS: Final = _INDEX.partition('<script type="importmap">')[2].partition("</script>")[0]

POLICY: Final = (
    f"default-src 'self'; script-src 'self' {digest(_IMPORTS)}; img-src 'self' data: blob:; "
    "style-src 'self' 'unsafe-inline'; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)
"""Pages may load from this server and talk to it, and to no other. One inline script maps the modules."""

_HEADERS: Final = ((b"content-security-policy", POLICY.encode()), (b"cache-control", b"no-cache"))

SHARED: Final = "/shared/"
"""Where the files are, seen from the page."""


VIEWS: Final = FOLDER / "js" / "views"
"""Each file here is a view of the page."""


def views_module() -> str:
    """Return the module that names the views: the files there are now."""
    return f"export default {json.dumps(sorted(path.stem for path in VIEWS.glob('*.js')))};\n"


def site_module(runs: Sequence[tuple[str, str]] | None, inside: Mapping[str, Any] | None = None) -> str:
    """Return the module with the page's source of data.

    :param runs: recorded runs, by path and name; None: a daemon or a run, with the API.
    :param inside: of the recording in the page itself; None: there is none.
    """
    found = None if runs is None else [{"path": path, "name": name} for path, name in runs]
    return f"export default {json.dumps({'runs': found, 'inside': inside})};\n"


def base_script() -> str:
    """Return what all pages share: ``cx``, with the outcomes of goals, actions and skills."""
    outcomes = json.dumps(plain_outcomes(), ensure_ascii=False)
    return (FOLDER / "shared/base.js").read_text(encoding="utf-8").replace("OUTCOMES_OF_CXBRIDGE", outcomes)


def shared_file(path: str, runs: Sequence[tuple[str, str]] | None = None) -> tuple[str, str] | None:
    """Return the text and the media type of a file that is made; None: it is none of them.

    :param path: of the request.
    :param runs: see :func:`site_module`.
    """
    match path.removeprefix(SHARED):
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
