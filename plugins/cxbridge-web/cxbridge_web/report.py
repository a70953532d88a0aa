"""The page with an embedded recording or JSON document: a single file that needs no server.

The modules of the page import each other as ``cx/NAME.js``. The import map of a server's page maps ``cx/`` to
their folder; the import map of this page maps each module to a ``data:`` URL. The content security policy of
the page allows only the scripts in the file and their imports.
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
from cxbridge.history.linking import find_skill_links
from cxbridge.resources import VERSION
from cxbridge.run.explainers import explainer
from cxbridge.trace.codec import encode_with_kind
from cxbridge.trace.formats.base import Run
from cxbridge_web.escaping import encode_for_script, escape_html
from cxbridge_web.pages import (
    STATIC_FOLDER,
    hash_script,
    make_base_script,
    make_site_module,
    make_views_module,
)

STYLES: Final = ("app", "parts", "views", "outcomes", "timeline", "plot", "map", "documents")
"""The style sheets of ``index.html`` in their order, except the shared style sheet of all pages."""

MAX_EXPLANATIONS: Final = 20
"""The limit of unfinished or failed goals whose explanations a report contains."""

# The script that starts the page. The policy allows scripts by their hash, and the modules that they add.
_START: Final = """
document.addEventListener("DOMContentLoaded", () => {
  const start = document.createElement("script");
  start.type = "module";
  start.src = "data:text/javascript,import%20%22cx/main.js%22";
  document.head.append(start);
});
"""


def report(run: Run, title: str = "") -> str:
    """Return the page with an embedded run.

    :param title: the name of the run on the page; by default the name of its file.
    :raises TraceError: if the run cannot be read.
    """
    if is_mcap(run.path):
        data = run.path.read_bytes()
    else:
        data = b"".join(encode_with_kind(event) + b"\n" for event in run if event.KIND.name)
    name = title or run.path.name or "run"
    # before the use of `run.notes`, which reading the run fills
    history = RunHistory.from_events(run, UNLIMITED, run.start_us)
    embedded = {
        "name": name,
        "links": guessed_links(history),
        "notes": run.notes,
        "answers": _make_explanations(run, history),
    }
    return make_page(name, data, embedded)


def _make_explanations(run: Run, history: RunHistory) -> dict[str, Any]:
    """Return the story of a run and the explanations of its unfinished and failed goals, by question.

    With several agents, a question begins with the agent's environment. Empty without a plug-in that explains
    runs.
    """
    envs: list[str | None] = [*dict.fromkeys(goal.env for goal in history.goals)] or [None]
    explanations: dict[str, Any] = {}
    try:
        for env in envs:
            explain = explainer(run, env=env)
            agent = f"{env} " if len(envs) > 1 else ""
            goals = [goal for goal in history.goals if goal.env == env]
            troubled = [goal.name for goal in goals if goal.end_change is None or goal.outcome == "FAILED"]
            explanations[f"{agent}run"] = explain("run", "")["data"]
            for name in troubled[:MAX_EXPLANATIONS]:
                explanations[f"{agent}goal {name}"] = explain("goal", name)["data"]
    except (CxbridgeError, RecursionError):  # RecursionError: thousands of nested goals
        return {}
    return explanations


def document_page(kind: str, title: str, document: Mapping[str, Any]) -> str:
    """Return the page with an embedded JSON document.

    :param kind: the name of the module of ``static/js/documents`` that shows the document.
    """
    return make_page(title, json.dumps(document).encode("utf-8"), {"kind": kind, "name": title})


def write_report(run: Run, output: Path, title: str = "") -> int:
    """Write the page with an embedded run to a file, and return the size of the file in bytes.

    :raises CxbridgeError: if the run cannot be read or the file cannot be written.
    """
    text = report(run, title).encode("utf-8")
    write_file(output, text)
    return len(text)


def make_page(title: str, data: bytes, embedded: Mapping[str, Any]) -> str:
    """Return the page as the text of one file.

    :param data: the bytes of the recording or the document.
    :param embedded: the description of the data: ``name``; for a recording also ``links``, ``notes`` and
        ``answers``, for a document also ``kind``.
    """
    modules = encode_for_script(
        {"imports": {name: _make_data_url(text) for name, text in _list_modules(embedded)}}
    )
    scripts = [make_base_script(), _START]
    style = "\n".join(map(_read_page_file, ("shared/base.css", *(f"css/{name}.css" for name in STYLES))))
    body = _read_page_file("index.html").partition("<body>")[2].partition("</body>")[0]
    policy = (
        "default-src 'none'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; "
        f"form-action 'none'; script-src 'strict-dynamic' {' '.join(map(hash_script, (modules, *scripts)))}"
    )
    return _FRAME.format(
        policy=policy,
        version=escape_html(VERSION),
        title=escape_html(title),
        style=style,
        icon=_make_data_url(_read_page_file("icon.svg"), "image/svg+xml"),
        modules=modules,
        body=body,
        # without the present time, so that equal data give equal pages
        data=b64encode(gzip.compress(data, mtime=0)).decode(),
        scripts="".join(f"<script>{script}</script>\n" for script in scripts),
    )


def _list_modules(embedded: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the modules of the page."""
    folder = STATIC_FOLDER / "js"
    for path in sorted(folder.rglob("*.js")):
        yield f"cx/{path.relative_to(folder).as_posix()}", path.read_text("utf-8")
    yield "shared/views.js", make_views_module()
    yield "shared/site.js", make_site_module((), embedded)


def _read_page_file(name: str) -> str:
    """Return the text of a file of the page."""
    return (STATIC_FOLDER / name).read_text("utf-8")


def _make_data_url(text: str, kind: str = "text/javascript") -> str:
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
    """Return the guessed pairs of plan-actions and skill calls, which the recording lacks.

    :returns: for each pair the environment, goal, plan and id of the action, then the Skiller, skill string,
        message id and begin (in microseconds) of the skill call.
    """
    start_us = history.clock.first_us or 0
    pairs = [(link.action, link.call) for link in find_skill_links(history) if link.is_guessed]
    return [
        [
            *(action.env, action.goal, action.plan, action.id),
            *(call.skiller, call.skill_string, call.msgid, start_us + call.begin.time),
        ]
        for action, call in pairs
    ]
