"""A real browser for the page: Chromium, driven by playwright. Tests skip where one is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.trace.html.browser import BROWSER
from tests.web.page.fake import FakeDaemon, Served, served

PHONE = {"width": 360, "height": 740}
DESK = {"width": 1280, "height": 800}
WAIT_MS = 15_000


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium; for one module: playwright keeps a loop running in the thread of the tests meanwhile."""
    if BROWSER is None:
        pytest.skip("needs chromium or google-chrome on the path")
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright (pip install playwright)")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield chromium
        chromium.close()


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
