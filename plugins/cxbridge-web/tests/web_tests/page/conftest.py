"""Chromium, driven by playwright, for tests of the page; tests skip without Chromium."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import needs_full
from tests.trace.html.browser import BROWSER
from web_tests.page.fake import FakeDaemon, PageServer

PHONE = {"width": 360, "height": 740}
DESK = {"width": 1280, "height": 800}
WAIT_MS = 15_000


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave most tests to FULL; each run has the tests marked `smoke`, at least one for each view."""
    for item in items:
        if item.path.parent == Path(__file__).parent and item.get_closest_marker("smoke") is None:
            item.add_marker(needs_full)


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    """Chromium, started once for the folder, because playwright keeps a loop in the thread of its tests."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright (pip install playwright)")
    if BROWSER is None:
        pytest.skip("needs chromium or google-chrome on the path")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="package")
def free_tabs() -> list[Any]:
    """Empty tabs for the next tests: a new tab takes half a second of processor time."""
    return []


def empty(page: Any) -> None:
    """Bring a tab to the state of a new tab."""
    page.unroute_all()
    if page.url.startswith("http"):
        page.evaluate("() => { localStorage.clear(); sessionStorage.clear(); }")
    page.emulate_media(media="null", color_scheme="null", reduced_motion="reduce", forced_colors="null")
    page.goto("about:blank")
    page.context.clear_cookies()


@pytest.fixture
def errors() -> list[str]:
    """The errors of the page: exceptions, and requests that the page's policy refuses."""
    return []


@pytest.fixture
def tab(browser: Any, free_tabs: list[Any], errors: list[str]) -> Iterator[Any]:
    """An empty tab, which must have no errors at the end.

    Tests share tabs. A test that adds scripts or a clock opens a separate context.
    """
    page = free_tabs.pop() if free_tabs else browser.new_context(reduced_motion="reduce").new_page()
    page.set_default_timeout(WAIT_MS)
    page.set_viewport_size(DESK)

    def note_error(text: str) -> None:
        if "load resource" not in text and "establish a connection" not in text:  # tests stop their servers
            errors.append(text)

    listeners: dict[str, Callable[[Any], None]] = {
        "pageerror": lambda error: note_error(str(error)),
        "console": lambda line: note_error(line.text) if line.type == "error" else None,
        "request": lambda request: note_foreign_request(request.url, errors),
    }
    for kind, listener in listeners.items():
        page.on(kind, listener)
    page_count = len(page.context.pages)
    yield page
    for kind, listener in listeners.items():
        page.remove_listener(kind, listener)
    if len(page.context.pages) == page_count:
        empty(page)
        free_tabs.append(page)
    else:  # the test has opened or closed pages
        page.context.close()
    assert errors == []


def note_foreign_request(url: str, errors: list[str]) -> None:
    if not url.startswith(("http://127.0.0.1:", "data:", "blob:")):
        errors.append(f"request to {url}")


@pytest.fixture
def daemon() -> FakeDaemon:
    return FakeDaemon()


@pytest.fixture(scope="package")
def server() -> Iterator[PageServer]:
    """The server that serves the daemons of tests, one after another."""
    server = PageServer(FakeDaemon())
    yield server
    server.stop()


@pytest.fixture
def site(server: PageServer, daemon: FakeDaemon) -> Iterator[PageServer]:
    with server.serve(daemon):
        yield server


def show_past_goals(tab: Any) -> None:
    """Let the view Goals show past goals, which it does by itself only without present goals."""
    box = tab.get_by_role("checkbox", name="past goals")

    def is_on() -> bool:
        if not box.is_checked():
            box.click()
        return bool(box.is_checked())

    wait_for(tab, is_on)


def wait_for(tab: Any, condition: Callable[[], bool]) -> None:
    """Wait until a condition holds, while the page keeps running."""
    for _ in range(WAIT_MS // 50):
        if condition():
            return
        tab.wait_for_timeout(50)
    raise AssertionError("the condition does not hold in time")
