"""The reference is complete: the pages describe all parts of the source."""

from __future__ import annotations

import importlib
import json
import os
import re
from pkgutil import resolve_name
from typing import Any

import pytest
import yaml

from cxbridge.config import Configuration
from cxbridge.daemon.settings import DaemonSettings
from cxbridge.errors import ConfigError
from tests.docs.config_keys import fixed_lists, keys_that_are_read
from tests.docs.pages import PAGES, name_of
from tests.support import ROOT, SHARED, module_files, needs_shared

DOCS = ROOT / "docs"
MOST_PAGES = 40
"""The pages of the manual that a person can read; evidence does not count."""

FUNCTIONS = (
    r'(?:define\(\s*|^ +\()"((?:ff|blackboard|config|robmem|bson|pb|tf|navgraph|motor|planner|skill-board|'
    r'parse|map)-[a-z-]+)"'
)
"""How the source names a function for CLIPS."""


def page(name: str) -> str:
    return (DOCS / name).read_text()


# configuration


def daemon_samples() -> list[tuple[str, str]]:
    """The samples of a daemon's configuration: page, text."""
    found = []
    for path in sorted(DOCS.rglob("*.md")):
        blocks = re.findall(r"^```yaml\n(.*?)^```", path.read_text(), re.DOTALL | re.MULTILINE)
        found += [(path.name, block) for block in blocks if re.search(r"^cxbridge:", block, re.MULTILINE)]
    return found


@pytest.mark.parametrize(("name", "text"), daemon_samples(), ids=[name for name, _ in daemon_samples()])
def test_daemon_accepts_samples(name, text):
    """``web: {}`` was shown, and refused."""
    absent = ""
    try:
        DaemonSettings.from_config(Configuration.from_text(text, str(DOCS / name)))
    except ConfigError as error:
        absent = error.message  # of a file that the sample names
    assert not absent or absent.endswith("the file does not exist")


def documented_keys() -> list[str]:
    """The keys of the table, with ``*`` for words in capitals and for ``...``."""
    section = page("configuration.md").partition("## All keys")[2].partition("\n## ")[0]
    keys = re.findall(r"`(/[^`]+)`", section)
    return [re.sub(r"(?<=/)(?:[A-Z]+|\.\.\.)(?=/|$)", "*", key) for key in keys]


def is_documented(key: str, known: list[str]) -> bool:
    """A key that ends in ``/``, or in a folder of the table, is read as a whole."""
    pattern = ".*".join(re.escape(part) for part in key.rstrip("/").split("*"))
    return any(re.fullmatch(pattern + r"(?:/.*)?", one) for one in known)


def test_configuration_md_has_every_key():
    known = documented_keys()
    read = keys_that_are_read()
    assert {"/planner/timeout", "/cxbridge/agents/*/spec", "/skiller/skillspace"} <= read.keys()
    assert {key: place for key, place in read.items() if key != "/" and not is_documented(key, known)} == {}
    assert [key for key in fixed_lists() if not is_documented(key, known)] == []


@pytest.mark.parametrize("key", ["/planner/none", "*/none", "/none/"])
def test_undocumented_key_is_found(key):
    assert not is_documented(key, documented_keys())


# features and functions

FEATURE = re.compile(r"^class \w+Feature\(.*Feature\):|^class \w+Feature\(Feature", re.MULTILINE)


def test_features_md_has_every_feature():
    text = page("features.md")
    names = {
        name
        for file in module_files().values()
        # the page is about this executive; ros2_cx has the features of the executive for ROS 2
        if FEATURE.search(code := file.read_text()) and "cxbridge_ros2cx" not in file.parts
        for name in re.findall(r'^    name = "([\w-]+)"', code, re.MULTILINE)
    }
    assert len(names) > 10
    assert [name for name in names if f"`{name}`" not in text.partition("\n## ")[0]] == []


