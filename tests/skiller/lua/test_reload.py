"""Reloading of changed skill files while the Skiller runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.events import Level
from cxbridge.skiller.lua.modulepath import ModulePath, ModuleWatch
from tests.skiller.rig import SKILLS, Rig, write_skills

TELL_SKILL = """
module(..., skillenv.module_init)
name = "tell"
fsm = SkillHSM:new{name = name, start = "TELL"}
documentation = "Says its version."
depends_interfaces = {
    {v = "out", type = "SpeechSynthInterface", id = "Out", writing = true},
    {v = "pose", type = "Position3DInterface", id = "Pose"},
}
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "TELL"}
fsm:add_transitions{{"TELL", "FINAL", cond = true}}
function TELL:init() out:set_text("version 1") end
"""
SPACE = {"space": 'skillenv.use_skill("skills.tell")', "tell": TELL_SKILL}


class Skills:
    """A watched folder of skills, checked in each loop."""

    def __init__(self, folder: Path, files: dict[str, str], **more: Any) -> None:
        self.folder = write_skills(folder, files)
        self.rig = Rig()
        self.skiller = self.rig.lua([folder], space="space", watch=ModuleWatch(interval_s=0), **more)
        self.rig.forget()

    def change(self, **files: str) -> None:
        write_skills(self.folder, files)
        self.rig.loop()

    def logged(self) -> str:
        return "\n".join(self.rig.logged(Level.INFO) + self.rig.logged(Level.ERROR))


def instances(rig: Rig) -> dict[str, tuple[Any, ...]]:
    """Return serial, writer and readers of the interfaces of skills; a new interface has a new serial."""
    return {
        info.uid: (info.serial, info.writer, info.readers)
        for info in rig.board.list_all()
        if not info.type.startswith("Skiller")
    }


def test_changed_file_is_loaded(tmp_path: Path):
    skills = Skills(tmp_path, SPACE)
    skills.change(tell=TELL_SKILL.replace("version 1", "version two"))
    assert "Skill files changed (skills.tell); reloading them" in skills.logged()
    skills.rig.exec("tell{}")
    assert skills.rig.writes("text", uid="SpeechSynthInterface::Out") == ["version two"]


def test_reload_keeps_interfaces_data_and_controller(tmp_path: Path):
    skills = Skills(tmp_path, SPACE)
    skills.rig.send("AcquireControl", False)
    skills.rig.loop()
    skills.rig.exec("tell{}")
    before = instances(skills.rig)
    assert {"SpeechSynthInterface::Out", "Position3DInterface::Pose"} <= before.keys()
    reader: Any = skills.rig.board.open_for_reading("SpeechSynthInterface", "Out", owner="test")
    skills.change(tell=TELL_SKILL + "-- changed\n")
    assert skills.rig.state.exclusive_controller == str(skills.rig.commander.serial)
    reader.read()
    assert (reader.text, reader.has_writer) == ("version 1", True)
    skills.rig.board.close(reader)
    assert instances(skills.rig) == before


def test_reload_closes_unused_and_opens_new_interfaces(tmp_path: Path):
    skills = Skills(tmp_path, SPACE)
    skills.change(tell=TELL_SKILL.replace('id = "Pose"', 'id = "Elsewhere"'))
    assert "Position3DInterface::Pose" not in instances(skills.rig)
    assert "Position3DInterface::Elsewhere" in instances(skills.rig)


def test_broken_file_is_logged_once_and_loaded_after_repair(tmp_path: Path):
    skills = Skills(tmp_path, SPACE)
    before = instances(skills.rig)
    skills.change(tell="function x(\n")
    skills.rig.loop(3)
    assert len(skills.rig.logged(Level.ERROR)) == 2
    assert f"{tmp_path / 'tell.lua'}:2: cannot load skill space 'space'" in skills.logged()
    assert instances(skills.rig) == before
    skills.change(tell=TELL_SKILL.replace("version 1", "mended"))
    skills.rig.exec("tell{}")
    assert skills.rig.writes("text", uid="SpeechSynthInterface::Out") == ["mended"]


def test_missing_skill_file_is_loaded_when_it_appears(tmp_path: Path):
    skills = Skills(tmp_path, SPACE)
    skills.change(space='skillenv.use_skill("skills.late")')
    assert "'skills.late' not found" in skills.logged()
    skills.change(late=TELL_SKILL.replace('"tell"', '"late"'))
    assert skills.skiller.skills == ("late",)


def test_reload_waits_for_end_of_skill_string(tmp_path: Path):
    files = SKILLS
    skills = Skills(tmp_path, files)
    skills.rig.exec("count{to=5}", loops=2)
    skills.change(count=SKILLS["count"].replace("or 3", "or 1"))
    skills.rig.loop(2)
    assert skills.logged().count("they are loaded after this skill string") == 1
    assert skills.rig.status == "S_FINAL"
    skills.rig.exec("count{}", loops=1)
    assert skills.rig.status == "S_FINAL"


@pytest.mark.parametrize(("text", "watched"), [("true", True), ("false", False)])
def test_configuration_enables_watching_of_files(tmp_path: Path, text: str, watched: bool):
    config = Configuration.from_text(f"skiller: {{watch_files: {text}, skillspace: space}}")
    rig = Rig()
    skiller = rig.lua([write_skills(tmp_path, SPACE)], space="space", config=config)
    assert (skiller._watch is not None) is watched


def test_files_are_checked_after_interval(tmp_path: Path):
    now = 0.0
    watch = ModuleWatch(interval_s=0.5, now=lambda: now)
    path = ModulePath([write_skills(tmp_path, SPACE)])
    path.read("skills.tell")
    watch.follow(path)
    write_skills(tmp_path, {"tell": "changed"})
    now = 0.4
    assert watch.find_changed_modules() == []
    now = 0.5
    assert watch.find_changed_modules() == ["skills.tell"]
    assert watch.find_changed_modules() == []
