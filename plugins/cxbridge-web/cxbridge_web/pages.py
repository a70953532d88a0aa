"""The page as one document, which contains its modules and styles and, without a server, its data.

The modules of the page import each other as ``cx/NAME.js``, and modules made here as ``shared/NAME.js``. The
import map of the document maps each name to a ``data:`` URL with the text of the module, so a browser needs
only one request for the page. The content security policy allows only the scripts of the document and their
imports.
"""

from __future__ import annotations

import gzip
import json
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response

from cxbridge.history.outcome import outcomes_as_json
from cxbridge.resources import VERSION
from cxbridge_web.escaping import encode_for_script, escape_html

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

STATIC_FOLDER: Final = Path(__file__).resolve().parent / "static"
"""The folder with the files of the page."""

# The style sheets in their order: a later sheet overrides an earlier sheet.
_STYLES: Final = ("base", "app", "parts", "views", "outcomes", "timeline", "plot", "map", "documents")

# The script that starts the page. The policy allows scripts by their hash, and the modules that they add.
_START: Final = """
document.addEventListener("DOMContentLoaded", () => {
  const start = document.createElement("script");
  start.type = "module";
  start.src = "data:text/javascript,import%20%22cx/main.js%22";
  document.head.append(start);
});
"""

# The characters of a module that a URL has to escape: "%" begins an escape, "#" a fragment.
_ESCAPED_IN_URL: Final = re.compile(r"[^\x20-\x7e]|[%#]")

_DOCUMENT: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">{meta}
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="cxbridge {version}">
{icon}
<title>{title}</title>
<style>{style}</style>
<script type="importmap">{modules}</script>{data}
</head>
<body>
{body}{scripts}</body>
</html>
"""


def make_page(title: str, data: bytes, description: Mapping[str, Any]) -> str:
    """Return the page with an embedded recording or document, which needs no server.

    :param data: the bytes of the recording or the document.
    :param description: the description of the data: ``name``; for a recording also ``links``, ``notes`` and
        ``answers``, for a document also ``kind``.
    """
    # without the present time, so that equal data give equal pages
    packed_data = b64encode(gzip.compress(data, mtime=0)).decode()
    data_element = f'\n<script type="text/plain" id="recording">{packed_data}</script>'
    modules = _make_import_map({"runs": [], "inside": description})
    policy = (
        f"default-src 'none'; {_allow_scripts(modules)}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )
    meta = f'\n<meta http-equiv="Content-Security-Policy" content="{policy}">'
    return _make_document(title, modules, meta=meta, data_element=data_element)


class Page:
    """Serves the page, with an ETag; an ASGI application.

    :param runs: the paths and names of the recorded runs of the server; None for the server of a daemon or a
        run, which has the API.
    """

    def __init__(self, runs: Sequence[tuple[str, str]] | None = None) -> None:
        recordings = None if runs is None else [{"path": path, "name": name} for path, name in runs]
        modules = _make_import_map({"runs": recordings, "inside": None})
        self._document = _make_document("cxbridge", modules).encode("utf-8")
        # level 9 would take twice the time to save 1 %
        self._packed_document = gzip.compress(self._document, compresslevel=6, mtime=0)
        self._headers = {
            "content-security-policy": (
                f"default-src 'self'; {_allow_scripts(modules)}; style-src 'unsafe-inline'; "
                "img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'self'; "
                "frame-ancestors 'none'"
            ),
            "cache-control": "no-cache",
            # half of the hash, 128 bits, tells documents apart
            "etag": f'"{sha256(self._document).hexdigest()[:32]}"',
            "vary": "accept-encoding",
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self.respond(scope)(scope, receive, send)

    def respond(self, scope: Scope) -> Response:
        """Return the response to a request for the page; 404 for other paths, 405 unless GET or HEAD."""
        if scope["method"] not in {"GET", "HEAD"}:
            return PlainTextResponse("Method Not Allowed\n", 405, {"allow": "GET, HEAD"})
        if scope["path"] not in {"/", "/index.html"}:
            return PlainTextResponse("Not Found\n", 404)
        request_headers = Headers(scope=scope)
        if self._headers["etag"] in request_headers.get("if-none-match", ""):
            return Response(None, 304, self._headers)
        if "gzip" in request_headers.get("accept-encoding", ""):
            headers = {**self._headers, "content-encoding": "gzip"}
            return Response(self._packed_document, headers=headers, media_type="text/html")
        return Response(self._document, headers=self._headers, media_type="text/html")


def list_views() -> list[str]:
    """Return the names of the views of the page: each is one module of the folder ``js/views``."""
    return sorted(path.stem for path in STATIC_FOLDER.glob("js/views/*.js"))


def read_style() -> str:
    """Return the style sheets of the page."""
    return "\n".join(_read_file(f"css/{name}.css") for name in _STYLES)


def make_icon_link() -> str:
    """Return the element that gives a page its icon."""
    url = _make_data_url(_read_file("icon.svg"), "image/svg+xml")
    return f'<link rel="icon" href="{escape_html(url)}">'


def _make_document(title: str, modules: str, *, meta: str = "", data_element: str = "") -> str:
    """Return the text of the page.

    :param modules: the import map.
    :param meta: further elements for the head.
    :param data_element: the element with the embedded data; empty without embedded data.
    """
    return _DOCUMENT.format(
        version=escape_html(VERSION),
        title=escape_html(title),
        icon=make_icon_link(),
        style=read_style(),
        body=_read_file("body.html"),
        scripts="".join(f"<script>{script}</script>\n" for script in _list_scripts()),
        modules=modules,
        meta=meta,
        data=data_element,
    )


def _make_import_map(site: Mapping[str, Any]) -> str:
    """Return the import map, with a ``data:`` URL per module of the page.

    :param site: the content of the module ``shared/site.js``: the source of the page's data.
    """
    modules = {name: _make_data_url(f"{text}//# sourceURL={name}\n") for name, text in _list_modules(site)}
    return encode_for_script({"imports": modules})


def _list_modules(site: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the modules of the page."""
    folder = STATIC_FOLDER / "js"
    for path in sorted(folder.rglob("*.js")):
        yield f"cx/{path.relative_to(folder).as_posix()}", path.read_text("utf-8")
    yield "shared/views.js", f"export default {json.dumps(list_views())};\n"
    yield "shared/site.js", f"export default {json.dumps(site)};\n"


def _list_scripts() -> tuple[str, str]:
    """Return the scripts that start the page; the first makes the global ``cx`` of all modules."""
    outcomes = json.dumps(outcomes_as_json(), ensure_ascii=False)
    return _read_file("base.js").replace("OUTCOMES_OF_CXBRIDGE", outcomes), _START


def _allow_scripts(modules: str) -> str:
    """Return the part of a content security policy that allows the scripts of the page, and their imports."""
    return f"script-src 'strict-dynamic' {' '.join(map(_hash_script, (modules, *_list_scripts())))}"


def _hash_script(text: str) -> str:
    """Return the hash of an inline script for a content security policy."""
    return f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode()}'"


def _make_data_url(text: str, media_type: str = "text/javascript") -> str:
    return f"data:{media_type};charset=utf-8,{_ESCAPED_IN_URL.sub(lambda match: quote(match[0], ''), text)}"


def _read_file(name: str) -> str:
    return (STATIC_FOLDER / name).read_text("utf-8")
