"""The skills of an executor, read from the text of its class; nothing of it is executed."""

from __future__ import annotations

import pytest

from cxbridge.errors import SkillError
from cxbridge.skiller.board.executor import load_executor
from cxbridge_studio.check.executor_text import parse_skills

HEAD = "from cxbridge.skiller.board.executor import SkillExecutor\n"
EXECUTE = "    def execute(self, call):\n        yield 1.0\n"
KNOWN = {
    "a tuple": f"class Wave(SkillExecutor):\n    skills = ('wave', 'nod')\n{EXECUTE}",
    "with a type": f"class Wave(SkillExecutor):\n    skills: tuple[str, ...] = ('wave', 'nod')\n{EXECUTE}",
    "none": f"class Wave(SkillExecutor):\n    pass\n{EXECUTE}",
    "inherited": f"class Arm(SkillExecutor):\n    skills = ('wave', 'nod')\n{EXECUTE}class Wave(Arm): pass\n",
    "below if": "if True:\n    class Wave(SkillExecutor):\n        skills = ('wave',)\n        execute = 1\n"
    "        def execute(self, call, more=1): yield 1.0\n",
}
COMPUTED = {
    "an expression": f"class Wave(SkillExecutor):\n    skills = tuple(['wave'])\n{EXECUTE}",
    "by settings": f"""class Wave(SkillExecutor):
    @classmethod
    def skills_with(cls, settings): return ('a',)
{EXECUTE}""",
    "a base elsewhere": "from cxbridge.skiller.navigation import Move\nclass Wave(Move): pass\n",
    "imported": "from cxbridge.skiller.navigation import Move as Wave\n",
    "made": "from cxbridge.skiller.navigation import Move\nWave = Move\n",
}
WRONG = {
    "no such class": f"class Wav(SkillExecutor):\n    skills = ('wave',)\n{EXECUTE}",
    "no execute": "class Wave(SkillExecutor):\n    skills = ('wave',)\n",
    "takes no call": "class Wave(SkillExecutor):\n    def execute(self): yield 1.0\n",
    "takes too much": "class Wave(SkillExecutor):\n    def execute(self, call, more): yield 1.0\n",
    "another class": f"class Wave:\n    skills = ('wave',)\n{EXECUTE}",
    "no Python": "class Wave(SkillExecutor)\n",
    "a null": "\0",
}


@pytest.mark.parametrize("text", KNOWN.values(), ids=KNOWN)
def test_skills_are_those_of_the_class(tmp_path, text):
    (tmp_path / "arm.py").write_text(HEAD + text)
    found = parse_skills("arm.py:Wave", tmp_path)
    assert found is not None
    assert found == load_executor("arm.py:Wave", tmp_path).skills


@pytest.mark.parametrize("text", COMPUTED.values(), ids=COMPUTED)
def test_skills_that_are_computed_are_not_known(tmp_path, text):
    (tmp_path / "arm.py").write_text(HEAD + text)
    assert parse_skills("arm.py:Wave", tmp_path) is None


@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG)
def test_what_a_run_refuses_is_refused(tmp_path, text):
    (tmp_path / "arm.py").write_text(HEAD + text)
    for read in (parse_skills, load_executor):
        with pytest.raises(SkillError):
            read("arm.py:Wave", tmp_path)


@pytest.mark.parametrize("target", ["arm.py:Wave", "Wave", "no.such.module:Wave", "no_such:Wave", ":Wave"])
def test_a_class_that_is_nowhere(tmp_path, target):
    for read in (parse_skills, load_executor):
        with pytest.raises(SkillError):
            read(target, tmp_path)


def test_a_module_is_read_without_its_package(tmp_path, monkeypatch):
    package = tmp_path / "hostile"
    package.mkdir()
    (package / "__init__.py").write_text("raise SystemExit('it was imported')\n")
    text = f"class Wave(SkillExecutor):\n    skills = ('a',)\n{EXECUTE}"
    (package / "arm.py").write_text(f"{HEAD}raise SystemExit('it was imported')\n{text}")
    monkeypatch.syspath_prepend(tmp_path)
    assert parse_skills("hostile.arm:Wave", tmp_path) == ("a",)