def test_features_md_has_every_function_of_cxbridge():
    text = page("features.md")
    names = {
        name
        for file in module_files().values()
        if file.parent.name in ("feature", "features", "executive")
        or file.name in ("feature.py", "problem_expert.py")
        for name in re.findall(FUNCTIONS, file.read_text(), re.MULTILINE)
    }
    assert len(names) > 80
    assert [name for name in sorted(names) if not re.search(rf"`\(?{name}[ )`]", text)] == []


@needs_shared
def test_features_md_has_every_function_of_fawkes():
    text = page("features.md")
    facts = json.loads((SHARED / "compat" / "clips-functions.json").read_text())
    names = [function["name"] for feature in facts["features"] for function in feature["functions"]]
    assert [name for name in names if not re.search(rf"`\(?{name}[ )`]", text)] == []


# pages


@pytest.mark.parametrize("folder", [DOCS, DOCS / "evidence"], ids=lambda folder: folder.name)
def test_index_of_folder_links_every_page(folder):
    text = (folder / "index.md").read_text()
    names = [path.name for path in PAGES if path.parent == folder and path.name != "index.md"]
    assert [name for name in names if f"({name})" not in text] == []


def test_menu_of_site_has_every_page_once():
    menu = yaml.safe_load((ROOT / "mkdocs.yml").read_text())["nav"]
    names = re.findall(r"[\w/-]+\.md", str(menu))
    pages = [path.name for path in PAGES if path.parent == DOCS]
    assert sorted(names) == sorted([*pages, "evidence/index.md"])
    assert len(pages) <= MOST_PAGES


@pytest.mark.parametrize(
    "path", [path for path in PAGES if path.parent == DOCS and path.name != "index.md"], ids=name_of
)
def test_page_begins_with_use_and_ends_with_next_page(path):
    first, *_, last = [each for each in path.read_text().split("\n\n") if not each.startswith("# ")]
    assert first.startswith("After this page ")
    assert last.startswith("Next: ")


# the Python API

API = DOCS / "api.md"


def test_names_of_api_exist_with_docstrings():
    names = re.findall(r"^::: (\S+)$", API.read_text(), re.MULTILINE)
    assert names
    for name in names:
        assert not any(part.startswith("_") for part in name.split("."))
        assert resolve_name(name).__doc__, name


OFFERING = [
    "run",
    "blackboard",
    "testing",
    "space.navgraph",
    "space.tf",
]


@pytest.mark.parametrize("package", OFFERING)
def test_public_names_of_packages_are_in_api(package):
    """As a separate name, or below a name that is shown whole."""
    text = API.read_text()
    module = importlib.import_module(f"cxbridge.{package}")
    missing = [name for name in module.__all__ if f"::: cxbridge.{package}.{name}\n" not in text + "\n"]
    assert missing == []


def test_examples_of_api_work(tmp_path, monkeypatch):
    for part in ("scenarios", "interfaces"):
        (tmp_path / part).symlink_to(ROOT / part)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    samples = re.findall(r"^```python\n(.*?)^```", page("api.md"), re.DOTALL | re.MULTILINE)
    assert len(samples) > 5
    for sample in samples:
        exec(compile(sample, sample, "exec"), names)


# differences

DIFFERS = re.compile(r"^\|[^|]*\| *[^|]*(?:Fawkes|ffbblog)[^|]*\| (?:here|cxbridge) \|", re.MULTILINE)
"""The head of a table that compares with Fawkes."""


def anchor(heading: str) -> str:
    """The site's anchor of a heading."""
    return re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


@pytest.mark.parametrize(
    "path", [path for path in PAGES if DIFFERS.search(path.read_text())], ids=lambda path: path.name
)
def test_every_table_of_differences_is_linked(path):
    text = path.read_text()
    for match in DIFFERS.finditer(text):
        heading = re.findall(r"^#+ (.*)$", text[: match.start()], re.MULTILINE)[-1]
        link = f"{os.path.relpath(path, DOCS / 'evidence')}#{anchor(heading)}"
        assert f"({link})" in page("evidence/differences.md")
