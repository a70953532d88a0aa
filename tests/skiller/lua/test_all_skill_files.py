"""Every skill file of Fawkes (generic, nao, the spaces) and of the RCLL agent loads as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.skiller.make import skill_folders
from cxbridge.space.navgraph import NavGraph, NavGraphNode
from tests.skiller.lua.space import LUA, SkillFile, all_interfaces, skill_files, with_needed
from tests.skiller.rig import Rig, write_skills
from tests.support import FAWKES_DIR, ROBOTINO_DIR, needs_fawkes, needs_robotino

# What files of arms and tables ask the configuration for while they are loaded; Fawkes' own has it no more.
ASKED_FOR = """
frames: {base: base_link}
hardware: {katana: {frame: {kni: katana_kni, gripper: katana_gripper}}}
perception: {tabletop-detection: {table_model_width: 1.2}}
skiller: {skillspace: one}
"""

FAWKES_FILES = skill_files(FAWKES_DIR, "generic", "nao")
ROBOTINO_FILES = skill_files(ROBOTINO_DIR, "robotino") if FAWKES_DIR else []


def config_with(text: str) -> Configuration:
    config = Configuration.from_text(text, "asked.yaml")
    if ROBOTINO_DIR is not None:
        config.overlay(Configuration.load(ROBOTINO_DIR / "cfg", host="robotino-base-1"))
    return config


def load(tmp_path: Path, modules: list[str], space: str = "one", **more: Any) -> Rig:
    """Load a space that uses these modules, or the named one."""
    assert FAWKES_DIR is not None
    roots = [FAWKES_DIR, *([ROBOTINO_DIR] if ROBOTINO_DIR else [])]
    write_skills(tmp_path, {"one": "\n".join(f'skillenv.use_skill("{module}")' for module in modules)})
    rig = Rig(all_interfaces(*roots))
    folders = [tmp_path, *(root / LUA for root in reversed(roots)), *skill_folders(fawkes_dir=FAWKES_DIR)]
    rig.lua(folders, space=space, config=config_with(ASKED_FOR), **more)
    return rig


def name_of(file: SkillFile) -> str:
    return file.module


def test_there_is_something_to_load():
    """Without checkouts there is nothing to show, and the output says so."""
    if FAWKES_DIR is None:
        pytest.skip("FAWKES_DIR names no Fawkes checkout")
    assert len([file for file in FAWKES_FILES if file.skill]) >= 30


@pytest.mark.parametrize("file", [file for file in FAWKES_FILES + ROBOTINO_FILES if file.skill], ids=name_of)
def test_a_skill_file_loads(tmp_path: Path, file: SkillFile):
    rig = load(tmp_path, with_needed(file, FAWKES_FILES + ROBOTINO_FILES))
    (skiller,) = rig.backends
    assert file.skill in skiller.skills
    assert skiller.engine.documentation(file.skill) is not None


@needs_fawkes
def test_the_generator_of_arms_makes_its_skills(tmp_path: Path):
    """skills.generic.jaco makes one skill for each arm, as its documentation says."""
    write_skills(tmp_path, {"arms": 'require("skills.generic.jaco").use_skill("jaco_left", "jacoarm_left")'})
    (skiller,) = load(tmp_path, [], "arms").backends
    assert skiller.skills == ("jaco_left",)


@needs_fawkes
def test_the_space_nao(tmp_path: Path):
    """Its file names skills.generic.relmoveto, which Fawkes has no more: movegoto is what is left of it."""
    write_skills(tmp_path, {"generic/relmoveto": 'return require("skills.generic.movegoto")'})
    (skiller,) = load(tmp_path, [], "nao", navgraph=NavGraph("none")).backends
    assert skiller.skills == (
        "relmoveto", "moveto", "turn", "say", "naoled", "stop", "walk", "getup", "park", "servo",
        "naostrafe", "beckon", "standup", "kick",
    )  # fmt: skip


@needs_robotino
def test_the_space_robotino(tmp_path: Path):
    graph = NavGraph("field")
    graph.add_node(NavGraphNode("C-CS1", 1.0, 2.0, {"orientation": "1.57"}))
    (skiller,) = load(tmp_path, [], "robotino", navgraph=graph).backends
    assert len(skiller.skills) == 36
    assert skiller.skills[:3] == ("say", "relmoveto", "motor_move")
