"""Extras: installed extras, missing packages, and the command that installs them."""

from __future__ import annotations

import json
import re
import shlex
import sys
import tomllib
from importlib import metadata

import pytest

from cxbridge import extras
from cxbridge.cli.health import run_checks
from cxbridge.errors import TraceError
from cxbridge.trace.formats.mcap.records import _decompress
from tests.support import ROOT

REQUIRES = [
    "msgspec>=0.19",
    "zstandard<1,>=0.23; extra == 'packed'",
    "up-aries<1,>=0.4 ; (python_version >= '3.11') and extra == \"planners\"",
    "no-such-package>=1; extra == 'planners'",
    "mypy>=1; extra == 'dev'",
]


@pytest.fixture
def installed(monkeypatch):
    """An installation whose metadata are known."""
    monkeypatch.setattr(metadata, "requires", lambda package: REQUIRES if package == "cxbridge" else [])
    monkeypatch.setattr(metadata, "version", lambda name: "1.0" if name == "zstandard" else absent())


def absent():
    raise metadata.PackageNotFoundError


def test_development_extras_are_hidden(installed):
    assert extras.requirements_by_extra() == {
        "packed": ["zstandard<1,>=0.23"],
        "planners": ["up-aries<1,>=0.4", "no-such-package>=1"],
    }


@pytest.mark.parametrize(
    ("extra", "package", "folders"),
    [
        ("explore", "cxbridge", [".[explore]", "plugins/cxbridge-explore", "plugins/cxbridge-studio"]),
        (
            "planners",
            "cxbridge",
            [".[planners]", "plugins/cxbridge-planning[engines]", "plugins/cxbridge-robot-memory"],
        ),
        (
            "",
            "cxbridge-rcll",
            [
                f"plugins/cxbridge-{name}"
                for name in ("rcll", "explore", "studio", "protobuf", "robot-memory")
            ],
        ),
    ],
)
def test_command_installs_plug_ins_of_extra_from_checkout(monkeypatch, extra, package, folders):
    """No package of cxbridge is on an index, so pip finds only packages that the command names."""
    monkeypatch.chdir(ROOT)
    words = shlex.split(extras.install_command(extra, package))[4:]
    assert words == [word for folder in folders for word in ("-e", folder)]


@pytest.mark.parametrize(
    ("origin", "folder"), [(json.dumps({"url": ROOT.as_uri()}), str(ROOT)), (None, "site-packages")]
)
def test_installed_copy_knows_source_folder(monkeypatch, tmp_path, origin, folder):
    """An installation from an index has no origin, and the working directory is not its source."""
    monkeypatch.setattr(extras, "__file__", str(tmp_path / "site-packages" / "cxbridge" / "extras.py"))
    monkeypatch.setattr(metadata.PathDistribution, "read_text", lambda self, name: origin)
    assert extras._source_folder() == tmp_path / folder


def test_doctor_names_missing_extras_and_command(installed):
    found = {finding.what: finding for finding in run_checks() if finding.what.startswith("extra ")}
    assert found.keys() == {"extra packed", "extra planners"}
    assert found["extra packed"].fine
    assert not found["extra planners"].fine
    assert not found["extra planners"].required
    assert found["extra planners"].remedy == extras.install_command("planners")


PROJECTS = {
    file.parent.name: tomllib.loads(file.read_text())["project"]
    for file in sorted((ROOT / "plugins").glob("*/pyproject.toml"))
}
"""The plug-ins of the repository."""


def test_extras_equal_extras_of_project_and_manual():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    plugins = {name.removeprefix("cxbridge-"): [f"{name}=={project['version']}"] for name in PROJECTS}
    found = dict(project["optional-dependencies"])
    assert {name: found.pop(name) for name in plugins} == plugins
    assert found.keys() == extras.EXTRA_PURPOSES.keys()
    rows = dict(
        re.findall(
            r"^\| `(cxbridge[\w-]*\[[\w-]+\])` \| (.*?)(?: \(\[.*\))? \|$",
            _manual("installing"),
            re.MULTILINE,
        )
    )
    assert rows.keys() == {
        *(f"cxbridge[{name}]" for name in project["optional-dependencies"]),
        *(
            f"{name}[{extra}]"
            for name, each in PROJECTS.items()
            for extra in each.get("optional-dependencies", ())
        ),
    }
    assert {name: rows[f"cxbridge[{name}]"] for name in extras.EXTRA_PURPOSES} == extras.EXTRA_PURPOSES
    assert extras.requirements_by_extra().keys() == project["optional-dependencies"].keys() - {"dev"}


def test_commands_and_pages_name_existing_extras():
    known = {"cxbridge": tomllib.loads((ROOT / "pyproject.toml").read_text())["project"], **PROJECTS}
    extra = re.compile(
        r"(cxbridge[\w-]*|'\.)\[([a-z0-9,-]+)\]'?|install_command\([\"'](\w+)[\"'](?:, [\"']([\w-]+)[\"'])?\)"
    )
    for file in [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("**/cxbridge*/**/*.py")]:
        for package, names, name, of in extra.findall(file.read_text("utf-8")):
            project = known[of or package.replace("'.", "") or "cxbridge"]
            absent = set((names or name).split(",")) - project.get("optional-dependencies", {}).keys()
            assert not absent, (file, absent)


def _manual(page: str) -> str:
    return (ROOT / "docs" / f"{page}.md").read_text("utf-8")


@pytest.mark.parametrize("packing", ["zstd", "lz4"])
def test_error_of_packed_recording_names_extra(monkeypatch, packing):
    monkeypatch.setitem(sys.modules, "lz4.frame" if packing == "lz4" else "zstandard", None)
    with pytest.raises(TraceError, match=f"packed with {packing}") as caught:
        _decompress(packing, b"", 1)
    assert "[packed]" in str(caught.value)
