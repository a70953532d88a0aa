"""The extension in VS Code itself: code-server in a browser, where CODE_SERVER names its program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from studio_tests.dap.vscode import PACKED, open_file, program, tour, visit
from tests.trace.html.browser import BROWSER

pytest.importorskip("playwright", reason="needs playwright (pip install playwright)")


@pytest.fixture
def code() -> Path:
    """The program of code-server."""
    found = program()
    if found is None or BROWSER is None or not PACKED.is_file():
        pytest.skip("needs code-server (CODE_SERVER), chromium, and the extension that `make editor` packs")
    return found


def test_a_typo_its_fix_and_a_breakpoint(code):
    seen: list[str] = []
    visit(code, lambda page, address: tour(page, address, seen.append))
    assert seen == ["vscode-mistake", "vscode-completion", "vscode-breakpoint"]


def test_a_program_that_is_not_there_is_named(code):
    def press_f5(page: Any, address: str) -> None:
        open_file(page, address)
        said = page.locator(".notification-toast", has_text="There is no program 'no-such-cxbridge'")
        said.first.wait_for()  # the language server's
        page.keyboard.press("Escape")
        page.locator(".notifications-toasts.visible").wait_for(state="hidden")
        page.locator(".editor-instance .view-line").first.click()
        page.keyboard.press("F5")
        said.first.wait_for()

    visit(code, press_f5, cxbridge__command="no-such-cxbridge")
