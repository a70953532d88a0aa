"""Extras: which are there, what is missing, and the command that installs it."""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from cxbridge import extras
from cxbridge.cli.health import examine
from cxbridge.errors import TraceError
from cxbridge.trace.formats.mcap.records import _unpacked
from tests.support import ROOT

REQUIRES = [
    "msgspec>=0.19",
    "textual<9,>=1; extra == 'monitor'",
    "up-aries<1,>=0.4 ; (python_version >= '3.11') and extra == \"planners\"",
    "no-such-package>=1; extra == 'planners'",
    "mypy>=1; extra == 'dev'",
]


@pytest.fixture
def installed(monkeypatch):
    """An installation whose metadata are known."""
    monkeypatch.setattr(metadata, "requires", lambda _: REQUIRES)
    monkeypatch.setattr(
        metadata, "version", lambda name: {"textual": "1.0"}[name] if name == "textual" else absent()
    )


def absent():
    raise metadata.PackageNotFoundError


def test_extras_are_those_of_users(installed):
    assert extras.extras() == {
        "monitor": ["textual<9,>=1"],
        "planners": ["up-aries<1,>=0.4", "no-such-package>=1"],
    }


def test_what_is_missing(installed):
    assert extras.missing("monitor") == []
    assert extras.missing("planners") == ["up-aries<1,>=0.4", "no-such-package>=1"]


def test_a_checkout_is_installed_with_its_extra(monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    assert shlex.split(extras.install_command("monitor"))[1:] == ["-m", "pip", "install", "-e", ".[monitor]"]
    monkeypatch.chdir(tmp_path)
    words = shlex.split(extras.install_command("monitor"))
    assert words == [sys.executable, "-m", "pip", "install", "-e", f"{ROOT}[monitor]"]


def test_without_a_checkout_the_command_names_packages(installed, monkeypatch, tmp_path):
    monkeypatch.setattr(extras, "_CHECKOUT", tmp_path)
    words = shlex.split(extras.install_command("planners"))
    assert words[1:] == ["-m", "pip", "install", "up-aries<1,>=0.4", "no-such-package>=1"]


def test_the_folder_was_removed(monkeypatch, tmp_path):
    def gone(_cls):
        raise FileNotFoundError

    monkeypatch.setattr(Path, "cwd", classmethod(gone))
    assert f"{ROOT}[monitor]" in extras.install_command("monitor")


def test_the_doctor_names_missing_extras_and_their_command(installed):
    found = {finding.what: finding for finding in examine() if finding.what.startswith("extra ")}
    assert found.keys() == {"extra monitor", "extra planners"}
    assert found["extra monitor"].fine
    assert not found["extra planners"].fine
    assert not found["extra planners"].required
    assert found["extra planners"].remedy == extras.install_command("planners")


def test_the_extras_are_those_of_the_project_and_of_the_manual():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert extras.PURPOSES.keys() == project["optional-dependencies"].keys()
    row = r"^\| `cxbridge\[([\w-]+)\]` \| (.*?)(?: \(\[.*\))? \|$"
    rows = re.findall(row, _manual("installing"), re.MULTILINE)
    assert dict(rows) == extras.PURPOSES
    assert extras.extras().keys() == extras.PURPOSES.keys() - {"dev"}


def test_commands_and_pages_name_extras_that_there_are():
    named = {
        name
        for file in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("cxbridge/**/*.py")]
        for name in re.findall(
            r"(?:cxbridge|\.)\[([a-z0-9-]+)\]'|(?:install_command|missing)\(\"(\w+)\"\)|extra `([\w-]+)`",
            file.read_text("utf-8"),
        )
    }
    assert {name for names in named for name in names if name} <= extras.PURPOSES.keys()


def _manual(page: str) -> str:
    return (ROOT / "docs" / f"{page}.md").read_text("utf-8")


def test_a_packed_recording_names_the_extra_that_reads_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "zstandard", None)
    with pytest.raises(TraceError, match="packed with zstd") as caught:
        _unpacked("zstd", b"", 1)
    assert "[zstd]" in str(caught.value)
