"""Renders the page that reports on runs share: one file, no requests, light and dark, screen and paper."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from importlib import resources
from pathlib import Path
from typing import Any

from cxbridge.file_access import write_file
from cxbridge.history.outcome import plain_outcomes
from cxbridge.resources import VERSION
from cxbridge.trace.html.text import embed, html

DATA = "data"
"""Id of the element that holds the page's data as JSON."""


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page that can be jumped to.

    :param ident: its anchor, letters only.
    :param body: HTML, made with :mod:`cxbridge.trace.html.parts`.
    """

    ident: str
    title: str
    body: str


@dataclass(frozen=True, slots=True)
class Page:
    """A page.

    :param title: what it is about, plain text.
    :param lead: HTML below the title.
    :param bar: HTML that stays in sight, with the links to the sections.
    :param data: what the scripts get, as JSON knows it.
    :param styles: CSS besides the shared one.
    :param scripts: JavaScript besides the shared one; each runs when the whole page is there. The shared one
        offers ``cx``: see base.js.
    """

    title: str
    lead: str = ""
    bar: str = ""
    sections: Sequence[Section] = field(default_factory=tuple)
    data: Any = None
    styles: Sequence[str] = field(default_factory=tuple)
    scripts: Sequence[str] = field(default_factory=tuple)

    def render(self) -> str:
        """Return the page."""
        style = "\n".join((asset("base.css"), *self.styles))
        script = "\n".join((base_script(), *self.scripts))
        links = "".join(f'<a href="#{each.ident}">{html(each.title)}</a>' for each in self.sections)
        body = "".join(
            f'<section id="{each.ident}" aria-labelledby="h-{each.ident}">'
            f'<h2 id="h-{each.ident}">{html(each.title)}</h2>{each.body}</section>\n'
            for each in self.sections
        )
        return _FRAME.format(
            policy=_policy(style, script),
            title=html(self.title),
            style=style,
            script=script,
            lead=self.lead,
            links=links,
            bar=self.bar,
            body=body,
            data_id=DATA,
            data=embed(self.data),
            version=html(VERSION),
        )

    def write(self, file: Path) -> None:
        """Write the page to a file.

        :raises CxbridgeError: when it cannot be written.
        """
        write_file(file, self.render())


def asset(name: str, package: str = "cxbridge.trace.html") -> str:
    """Return a CSS or JavaScript file that is installed next to the code of a package."""
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def base_script() -> str:
    """Return what all pages share: ``cx``, with the outcomes of goals, actions and skills."""
    outcomes = json.dumps(plain_outcomes(), ensure_ascii=False)
    return asset("base.js").replace("{/* outcomes */}", outcomes)


def _policy(style: str, script: str) -> str:
    """Return the content security policy: this style and this script run, and nothing is fetched."""
    return (
        f"default-src 'none'; style-src {_digest(style)}; script-src {_digest(script)}; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    """Return how a content security policy names an inline element."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


_FRAME = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="cxbridge {version}">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<a class="skip" href="#main">Skip to the content</a>
<header><h1>{title}</h1>{lead}</header>
<div class="top"><nav aria-label="Sections">{links}</nav>{bar}</div>
<noscript><p class="note">This page needs JavaScript to draw. It fetches nothing.</p></noscript>
<main id="main">
{body}</main>
<footer>Made by cxbridge {version}</footer>
<script type="application/json" id="{data_id}">{data}</script>
<script>{script}</script>
</body>
</html>
"""
