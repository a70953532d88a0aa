"""A real browser for the page: Chromium, driven by playwright. Tests skip where one is missing."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import FULL, needs_full
from tests.trace.html.browser import BROWSER
from web_tests.page.fake import FakeDaemon, Served

PHONE = {"width": 360, "height": 740}
DESK = {"width": 1280, "height": 800}
WAIT_MS = 15_000


FIREFOX = next(filter(None, map(shutil.which, ("firefox-esr", "firefox"))), None)
_ADAPTER = Path(__file__).with_name("firefox_adapter.py")

in_both = pytest.mark.parametrize(
    "browser", ["chromium", "firefox"] if FULL else ["chromium"], indirect=True, scope="module"
)
"""Marks tests that a second browser runs, too, with FULL."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave the page's stories to FULL; each run has the tests marked `smoke`: one test a view at least."""
    for item in items:
        if item.path.parent == Path(__file__).parent and item.get_closest_marker("smoke") is None:
            item.add_marker(needs_full)


class Browsers:
    """The browsers of the tests of the page, each started once, with one tab that its tests share.

    A browser takes a second of processor time to start and half a second for a new tab, more than most tests.
    """

    def __init__(self, playwright: Any, folder: Path) -> None:
        self._playwright = playwright
        self._folder = folder
        self._started: dict[str, Any] = {}
        self._tabs: dict[Any, Any] = {}

    def get(self, name: str) -> Any:
        """Return a browser by its name; start it first if need be."""
        if name not in self._started:
            self._started[name] = self._chromium() if name == "chromium" else self._firefox()
        return self._started[name]

    def tab(self, browser: Any) -> Any:
        """Return the tab of a browser, empty and as a new one."""
        page = self._tabs.pop(browser, None)
        if page is None:
            page = browser.new_context(viewport=DESK, reduced_motion="reduce").new_page()
        page.set_default_timeout(WAIT_MS)
        page.set_viewport_size(DESK)
        return page

    def give_back(self, browser: Any, page: Any) -> None:
        """Empty a tab, so that the next test can have it."""
        page.unroute_all()
        if page.url.startswith("http"):
            page.evaluate("() => { localStorage.clear(); sessionStorage.clear(); }")
        page.emulate_media(media="null", color_scheme="null", reduced_motion="reduce", forced_colors="null")
        page.goto("about:blank")
        page.context.clear_cookies()
        self._tabs[browser] = page

    def close(self) -> None:
        """End all of them."""
        for each in self._started.values():
            each.close()

    def _chromium(self) -> Any:
        return self._playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])

    def _firefox(self) -> Any:
        adapter = self._folder / "firefox"
        adapter.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{_ADAPTER}" "$@"\n', encoding="utf-8")
        adapter.chmod(0o755)
        environment = {**os.environ, "CXBRIDGE_FIREFOX": str(FIREFOX)}
        return self._playwright.firefox.launch(
            channel="moz-firefox", executable_path=adapter, env=environment
        )


@pytest.fixture(scope="package")
def browsers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browsers]:
    """Those of this folder: playwright keeps a loop running in the thread of its tests."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright (pip install playwright)")
    with sync_api.sync_playwright() as playwright:
        started = Browsers(playwright, tmp_path_factory.mktemp("browsers"))
        yield started
        started.close()


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest) -> Any:
    """Chromium, or another."""
    name = getattr(request, "param", os.environ.get("PAGE_BROWSER", "chromium"))
    if name == "chromium" and BROWSER is None:
        pytest.skip("needs chromium or google-chrome on the path")
    if name == "firefox" and FIREFOX is None:
        pytest.skip("needs firefox-esr or firefox on the path")
    return request.getfixturevalue("browsers").get(name)


@pytest.fixture
def errors() -> list[str]:
    """What went wrong within the page: exceptions, and what its policy refused."""
    return []


@pytest.fixture
def tab(browsers: Browsers, browser: Any, errors: list[str]) -> Iterator[Any]:
    """An empty tab; at the end nothing may have gone wrong in it.

    Tests take the same one in turn. One that adds scripts or a clock to its tab makes a separate context.
    """
    page = browsers.tab(browser)

    def note(text: str) -> None:
        if "load resource" not in text and "establish a connection" not in text:  # the tests' servers go away
            errors.append(text)

    listeners: dict[str, Callable[[Any], None]] = {
        "pageerror": lambda error: note(str(error)),
        "console": lambda line: note(line.text) if line.type == "error" else None,
        "request": lambda request: _no_stranger(request.url, errors),
    }
    for kind, listener in listeners.items():
        page.on(kind, listener)
    found = len(page.context.pages)
    yield page
    for kind, listener in listeners.items():
        page.remove_listener(kind, listener)
    if len(page.context.pages) == found:
        browsers.give_back(browser, page)
    else:  # the test opened, or closed, some
        page.context.close()
    assert errors == []


def _no_stranger(url: str, errors: list[str]) -> None:
    if not url.startswith(("http://127.0.0.1:", "data:", "blob:")):
        errors.append(f"asked for {url}")


@pytest.fixture
def daemon() -> FakeDaemon:
    return FakeDaemon()


@pytest.fixture(scope="package")
def server() -> Iterator[Served]:
    """What tests' daemons are behind, one after the other."""
    server = Served(FakeDaemon())
    yield server
    server.stop()


@pytest.fixture
def site(server: Served, daemon: FakeDaemon) -> Iterator[Served]:
    with server.of(daemon):
        yield server


def show_gone(tab: Any) -> None:
    """Let Goals show past goals; the page itself does so if there are no other goals."""
    box = tab.get_by_role("checkbox", name="past goals")

    def is_on() -> bool:
        if not box.is_checked():
            box.click()
        return bool(box.is_checked())

    wait_for(tab, is_on)


def is_firefox(tab: Any) -> bool:
    return bool(tab.context.browser.browser_type.name == "firefox")


def double_click(tab: Any, x: float, y: float) -> None:
    """Click twice at a place; playwright's clicks in Firefox make no double click."""
    tab.mouse.dblclick(x, y)
    if is_firefox(tab):
        tab.evaluate(
            """([clientX, clientY]) => document.elementFromPoint(clientX, clientY)
                 .dispatchEvent(new MouseEvent("dblclick", { clientX, clientY, bubbles: true }))""",
            [x, y],
        )


def wait_for(tab: Any, condition: Callable[[], bool]) -> None:
    """Wait until a condition of ours holds; the page keeps running."""
    for _ in range(WAIT_MS // 50):
        if condition():
            return
        tab.wait_for_timeout(50)
    raise AssertionError("did not happen in time")
