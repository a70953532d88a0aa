"""Addresses of the page: tabs that are files, old and unknown addresses, and the selection in the address."""

from __future__ import annotations

import re
from contextlib import contextmanager
from shutil import copytree

import pytest

from cxbridge_web import pages
from web_tests.page.fake import FakeDaemon, goal_model, served

VIEW = """
export const tab = { title: "Weather", order: 15 };
export const kinds = [];
export function open(main) {
  main.append(Object.assign(document.createElement("h2"), { textContent: "Weather here" }));
  return { go() {}, close() {} };
}
"""


@contextmanager
def page_of(tmp_path, monkeypatch, views):
    """A server whose page has other views, too: their texts by name."""
    folder = tmp_path / "static"
    copytree(pages.STATIC_FOLDER, folder, dirs_exist_ok=True)
    for name, text in views.items():
        (folder / "js" / "views" / f"{name}.js").write_text(text, encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(pages, "STATIC_FOLDER", folder)
        with served(FakeDaemon()) as site:
            yield site


def test_a_tab_is_one_file(tab, site, tmp_path, monkeypatch):
    """A file in the folder of views is a tab; without it there is none."""
    with page_of(tmp_path, monkeypatch, {"weather": VIEW}) as site_with_tab:
        tab.goto(site_with_tab.url)
        tab.click("#nav >> text=Weather")
        tab.wait_for_selector("#main h2 >> text=Weather here")
        assert tab.title().startswith("Weather ")
    tab.goto(f"{site.url}#/weather")
    tab.wait_for_selector("#not-found >> text=#/weather")
    assert tab.locator("#nav >> text=Weather").count() == 0


def test_a_view_that_cannot_be_loaded_does_not_take_the_others_along(tab, tmp_path, monkeypatch, errors):
    with page_of(tmp_path, monkeypatch, {"log": "}"}) as site:
        tab.goto(f"{site.url}#/goals")
        tab.wait_for_selector(".toast >> text=The view log cannot be shown")
        tab.wait_for_selector("#main h2 >> text=Goals")


def test_an_unknown_address_says_so_and_has_links(tab, site):
    tab.goto(f"{site.url}#/nowhere/at/all")
    tab.wait_for_selector("#not-found >> text=There is no view at #/nowhere/at/all")
    assert tab.url.endswith("#/nowhere/at/all")
    tab.click("#not-found a >> text=Log")
    tab.wait_for_selector("#main h2 >> text=Log")


@pytest.mark.smoke
def test_the_address_holds_what_is_selected(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [goal_model("A"), goal_model("B")]
    tab.goto(f"{site.url}#/goals")
    tab.click("[role=treeitem] >> text=A")
    tab.wait_for_url(re.compile("#/goals/A$"))
    tab.click("#nav >> text=Log")
    tab.wait_for_url(re.compile(r"#/log\?goal=A$"))
    tab.reload()
    tab.click("#nav >> text=Goals")
    tab.wait_for_selector("#goal h2:text-is('A')")
    heard = tab.evaluate(
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
    assert heard == [[["action"], ["goal", "action"]], ""]
    tab.wait_for_selector("#goal h2:text-is('B')")
