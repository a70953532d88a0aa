"""A user's skill space, loaded from its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.run import RunOptions, run_scenario
from tests.run.mini import write_scenario, write_skill_space
from tests.support import FAWKES_DIR, needs_fawkes

BODY = 'function execute() print_info("mine") return S_FINAL end\nfunction reset() end'


def log_of(tmp_path: Path, skills: Path, **options: object) -> str:
    log = tmp_path / "run.log"
    scenario = write_scenario(tmp_path / "s", space="mine", mapping="act: own{}")
    run = RunOptions(scenario=scenario, skill_dirs=(skills,), log=log, **options)  # type: ignore[arg-type]
    assert run_scenario(run).status == 0
    return log.read_text()


@pytest.mark.parametrize("below", ["", "skills"])
def test_user_skill_space(tmp_path: Path, below: str) -> None:
    """A Lua folder with ``skills/`` in it, or the folder of the skills itself."""
    folder = write_skill_space(tmp_path / "lua", "mine", own=BODY)
    assert "SkillerLua: mine" in log_of(tmp_path, folder / below)


@needs_fawkes
def test_user_skill_space_uses_skills_of_fawkes(tmp_path: Path) -> None:
    folder = write_skill_space(tmp_path / "lua", "mine", own=BODY)
    with (folder / "skills" / "mine.lua").open("a") as space:
        space.write('skillenv.use_skill("skills.generic.fake_moveto")\n')
    text = log_of(tmp_path, folder, fawkes_dir=FAWKES_DIR, core="builtin")
    assert "SkillerLua: mine" in text
    assert "Added skill moveto" in text
