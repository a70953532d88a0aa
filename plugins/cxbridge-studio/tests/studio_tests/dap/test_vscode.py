"""The extension in code-server, where CODE_SERVER names the program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from studio_tests.dap.vscode import PACKED, find_code_server, open_file, tour, visit
from tests.trace.html.browser import BROWSER

pytest.importorskip("playwright", reason="needs playwright (pip install playwright)")


@pytest.fixture
def code() -> Path:
    """The path of code-server."""
    path = find_code_server()
    if path is None or BROWSER is None or not PACKED.is_file():
        pytest.skip("needs code-server (CODE_SERVER), chromium, and the extension that `make editor` packs")
    return path


def test_vscode_shows_mistake_completion_and_breakpoint(code):
    pictures: list[str] = []
    visit(code, lambda page, address: tour(page, address, pictures.append))
    assert pictures == ["vscode-mistake", "vscode-completion", "vscode-breakpoint"]


def test_missing_program_is_reported(code):
    def press_f5(page: Any, address: str) -> None:
        open_file(page, address)
        notification = page.locator(".notification-toast", has_text="There is no program 'no-such-cxbridge'")
        notification.first.wait_for()  # the notification of the language server
        page.keyboard.press("Escape")
        page.locator(".notifications-toasts.visible").wait_for(state="hidden")
        page.locator(".editor-instance .view-line").first.click()
        page.keyboard.press("F5")
        notification.first.wait_for()

    visit(code, press_f5, cxbridge__command="no-such-cxbridge")
