"""Drives code-server in a browser with the extension: a typo, its fix, and a breakpoint in a rule.

``CODE_SERVER=/path/to/code-server python -m studio_tests.dap.vscode`` makes the pictures of docs/editors.md;
``make editor`` must pack the extension before.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from tests.support import ROOT
from tests.trace.html.browser import BROWSER

PACKED: Final = ROOT / "out" / "cxbridge.vsix"
IMAGES: Final = ROOT / "docs" / "images"
FILE: Final = "talk-goals.clp"
PATIENCE_MS: Final = 180_000
_RULE: Final = "(defrule talk-root-goes-on"
_SLOT: Final = "(mode ?mode"
_SETTINGS: Final = {
    "cxbridge.command": str(Path(sys.executable).with_name("cxbridge")),
    "telemetry.telemetryLevel": "off",
    "extensions.autoCheckUpdates": False,
    "workbench.startupEditor": "none",
    "workbench.enableExperiments": False,
    "window.commandCenter": False,
    "editor.minimap.enabled": False,
    "editor.autoClosingBrackets": "never",
    "editor.quickSuggestions": {"other": "off", "comments": "off", "strings": "off"},
}

Shoot = Callable[[str], object]
"""Takes a picture with a name."""


def find_code_server() -> Path | None:
    """Return the path in CODE_SERVER, or None if there is no such file."""
    path = Path(os.environ.get("CODE_SERVER", ""))
    return path if path.is_file() else None


@contextmanager
def code_server(code: Path, folder: Path, settings: Mapping[str, object]) -> Iterator[str]:
    """Serve a copy of the test scenario; yield the address of the page."""
    changed = {name.replace("__", "."): value for name, value in settings.items()}
    agent = folder / "agent"
    shutil.copytree(ROOT / "scenarios" / "test-scenario", agent)
    data = folder / "data"
    for level in ("User", "Machine"):  # programs are settings of the machine
        (data / level).mkdir(parents=True)
        (data / level / "settings.json").write_text(json.dumps({**_SETTINGS, **changed}))
    command = [*([shutil.which("node") or "node"] if code.suffix == ".js" else []), str(code)]
    command += ["--config", str(folder / "config.yaml"), "--user-data-dir", str(data)]
    command += ["--extensions-dir", str(folder / "extensions")]
    environment = {**os.environ, "EXTENSIONS_GALLERY": "{}"}
    subprocess.run([*command, "--install-extension", str(PACKED)], check=True, stdout=2, env=environment)
    command += ["--auth", "none", "--bind-addr", "127.0.0.1:0", "--disable-telemetry"]
    command += ["--disable-update-check", "--disable-workspace-trust", str(agent)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as server:
        try:
            yield f"{_address(server.stdout)}?folder={agent}"
        finally:
            server.terminate()


def _address(lines: Iterable[str] | None) -> str:
    """Return the address in the output of the server."""
    matches = (re.search(r"server listening on (http://\S+)", line) for line in lines or ())
    return next(match[1] for match in matches if match)


def tour(page: Any, address: str, shoot: Shoot) -> None:
    """Make a typo, fix the typo by completion, stop at a breakpoint, and end the run."""
    open_file(page, address)
    text = (ROOT / "scenarios" / "test-scenario" / FILE).read_text()
    _type_slot(page, text, "mood")
    page.wait_for_selector(".squiggly-error")
    page.keyboard.press("F8")
    page.wait_for_selector(".marker-widget", state="visible")
    shoot("vscode-mistake")
    page.keyboard.press("Escape")
    page.wait_for_selector(".marker-widget", state="detached")
    _move_cursor(page, text, _SLOT, len("(mode"))
    for _ in "od":
        page.keyboard.press("Backspace")
    page.keyboard.press("Control+Space")
    page.wait_for_selector(".suggest-widget.visible .monaco-list-row.focused >> text=mode")
    shoot("vscode-completion")
    page.keyboard.press("Enter")
    page.wait_for_selector(".squiggly-error", state="detached")
    page.keyboard.press("Control+s")
    _move_cursor(page, text, _RULE, 0)
    page.keyboard.press("F9")
    page.wait_for_selector(".codicon-debug-breakpoint")
    page.keyboard.press("F5")
    page.wait_for_selector(".debug-top-stack-frame-line")
    page.wait_for_selector(".debug-variables >> text=?mode")
    shoot("vscode-breakpoint")
    page.keyboard.press("Shift+F5")
    page.wait_for_selector(".debug-toolbar", state="hidden")


def open_file(page: Any, address: str) -> None:
    """Open a CLIPS file of the agent."""
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    page.locator(".explorer-folders-view .monaco-list-row", has_text=FILE).dblclick()
    page.locator(".editor-instance .view-line").first.click()


def _move_cursor(page: Any, text: str, target: str, offset_in_target: int) -> None:
    """Move the cursor by "Go to Line" to a number of characters behind the start of a text."""
    offset = text.index(target) + offset_in_target
    line, column = text.count("\n", 0, offset) + 1, offset - text.rfind("\n", 0, offset)
    page.keyboard.press("Control+g")
    page.wait_for_selector(".quick-input-widget input", state="visible")
    page.keyboard.type(f"{line}:{column}")
    page.keyboard.press("Enter")
    page.wait_for_selector(f".statusbar >> text=Ln {line}, Col {column}")


def _type_slot(page: Any, text: str, name: str) -> None:
    _move_cursor(page, text, _SLOT, len("(mode"))
    for _ in "mode":
        page.keyboard.press("Backspace")
    page.keyboard.type(name)


def visit(code: Path, action: Callable[[Any, str], object], **settings: object) -> None:
    """Serve VS Code, and call a function with the page and the address.

    :param settings: overlay the settings of the machine; ``__`` in a name is a dot.
    """
    from playwright.sync_api import sync_playwright

    with (
        tempfile.TemporaryDirectory() as folder,
        code_server(code, Path(folder), settings) as address,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        action(browser.new_page(viewport={"width": 1000, "height": 640}, reduced_motion="reduce"), address)
        browser.close()


def main() -> int:
    """Make the pictures."""
    code = find_code_server()
    if code is None:
        sys.stderr.write("CODE_SERVER must name code-server\n")
        return 2
    visit(
        code,
        lambda page, address: tour(page, address, lambda name: page.screenshot(path=IMAGES / f"{name}.png")),
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
