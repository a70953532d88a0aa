"""A headless browser for the tests of pages, which are skipped without a browser."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="needs chromium or google-chrome on the path")
_CONSOLE = re.compile(r":CONSOLE[^\]]*\] (.*)")


@dataclass
class RenderedPage:
    """A page after its scripts.

    :param dom: the document after its scripts.
    :param console: the lines of the console: errors, and refusals by the policy.
    """

    dom: str
    console: list[str]


def _run(profile: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    assert BROWSER is not None
    command = [
        BROWSER,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        f"--user-data-dir={profile}",
        *arguments,
    ]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)


def show(page: Path, profile: Path, *, fragment: str = "") -> RenderedPage:
    """Open a page, let its scripts run, and return the result."""
    process = _run(
        profile,
        "--enable-logging=stderr",
        "--virtual-time-budget=4000",
        "--dump-dom",
        page.as_uri() + fragment,
    )
    return RenderedPage(process.stdout, _CONSOLE.findall(process.stderr))
