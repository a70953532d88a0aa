"""Makes the page about a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from cxbridge.clock import MICROSECONDS
from cxbridge.file_access import write_file
from cxbridge.history.keeping import cut
from cxbridge.history.linking import links
from cxbridge.history.model import goal_forest
from cxbridge.history.outcome import goal_outcome
from cxbridge.trace.formats.base import Attachment, Run
from cxbridge.trace.html.page import Page, Section, asset
from cxbridge.trace.html.parts import badge, notes, pairs, table
from cxbridge.trace.html.text import html
from cxbridge_web.report.model import ReportLimits, RunModel
from cxbridge_web.report.modules import bundle
from cxbridge_web.report.reading import LONGEST_VALUE, read

SCRIPTS = ("data.js", "lists.js", "timeline.js", "report.js")
SHARED_SCRIPT = "timeline/report.js"
"""The module of the page that a report begins with: the timeline is the page's own."""
SHARED_STYLES = ("parts", "outcomes", "timeline")
"""The page's styles that belong to it."""
ATTACHED_FILE = 64 * 1024
ATTACHED_ALL = 2 * 1024 * 1024
"""How many bytes of one attached file, and of all of them, the page shows; larger ones are only named."""


def report(run: Run, title: str = "", limits: ReportLimits | None = None) -> str:
    """Return a page about a run.

    :param title: its heading; empty: the name of the run.
    :raises TraceError: when the run cannot be read.
    """
    model = read(run, limits)
    return Page(
        title=title or f"Run {run.path.name}",
        lead=_lead(model, run.metadata()) + notes(_remarks(model)),
        bar=_asset("bar.html"),
        sections=list(_sections(run, model)),
        data=page_data(model),
        styles=[*(_shared_style(name) for name in SHARED_STYLES), _asset("report.css")],
        scripts=[bundle(SHARED_SCRIPT), *(_asset(name) for name in SCRIPTS)],
    ).render()


def write_report(run: Run, output: Path, title: str = "") -> int:
    """Write a page about a run to a file, and return its size in bytes.

    :raises CxbridgeError: when the run cannot be read, or the file not written.
    """
    text = report(run, title).encode("utf-8")
    write_file(output, text)
    return len(text)


def _asset(name: str) -> str:
    """Return a file of this package."""
    return asset(name, "cxbridge_web.report")


def _shared_style(name: str) -> str:
    """Return a style sheet of the page."""
    return asset(f"static/css/{name}.css", "cxbridge_web")


def _remarks(model: RunModel) -> list[str]:
    """Return the warnings for the reader, with the missing data."""
    missing = []
    if not model.history.events:
        missing = ["The recording has no events."]
    elif not model.history.goals:
        missing = ["The recording has no goals."]
    return [*model.notes, *missing]


def _lead(model: RunModel, metadata: Mapping[str, str]) -> str:
    """Return the run in a line."""
    history = model.history
    roots = [history.goals[number] for number in goal_forest(history.goals).roots]
    ends = Counter((goal.mode, goal.outcome) for goal in roots)
    outcomes = Counter[str]()
    for (mode, outcome), count in ends.items():
        outcomes[outcome if outcome not in {"", "UNKNOWN"} else f"still {mode}"] += count
    facts = {
        "took": f"{history.end / MICROSECONDS:.3f} s",
        "events": str(history.events),
        "goals": str(len(history.goals)),
        "plan-actions": str(len(history.actions)),
        "skills run": str(len(history.calls)),
        "rules fired": str(sum(rule.count for rule in model.rules)),
    }
    items = "".join(f"<span>{html(name)} <b>{html(value)}</b></span>" for name, value in facts.items())
    badges = " ".join(
        f"{badge(goal_outcome('FINISHED', outcome), outcome)} {count}" for outcome, count in outcomes.items()
    )
    reason = metadata.get("reason", "")
    said = f"<p>{html(reason)}</p>" if reason else ""
    return f'{said}<p class="summary">{items}{"<span>root goals " + badges + "</span>" if badges else ""}</p>'


