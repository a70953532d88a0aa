"""docs/evidence/dependencies.md names each dependency and its licence; locked versions."""

from __future__ import annotations

import re
import tomllib

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support import ROOT

PROJECTS = [
    tomllib.loads(file.read_text())["project"]
    for file in (ROOT / "pyproject.toml", *sorted((ROOT / "plugins").glob("*/pyproject.toml")))
]
OURS = {project["name"] for project in PROJECTS}
DEPENDENCIES = [
    requirement
    for project in PROJECTS
    for requirement in (
        *project["dependencies"],
        *(
            requirement
            for extra in project.get("optional-dependencies", {}).values()
            for requirement in extra
        ),
    )
    if re.split(r"[\[=<>]", requirement)[0] not in OURS
]
PAGE = (ROOT / "docs" / "evidence" / "dependencies.md").read_text()
TABLE = dict(
    re.findall(r"^\| ([a-z0-9-]+) \| ([A-Z][A-Za-z0-9.-]+(?: OR [A-Za-z0-9.-]+)*) \|$", PAGE, re.MULTILINE)
)


def test_page_has_licences_of_exactly_all_dependencies():
    assert set(TABLE) == {canonicalize_name(Requirement(requirement).name) for requirement in DEPENDENCIES}


def locked(file):
    """The versions of a lock file by package; each has its hashes."""
    entries = re.split(r"\n(?=\S)", (ROOT / "requirements" / file).read_text().strip())
    found = {}
    for entry in entries:
        pinned = re.match(r"([a-z0-9-]+)==(\S+)", entry)
        assert pinned, entry
        assert "--hash=sha256:" in entry, entry
        found[pinned[1]] = pinned[2]
    return found


PLUGINS = {project["name"].removeprefix("cxbridge-") for project in PROJECTS[1:]}
LOCKED = {
    "dev.txt": {"cxbridge": "dev", "cxbridge-web": "foxglove"}
    | {f"cxbridge-{name}": "" for name in PLUGINS - {"web"}},
    "run.txt": {
        "cxbridge": "test",
        "cxbridge-fawkes": "",
        "cxbridge-planning": "",
        "cxbridge-robot-memory": "",
        "cxbridge-studio": "",
        "cxbridge-web": "",
    },
    "container.txt": {
        "cxbridge": "packed",
        "cxbridge-fawkes": "",
        "cxbridge-planning": "",
        "cxbridge-protobuf": "",
        "cxbridge-robot-memory": "",
        "cxbridge-studio": "",
        "cxbridge-web": "",
    },
}
"""The distributions that each lock is for, with their extra."""


@pytest.mark.parametrize("file", LOCKED)
def test_locked_versions_fit_project_and_have_hashes(file):
    versions = locked(file)
    wanted = [
        Requirement(requirement)
        for project in PROJECTS
        if project["name"] in LOCKED[file]
        for requirement in (
            *project["dependencies"],
            *project.get("optional-dependencies", {}).get(LOCKED[file][project["name"]], ()),
        )
        if re.split(r"[\[=<>]", requirement)[0] not in OURS
    ]
    for requirement in wanted:
        assert versions[canonicalize_name(requirement.name)] in requirement.specifier, requirement


@pytest.mark.parametrize("file", ["dev.txt", "run.txt", "container.txt", "build.txt"])
def test_lock_files_name_no_registry(file):
    assert "://" not in (ROOT / "requirements" / file).read_text()
    assert locked(file)
