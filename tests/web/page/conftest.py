"""A real browser for the page: Chromium, driven by playwright. Tests skip where one is missing."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.trace.html.browser import BROWSER
from tests.web.page.fake import FakeDaemon, Served, served

PHONE = {"width": 360, "height": 740}
DESK = {"width": 1280, "height": 800}
WAIT_MS = 15_000


FIREFOX = next(filter(None, map(shutil.which, ("firefox-esr", "firefox"))), None)
_ADAPTER = Path(__file__).with_name("firefox_adapter.py")

in_both = pytest.mark.parametrize("browser", ["chromium", "firefox"], indirect=True, scope="module")
"""Marks tests that a second browser runs, too."""


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Chromium, or another; for one module: playwright keeps a loop running in the thread of the tests."""
    name = getattr(request, "param", os.environ.get("PAGE_BROWSER", "chromium"))
    if name == "chromium" and BROWSER is None:
        pytest.skip("needs chromium or google-chrome on the path")
    if name == "firefox" and FIREFOX is None:
        pytest.skip("needs firefox-esr or firefox on the path")
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright (pip install playwright)")
    with sync_api.sync_playwright() as playwright:
        if name == "chromium":
            launched = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        else:
            adapter = tmp_path_factory.mktemp("firefox") / "firefox"
            adapter.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{_ADAPTER}" "$@"\n', encoding="utf-8")
            adapter.chmod(0o755)
            environment = {**os.environ, "CXBRIDGE_FIREFOX": str(FIREFOX)}
            launched = playwright.firefox.launch(
                channel="moz-firefox", executable_path=adapter, env=environment
            )
        yield launched
        launched.close()


@pytest.fixture
def errors() -> list[str]:
    """What went wrong within the page: exceptions, and what its policy refused."""
    return []


@pytest.fixture
def tab(browser: Any, errors: list[str]) -> Iterator[Any]:
    """An empty tab; at the end nothing may have gone wrong in it."""
    context = browser.new_context(viewport=DESK, reduced_motion="reduce")
    context.set_default_timeout(WAIT_MS)
    page = context.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on(
        "console",
        lambda line: (
            errors.append(line.text) if line.type == "error" and "load resource" not in line.text else None
        ),
    )
    page.on("request", lambda request: _no_stranger(request.url, errors))
    yield page
    context.close()
    assert errors == []


def _no_stranger(url: str, errors: list[str]) -> None:
    if not url.startswith(("http://127.0.0.1:", "data:", "blob:")):
        errors.append(f"asked for {url}")


@pytest.fixture
def daemon() -> FakeDaemon:
    return FakeDaemon()


@pytest.fixture
def site(daemon: FakeDaemon) -> Iterator[Served]:
    with served(daemon) as server:
        yield server


def wait_for(tab: Any, condition: Callable[[], bool]) -> None:
    """Wait until a condition of ours holds; the page goes on meanwhile."""
    for _ in range(WAIT_MS // 50):
        if condition():
            return
        tab.wait_for_timeout(50)
    raise AssertionError("did not happen in time")