def _sections(run: Run, model: RunModel) -> Iterator[Section]:
    """Yield the sections of the page."""
    yield Section("timeline", "Timeline", '<div id="timeline-place"></div>')
    yield Section(
        "state",
        "Moment",
        '<p class="dim" id="now-at" role="status"></p><div id="now" class="now-grid"></div>',
    )
    yield Section("skills", "Skills", '<div id="skill-table"></div>')
    hint = '<p class="dim"><code>cxbridge coverage</code> lists the rules that never fired.</p>'
    yield Section("rules", "Rules", f'{hint if model.rules else ""}<div id="rule-table"></div>')
    yield Section("log", "Log", _asset("log.html"))
    values = '<p class="dim">Values are those at the chosen moment.</p>' if model.interfaces else ""
    yield Section("interfaces", "Interfaces", f'{values}<div id="interface-list"></div>')
    yield Section("about", "Recording", _about(run, model))


def _about(run: Run, model: RunModel) -> str:
    """Return where the run comes from, and the files that came with it."""
    facts = {"file": run.path.name, "format": run.format, "events": str(model.history.events)}
    body = pairs({**facts, **run.metadata()})
    shown, rows, room = [], [], ATTACHED_ALL
    for file in run.attachments():
        text = _text_of(file) if len(file.data) <= min(room, ATTACHED_FILE) else None
        rows.append(
            [
                html(file.name),
                html(file.media_type),
                str(len(file.data)),
                "" if text is not None else "not shown",
            ]
        )
        if text is not None:
            room -= len(file.data)
            shown.append(f"<details><summary>{html(file.name)}</summary><pre>{html(text)}</pre></details>")
    if rows:
        listed = table(["name", "type", "bytes", ""], rows, numbers=[2])
        body += f"<h3>Attached files</h3><details><summary>{len(rows)} files</summary>{listed}</details>"
    return body + "".join(shown)


def _text_of(file: Attachment) -> str | None:
    """Return an attached file as text, None when it is none."""
    try:
        return file.data.decode("utf-8")
    except UnicodeDecodeError:
        return None


def page_data(model: RunModel) -> dict[str, Any]:
    """Return the data for the scripts; data.js knows the places of the values."""
    history = model.history
    numbers = {id(call): number for number, call in enumerate(history.calls)}
    return {
        "links": [[link.action.number, numbers[id(link.call)], link.guessed] for link in links(history)],
        "events": history.events,
        "end": history.end,
        "goals": [
            [
                goal.id,
                goal.goal_class,
                goal.sub_type,
                goal.env,
                parent,
                [change[:-1] for change in goal.changes],
            ]
            for goal, parent in zip(history.goals, goal_forest(history.goals).parents.values(), strict=True)
        ],
        "actions": [
            [
                None if each.goal_record is None else each.goal_record.number,
                each.goal,
                each.plan,
                each.id,
                each.text,
                each.env,
                each.changes,
            ]
            for each in history.actions
        ],
        "calls": [
            [
                each.env,
                each.skiller,
                each.skill_string,
                each.msgid,
                *each.begin,
                *(each.end or (None, None)),
                each.status,
                cut(each.error, LONGEST_VALUE),
            ]
            for each in history.calls
        ],
        "spans": [
            [each.name, each.goal, *each.begin, *(each.end or (None, None)), each.status, each.text]
            for each in history.planner_calls
        ],
        "rules": [[each.env, each.name, each.count, *each.first, *each.last] for each in model.rules],
        "firings": [number for firing in model.firings.items() for number in firing],
        "components": model.components,
        "log": _lines(model),
        "interfaces": [
            [each.uid, each.writes, each.changes, each.messages, each.first, each.last]
            for each in model.interfaces
        ],
        "changes": model.changes.items(),
        "messages": model.messages.items(),
        "facts": [number for point in model.facts for number in point],
    }


def _lines(model: RunModel) -> list[list[Any]]:
    """Return the log in order: seq, time, level, component, text; for a gap seq, time, count, level."""
    rows: list[list[Any]] = []
    for level, kept in model.log.items():
        for place, (seq, time, component, text) in enumerate(kept.items()):
            if place == kept.gap:
                rows.append([seq, time, kept.lost, level])
            rows.append([seq, time, level, component, text])
    return sorted(rows, key=lambda row: (row[0], len(row)))
