"""The files of the page, and the modules that are generated for it.

The page has no build step: a browser loads the unchanged modules of the folder ``static``.
"""

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

from cxbridge.history.outcome import outcomes_as_json

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send


def hash_script(text: str) -> str:
    """Return the hash of an inline script for a content security policy."""
    return f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode()}'"


# The folder that the server serves, with `index.html` at `/`.
STATIC_FOLDER: Final = Path(__file__).resolve().parent / "static"

_INDEX: Final = (STATIC_FOLDER / "index.html").read_text(encoding="utf-8")
_IMPORTS: Final = _INDEX.partition('<script type="importmap">')[2].partition("</script>")[0]

# The content security policy: only resources of this server, and the inline import map of `index.html`.
POLICY: Final = (
    f"default-src 'self'; script-src 'self' {hash_script(_IMPORTS)}; img-src 'self' data: blob:; "
    "style-src 'self' 'unsafe-inline'; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)

_HEADERS: Final = ((b"content-security-policy", POLICY.encode()), (b"cache-control", b"no-cache"))

SHARED_PREFIX: Final = "/shared/"  # path prefix of generated files


VIEWS_FOLDER: Final = STATIC_FOLDER / "js" / "views"  # folder with one module per view of the page


def make_views_module() -> str:
    """Return the module that lists the existing views."""
    return f"export default {json.dumps(sorted(path.stem for path in VIEWS_FOLDER.glob('*.js')))};\n"


def make_site_module(
    runs: Sequence[tuple[str, str]] | None, embedded: Mapping[str, Any] | None = None
) -> str:
    """Return the module that configures the page's data source.

    :param runs: recorded runs by path and name; None for a daemon or a run with the API.
    :param embedded: the description of the recording or document in the page; None for a page without.
    """
    rows = None if runs is None else [{"path": path, "name": name} for path, name in runs]
    return f"export default {json.dumps({'runs': rows, 'inside': embedded})};\n"


def make_base_script() -> str:
    """Return the script that all pages share: ``cx``, with the outcomes of goals, actions and skills."""
    outcomes = json.dumps(outcomes_as_json(), ensure_ascii=False)
    return (
        (STATIC_FOLDER / "shared/base.js")
        .read_text(encoding="utf-8")
        .replace("OUTCOMES_OF_CXBRIDGE", outcomes)
    )


def make_shared_file(path: str, runs: Sequence[tuple[str, str]] | None = None) -> tuple[str, str] | None:
    """Return the text and the media type of a generated file; None for other paths.

    :param path: the path of the request.
    :param runs: see :func:`make_site_module`.
    """
    match path.removeprefix(SHARED_PREFIX):
        case "base.js":
            return make_base_script(), "text/javascript"
        case "site.js":
            return make_site_module(runs), "text/javascript"
        case "views.js":
            return make_views_module(), "text/javascript"
        case _:
            return None


class Pages:
    """Serves the files of a folder with ETags; an ASGI application.

    :param runs: see :func:`make_site_module`.
    """

    def __init__(self, runs: Sequence[tuple[str, str]] | None = None) -> None:
        self._runs = runs
        self._files = StaticFiles(directory=STATIC_FOLDER, html=True, check_dir=False)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_with_headers(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), *_HEADERS]
            await send(message)

        path = scope["path"]
        if path.startswith(SHARED_PREFIX) and scope["method"] in {"GET", "HEAD"}:
            shared = make_shared_file(path, self._runs)
            if shared is not None:
                text, kind = shared
                await Response(text, media_type=kind)(scope, receive, send_with_headers)
                return
        if "\0" in path:  # old versions of starlette pass such a path to the system, which raises ValueError
            await PlainTextResponse("Not Found\n", 404)(scope, receive, send_with_headers)
            return
        try:
            await self._files(scope, receive, send_with_headers)
        except HTTPException as error:
            await PlainTextResponse(f"{error.detail}\n", error.status_code)(scope, receive, send_with_headers)
