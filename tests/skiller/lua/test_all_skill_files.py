"""All skill files of Fawkes (generic, nao, the spaces) and of the RCLL agent load unchanged."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.skiller.make import skill_folders
from cxbridge.space.navgraph import NavGraph, NavGraphNode
from tests.skiller.lua.space import LUA, SkillFile, all_interfaces, skill_files, with_dependencies
from tests.skiller.rig import Rig, write_skills
from tests.support import FAWKES_DIR, ROBOTINO_DIR, needs_fawkes, needs_robotino

# Values that files of arms and tables read while they load; Fawkes' own configuration lacks them.
NEEDED_CONFIG = """
frames: {base: base_link}
hardware: {katana: {frame: {kni: katana_kni, gripper: katana_gripper}}}
perception: {tabletop-detection: {table_model_width: 1.2}}
skiller: {skillspace: one}
"""

FAWKES_FILES = skill_files(FAWKES_DIR, "generic", "nao")
ROBOTINO_FILES = skill_files(ROBOTINO_DIR, "robotino") if FAWKES_DIR else []


def config_with(text: str) -> Configuration:
    config = Configuration.from_text(text, "needed.yaml")
    if ROBOTINO_DIR is not None:
        config.overlay(Configuration.load(ROBOTINO_DIR / "cfg", host="robotino-base-1"))
    return config


def load(tmp_path: Path, modules: list[str], space: str = "one", **more: Any) -> Rig:
    """Load a space with these modules, or the named space."""
    assert FAWKES_DIR is not None
    roots = [FAWKES_DIR, *([ROBOTINO_DIR] if ROBOTINO_DIR else [])]
    write_skills(tmp_path, {"one": "\n".join(f'skillenv.use_skill("{module}")' for module in modules)})
    rig = Rig(all_interfaces(*roots))
    folders = [tmp_path, *(root / LUA for root in reversed(roots)), *skill_folders(fawkes_dir=FAWKES_DIR)]
    rig.lua(folders, space=space, config=config_with(NEEDED_CONFIG), **more)
    return rig


def module_of(file: SkillFile) -> str:
    return file.module


def test_checkout_has_skill_files():
    """The skip shows that there is no checkout."""
    if FAWKES_DIR is None:
        pytest.skip("FAWKES_DIR names no Fawkes checkout")
    assert len([file for file in FAWKES_FILES if file.skill]) >= 30


@pytest.mark.parametrize(
    "file", [file for file in FAWKES_FILES + ROBOTINO_FILES if file.skill], ids=module_of
)
def test_skill_file_loads(tmp_path: Path, file: SkillFile):
    rig = load(tmp_path, with_dependencies(file, FAWKES_FILES + ROBOTINO_FILES))
    (skiller,) = rig.backends
    assert file.skill in skiller.skills
    assert skiller.engine.documentation(file.skill) is not None


@needs_fawkes
def test_generator_of_arms_makes_skills(tmp_path: Path):
    """skills.generic.jaco makes a skill for each arm."""
    write_skills(tmp_path, {"arms": 'require("skills.generic.jaco").use_skill("jaco_left", "jacoarm_left")'})
    (skiller,) = load(tmp_path, [], "arms").backends
    assert skiller.skills == ("jaco_left",)


@needs_fawkes
def test_space_nao_loads(tmp_path: Path):
    """The space names skills.generic.relmoveto, which Fawkes lacks: movegoto replaces it."""
    write_skills(tmp_path, {"generic/relmoveto": 'return require("skills.generic.movegoto")'})
    (skiller,) = load(tmp_path, [], "nao", navgraph=NavGraph("none")).backends
    assert skiller.skills == (
        "relmoveto", "moveto", "turn", "say", "naoled", "stop", "walk", "getup", "park", "servo",
        "naostrafe", "beckon", "standup", "kick",
    )  # fmt: skip


@needs_robotino
def test_space_robotino_loads(tmp_path: Path):
    graph = NavGraph("field")
    graph.add_node(NavGraphNode("C-CS1", 1.0, 2.0, {"orientation": "1.57"}))
    (skiller,) = load(tmp_path, [], "robotino", navgraph=graph).backends
    assert len(skiller.skills) == 36
    assert skiller.skills[:3] == ("say", "relmoveto", "motor_move")
