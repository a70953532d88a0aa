"""The page with recorded runs, without a daemon: the application of ``cxbridge view``."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Final
from urllib.parse import parse_qsl, quote, unquote

from starlette.concurrency import run_in_threadpool
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    JSONResponse,
    PlainTextResponse,
    Response,
    StreamingResponse,
)

from cxbridge.errors import CxbridgeError
from cxbridge.event_kinds import View
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.run.explainers import RunExplainer, make_explainer
from cxbridge.trace.compare.model import Order
from cxbridge.trace.formats.registry import open_run
from cxbridge_web.pages import Page, make_icon_link, read_style
from cxbridge_web.report import MCAP, document_page, encode_lines, list_guessed_links

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

RUNS_PATH: Final = "/runs/"  # path prefix of the recordings; the prefix itself is the path of their list

_LIST_PAGE: Final = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Recorded runs - cxbridge</title><style>{style}</style>
{icon}</head>
<body><main><h1>Recorded runs</h1><ul>{items}</ul></main></body></html>
"""
# The path of the page that compares two runs by their numbers: `/compare?a=0&b=1`.
COMPARE_PATH: Final = "/compare"

_NO_CACHE: Final = {"Cache-Control": "no-cache"}


class RecordingsApp:
    """Serves the page and the given recordings, but no other file; an ASGI application.

    :param files: recorded runs of any format.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        for file in files:  # an unreadable recording is an error of the command, not of a request
            next(iter(open_run(file)), None)
        # by address, the path of the recording's URL
        self._files = {f"{RUNS_PATH}{number}/{file.name or 'run'}": file for number, file in enumerate(files)}
        # requests run in several threads: the second request for an explainer waits for the first
        self._explainer_lock = Lock()
        # the last explainer is kept, because a new explainer reads the whole recording
        self._get_explainer = lru_cache(maxsize=1)(_make_explainer)
        self._page = Page([(quote(address), file.name) for address, file in self._files.items()])

    @property
    def start_path(self) -> str:
        """The path of the start page: a single run, the comparison of two runs, or the list of more runs."""
        match len(self._files):
            case 1:
                return self._make_page_link(next(iter(self._files)))
            case 2:
                return f"{COMPARE_PATH}?a=0&b=1"
            case _:
                return RUNS_PATH

    @staticmethod
    def _make_page_link(address: str) -> str:
        # quoted twice: the page uses the value of the query as an address, which is itself quoted
        return f"/?run={quote(quote(address), safe='/')}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path, query_text = scope["path"], scope["query_string"].decode("ascii", "replace")
        query = dict(parse_qsl(query_text, keep_blank_values=True))
        response: Response
        if path == COMPARE_PATH:
            response = await run_in_threadpool(self._compare_runs, query)
        elif path.startswith(RUNS_PATH):
            response = await run_in_threadpool(self._serve_address, path, scope["method"], query)
        elif path.startswith("/api"):
            response = PlainTextResponse("The API is not available for recorded runs\n", 404)
        else:
            response = self._page.respond(scope)
            if (address := unquote(query.get("run", ""))) in self._files:
                # the browser loads the recording while it starts the page
                response.headers["link"] = f"<{quote(address)}>; rel=preload; as=fetch; crossorigin"
        await response(scope, receive, send)

    def _serve_address(self, address: str, method: str, query: Mapping[str, str]) -> Response:
        """Serve the list of recordings, a recording, or an explanation or the links of a recording.

        :param query: for an explanation ``why&kind=goal&name=gen14&at=3.5``, for the links ``links``.
        """
        if method not in {"GET", "HEAD"}:
            return PlainTextResponse("Recordings can only be read\n", 405)
        if address == RUNS_PATH:
            items = "".join(
                self._make_list_item(number, run_address, file)
                for number, (run_address, file) in enumerate(self._files.items())
            )
            page = _LIST_PAGE.format(style=read_style(), icon=make_icon_link(), items=items)
            return HTMLResponse(page, headers=_NO_CACHE)
        file = self._files.get(address)
        if file is None:
            return PlainTextResponse("This run does not exist\n", 404)
        return self._explain(file, query) if "why" in query else _serve_recording(file, query)

    def _make_list_item(self, number: int, address: str, file: Path) -> str:
        """Return the list item of a run, with a link to its comparison with the previous run."""
        link = f'<a href="{html.escape(self._make_page_link(address))}">{html.escape(str(file))}</a>'
        if number:
            link += (
                f' <a href="{COMPARE_PATH}?a={number - 1}&amp;b={number}">compare with the previous run</a>'
            )
        return f"<li>{link}</li>"

    def _compare_runs(self, query: Mapping[str, str]) -> Response:
        """Return the page that compares two runs."""
        addresses = list(self._files)
        try:
            first, second = (addresses[int(query[side])] for side in "ab")
        except (KeyError, IndexError, ValueError):
            return PlainTextResponse("Name two runs by their numbers: /compare?a=0&b=1\n", 400)
        try:
            view, order = View(query.get("level", "transitions")), Order(query.get("order", "partial"))
        except ValueError:
            choices = [", ".join(item.value for item in enumeration) for enumeration in (View, Order)]
            return PlainTextResponse("The level is one of {}; the order is one of {}\n".format(*choices), 400)
        page_links = {"a": self._make_page_link(first), "b": self._make_page_link(second)}
        try:
            page = make_comparison_page(self._files[first], self._files[second], view, order, page_links)
        except CxbridgeError as error:
            return PlainTextResponse(f"{error}\n", 400)
        return HTMLResponse(page, headers=_NO_CACHE)

    def _explain(self, file: Path, query: Mapping[str, str]) -> Response:
        """Return the explanation that a query asks for; status 400 without an explanation."""
        try:
            with self._explainer_lock:
                explain = self._get_explainer(file, query.get("at", ""), query.get("env", ""))
            return JSONResponse(explain(query.get("kind", ""), query.get("name", "")))
        except CxbridgeError as error:
            return JSONResponse({"message": str(error)}, 400)


def _make_explainer(file: Path, at_text: str, env: str) -> RunExplainer:
    """Return the explainer of a recording at a time.

    :param at_text: the seconds since the start; empty for the end of the recording.
    :param env: the CLIPS environment; empty for the default.
    :raises CxbridgeError: if the recording has no explanation, or the time is not a number.
    """
    try:
        at_s = float(at_text) if at_text else None
    except ValueError:
        raise CxbridgeError(f"'{at_text}' is not a time", hint="give the seconds since the start") from None
    return make_explainer(open_run(file), at_s, env or None)


class _RecordingResponse(FileResponse):
    """A recording in large pieces: each piece costs a change of the thread."""

    chunk_size = 1 << 20


def _serve_recording(file: Path, query: Mapping[str, str]) -> Response:
    """Return a recording; for the query ``links``, the guessed pairs of plan-actions and skill calls."""
    run = open_run(file)
    if "links" in query:
        history = RunHistory.from_events(run, UNLIMITED, run.start_us)
        return JSONResponse(list_guessed_links(history), headers=_NO_CACHE)
    if run.format == MCAP:
        return _RecordingResponse(file, media_type="application/octet-stream", headers=_NO_CACHE)
    return StreamingResponse(encode_lines(run), media_type="application/x-ndjson", headers=_NO_CACHE)


def make_comparison_page(
    file_a: Path, file_b: Path, view: View, order: Order, page_links: Mapping[str, str]
) -> str:
    """Return the page that compares two recorded runs.

    :param view: the events that are compared.
    :param page_links: the links to the pages of the single runs, by the keys ``a`` and ``b``.
    :raises CxbridgeError: if a run cannot be read.
    """
    from cxbridge.trace.compare.render.text import make_report  # noqa: PLC0415 - only needed for comparisons
    from cxbridge.trace.compare.runs import compare_runs  # noqa: PLC0415
    from cxbridge.trace.compare.side_by_side import page_report  # noqa: PLC0415

    runs_by_side = {"a": open_run(file_a), "b": open_run(file_b)}
    comparison = compare_runs(runs_by_side["a"], [runs_by_side["b"]], view, order)
    document = page_report(make_report(comparison, runs_by_side["a"], [runs_by_side["b"]])) | {
        "runs": page_links
    }
    with suppress(CxbridgeError):  # no headlines without a plug-in that explains runs
        document["headlines"] = {
            side: make_explainer(run)("run", "")["data"]["headline"] for side, run in runs_by_side.items()
        }
    return document_page("comparison", f"{file_a.name} and {file_b.name}", document)
