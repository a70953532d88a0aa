"""The page with a recording, or a JSON document, inside: one file that asks no server for anything.

The modules of the page import each other as ``cx/NAME.js``. A server's page maps ``cx/`` to their folder,
this page to ``data:`` URLs. The policy of the page allows the scripts in the file and their imports.
"""

from __future__ import annotations

import gzip
import json
from base64 import b64encode
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.linking import links
from cxbridge.resources import VERSION
from cxbridge.run.explainers import explainer
from cxbridge.trace.codec import encode_with_kind
from cxbridge.trace.formats.base import Run
from cxbridge_web.escaping import embed, html
from cxbridge_web.pages import FOLDER, base_script, digest, site_module, views_module

STYLES: Final = ("app", "parts", "views", "outcomes", "timeline", "plot", "map", "documents")
"""The style sheets of ``index.html`` besides the one that all pages share, in their order."""

MOST_EXPLANATIONS: Final = 20
"""Goals that failed or wait whose reasons a report has."""

# Starts the page. The policy allows scripts by their hash, and the modules that such a script adds.
_START: Final = """
document.addEventListener("DOMContentLoaded", () => {
  const start = document.createElement("script");
  start.type = "module";
  start.src = "data:text/javascript,import%20%22cx/main.js%22";
  document.head.append(start);
});
"""


def report(run: Run, title: str = "") -> str:
    """Return the page with a run inside.

    :param title: the name of the run on the page; empty: that of its file.
    :raises TraceError: when the run cannot be read.
    """
    if is_mcap(run.path):
        data = run.path.read_bytes()
    else:
        data = b"".join(encode_with_kind(event) + b"\n" for event in run if event.KIND.name)
    name = title or run.path.name or "run"
    history = RunHistory.of(run, UNLIMITED, run.start_us)  # reads the run, which makes its notes
    inside = {
        "name": name,
        "links": guessed_links(history),
        "notes": run.notes,
        "answers": _explanations(run, history),
    }
    return page_with(name, data, inside)


def _explanations(run: Run, history: RunHistory) -> dict[str, Any]:
    """Return the story of a run, and why its goals failed or wait, as far as a plug-in explains runs.

    With several agents a question begins with the agent's environment.
    """
    envs: list[str | None] = [*dict.fromkeys(goal.env for goal in history.goals)] or [None]
    found: dict[str, Any] = {}
    try:
        for env in envs:
            explain = explainer(run, env=env)
            agent = f"{env} " if len(envs) > 1 else ""
            goals = [goal for goal in history.goals if goal.env == env]
            unfinished = [goal.name for goal in goals if goal.end_change is None or goal.outcome == "FAILED"]
            found[f"{agent}run"] = explain("run", "")["data"]
            for name in unfinished[:MOST_EXPLANATIONS]:
                found[f"{agent}goal {name}"] = explain("goal", name)["data"]
    except (CxbridgeError, RecursionError):  # goals below each other by the thousand
        return {}
    return found


def document_page(kind: str, title: str, document: Mapping[str, Any]) -> str:
    """Return the page with a JSON document inside.

    :param kind: the module of ``static/js/documents`` that shows it.
    """
    return page_with(title, json.dumps(document).encode("utf-8"), {"kind": kind, "name": title})


def write_report(run: Run, output: Path, title: str = "") -> int:
    """Write the page with a run inside to a file, and return its size in bytes.

    :raises CxbridgeError: when the run cannot be read, or the file not written.
    """
    text = report(run, title).encode("utf-8")
    write_file(output, text)
    return len(text)


def page_with(title: str, data: bytes, inside: Mapping[str, Any]) -> str:
    """Return the page as one file.

    :param data: of the recording or document.
    :param inside: the description of the data: ``name``; for a recording ``links`` and ``notes``, for a
        document ``kind``.
    """
    modules = embed({"imports": {name: _url(text) for name, text in _modules(inside)}})
    scripts = [base_script(), _START]
    style = "\n".join(map(_read, ("shared/base.css", *(f"css/{name}.css" for name in STYLES))))
    body = _read("index.html").partition("<body>")[2].partition("</body>")[0]
    policy = (
        "default-src 'none'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; "
        f"form-action 'none'; script-src 'strict-dynamic' {' '.join(map(digest, (modules, *scripts)))}"
    )
    return _FRAME.format(
        policy=policy,
        version=html(VERSION),
        title=html(title),
        style=style,
        icon=_url(_read("icon.svg"), "image/svg+xml"),
        modules=modules,
        body=body,
        data=b64encode(gzip.compress(data, mtime=0)).decode(),
        scripts="".join(f"<script>{script}</script>\n" for script in scripts),
    )


def _modules(inside: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the modules of the page."""
    folder = FOLDER / "js"
    for path in sorted(folder.rglob("*.js")):
        yield f"cx/{path.relative_to(folder).as_posix()}", path.read_text("utf-8")
    yield "shared/views.js", views_module()
    yield "shared/site.js", site_module((), inside)


def _read(name: str) -> str:
    """Return a file of the page."""
    return (FOLDER / name).read_text("utf-8")


def _url(text: str, kind: str = "text/javascript") -> str:
    return f"data:{kind};base64,{b64encode(text.encode('utf-8')).decode()}"


_FRAME: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="cxbridge {version}">
<link rel="icon" href="{icon}">
<title>{title}</title>
<style>{style}</style>
<script type="importmap">{modules}</script>
<script type="text/plain" id="recording">{data}</script>
</head>
<body>{body}
{scripts}</body>
</html>
"""


_MCAP: Final = b"\x89MCAP"


def is_mcap(path: Path) -> bool:
    """Return whether the page can read a file without conversion."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_MCAP)) == _MCAP


def guessed_links(history: RunHistory) -> list[list[Any]]:
    """Return the guessed pairs: environment, goal, plan, action; Skiller, text, message, begin."""
    start_us = history.clock.first_us or 0
    pairs = [(link.action, link.call) for link in links(history) if link.guessed]
    return [
        [
            *(action.env, action.goal, action.plan, action.id),
            *(call.skiller, call.skill_string, call.msgid, start_us + call.begin.time),
        ]
        for action, call in pairs
    ]
