"""Addresses of the page: tabs, unknown addresses, and the selection."""

from __future__ import annotations

import re
from contextlib import contextmanager
from shutil import copytree

import pytest

from cxbridge_web import pages
from web_tests.page.fake import FakeDaemon, goal_model, serve_daemon

VIEW = """
export const tab = { title: "Weather", order: 15 };
export const kinds = [];
export function open(main) {
  main.append(Object.assign(document.createElement("h2"), { textContent: "Weather here" }));
  return { go() {}, close() {} };
}
"""


@contextmanager
def serve_page_with(tmp_path, monkeypatch, views):
    """Serve the page with additional or replaced views, given as texts by name."""
    folder = tmp_path / "static"
    copytree(pages.STATIC_FOLDER, folder, dirs_exist_ok=True)
    for name, text in views.items():
        (folder / "js" / "views" / f"{name}.js").write_text(text, encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(pages, "STATIC_FOLDER", folder)
        with serve_daemon(FakeDaemon()) as site:
            yield site


def test_file_in_folder_of_views_is_tab(tab, site, tmp_path, monkeypatch):
    with serve_page_with(tmp_path, monkeypatch, {"weather": VIEW}) as site_with_tab:
        tab.goto(site_with_tab.url)
        tab.click("#nav >> text=Weather")
        tab.wait_for_selector("#main h2 >> text=Weather here")
        assert tab.title().startswith("Weather ")
    tab.goto(f"{site.url}#/weather")
    tab.wait_for_selector("#not-found >> text=#/weather")
    assert tab.locator("#nav >> text=Weather").count() == 0


def test_broken_view_does_not_affect_further_views(tab, tmp_path, monkeypatch, errors):
    with serve_page_with(tmp_path, monkeypatch, {"log": "}"}) as site:
        tab.goto(f"{site.url}#/goals")
        tab.wait_for_selector(".toast >> text=The view log cannot be shown")
        tab.wait_for_selector("#main h2 >> text=Goals")


def test_unknown_address_shows_error_with_links(tab, site):
    tab.goto(f"{site.url}#/nowhere/at/all")
    tab.wait_for_selector("#not-found >> text=There is no view at #/nowhere/at/all")
    assert tab.url.endswith("#/nowhere/at/all")
    tab.click("#not-found a >> text=Log")
    tab.wait_for_selector("#main h2 >> text=Log")


@pytest.mark.smoke
def test_address_has_selection(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [goal_model("A"), goal_model("B")]
    tab.goto(f"{site.url}#/goals")
    tab.click("[role=treeitem] >> text=A")
    tab.wait_for_url(re.compile("#/goals/A$"))
    tab.click("#nav >> text=Log")
    tab.wait_for_url(re.compile(r"#/log\?goal=A$"))
    tab.reload()
    tab.click("#nav >> text=Goals")
    tab.wait_for_selector("#goal h2:text-is('A')")
    changes = tab.evaluate(
        """async () => {
          const { app } = await import("cx/app.js");
          const heard = [];
          app.addEventListener("select", (event) => heard.push([...event.detail.changed]));
          app.select({ action: "2" });
          app.select({ action: "2" });
          app.select({ goal: "B" });
          return [heard, app.selection.value.action];
        }"""
    )
    assert changes == [[["action"], ["goal", "action"]], ""]
    tab.wait_for_selector("#goal h2:text-is('B')")
