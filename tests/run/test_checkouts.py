"""A team's checkout laid over that of Fawkes: one option per checkout suffices."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of

FOLDERS = (
    "cfg/simulator",
    "src/clips-specs/agent",
    "src/libs/interfaces",
    "src/libs/messages",
    "src/lua/skills",
    "src/plugins/gripper/interfaces",
    "src/plugins/clips-executive/clips",
    "src/plugins/clips/clips",
)
MAIN = """\
include:
  - conf.d/
---
cxbridge: {own: 1}
"""
EXECUTIVE = """\
clips-executive: {clips-dirs: ["@BASEDIR@/src/clips-specs"]}
clips-protobuf: {proto-dirs: ["@BASEDIR@/src/libs/messages"]}
"""


def checkout(folder: Path, *folders: str) -> Path:
    for name in folders or FOLDERS:
        (folder / name).mkdir(parents=True)
    return folder


@pytest.fixture
def options(tmp_path):
    team = checkout(tmp_path / "team")
    (team / "cfg" / "conf.d").mkdir()
    (team / "cfg" / "config.yaml").write_text("{}\n")
    (team / "cfg" / "conf.d" / "executive.yaml").write_text(EXECUTIVE)
    (team / "cfg" / "simulator" / "central.yaml").write_text(MAIN)
    fixes = checkout(tmp_path / "fixes", "src/clips-specs/agent")
    fawkes = checkout(tmp_path / "fawkes")
    (fawkes / "cfg" / "config.yaml").write_text("{}\n")
    return RunOptions(
        scenario=Path("simulator/central.yaml"), fawkes_dir=fawkes, overlays=(fixes, team), skiller="none"
    )


def test_folders_of_the_first_overlay_are_searched_first(options):
    config, file = source_of(options).load_configuration()
    paths = source_of(options).find_paths(config, file)
    fixes, team = options.overlays
    assert paths.clips_dirs[:2] == (fixes / "src/clips-specs", team / "src/clips-specs")
    assert paths.interface_dirs[:3] == (
        team / "src/libs/interfaces",
        team / "src/plugins/gripper/interfaces",
        options.fawkes_dir / "src/libs/interfaces",
    )
    assert paths.skill_dirs[:2] == (team / "src/lua", options.fawkes_dir / "src/lua")
    assert paths.expand("@BASEDIR@/src/libs/messages") == [
        team / "src/libs/messages",
        options.fawkes_dir / "src/libs/messages",
    ]
    assert paths.placeholders == {
        "BASEDIR": str(team),
        "FAWKES_BASEDIR": str(options.fawkes_dir),
        "RESDIR": str(team / "res"),
        "CONFDIR": str(team / "cfg"),
    }


def test_first_configuration_is_used_without_scenario(options):
    _, file = source_of(replace(options, scenario=None)).load_configuration()
    assert file == options.overlays[1] / "cfg" / "config.yaml"
