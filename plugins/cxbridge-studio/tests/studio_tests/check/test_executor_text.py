"""The check reads the skills of an executor from the text of its class, without execution."""

from __future__ import annotations

import pytest

from cxbridge.errors import SkillError
from cxbridge.skiller.board.executor import load_executor
from cxbridge_studio.check.executor_text import parse_skills

HEAD = "from cxbridge.skiller.board.executor import SkillExecutor\n"
EXECUTE = "    def execute(self, call):\n        yield 1.0\n"
KNOWN = {
    "a tuple with a type": f"class Wave(SkillExecutor):\n    skills: tuple = ('wave', 'nod')\n{EXECUTE}",
    "none": f"class Wave(SkillExecutor):\n    pass\n{EXECUTE}",
    "inherited": f"class Arm(SkillExecutor):\n    skills = ['wave', 'nod']\n{EXECUTE}class Wave(Arm): pass\n",
    "below if": f"if True:\n  class Wave(SkillExecutor):\n    skills = ('a',)\n{EXECUTE}",
}
COMPUTED = {
    "an expression": f"class Wave(SkillExecutor):\n    skills = tuple(['wave'])\n{EXECUTE}",
    "by settings": f"class Wave(SkillExecutor):\n    def skills_with(cls, settings): pass\n{EXECUTE}",
    "an imported base": "from cxbridge.skiller.navigation import Move\nclass Wave(Move): pass\n",
    "imported": "from cxbridge.skiller.navigation import Move as Wave\n",
    "its own base": "class Wave(Wave): pass\n",
}
WRONG = {
    "no such class": f"class Wav(SkillExecutor):\n    skills = ('wave',)\n{EXECUTE}",
    "no Python": "class Wave(SkillExecutor)\n",
    "a null": "\0",
}


@pytest.mark.parametrize("text", KNOWN.values(), ids=KNOWN)
def test_parsed_skills_equal_skills_of_class(tmp_path, text):
    (tmp_path / "arm.py").write_text(HEAD + text)
    skills = parse_skills("arm.py:Wave", tmp_path)
    assert skills == tuple(load_executor("arm.py:Wave", tmp_path).skills)


@pytest.mark.parametrize("text", COMPUTED.values(), ids=COMPUTED)
def test_computed_skills_are_unknown(tmp_path, text):
    (tmp_path / "arm.py").write_text(f"{HEAD}raise SystemExit('the module was imported')\n{text}")
    assert parse_skills("arm.py:Wave", tmp_path) is None
    assert parse_skills("arm:Wave", tmp_path) is None


@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG)
def test_invalid_class_is_refused_like_in_run(tmp_path, text):
    (tmp_path / "arm.py").write_text(HEAD + text)
    for read in (parse_skills, load_executor):
        with pytest.raises(SkillError):
            read("arm.py:Wave", tmp_path)
