"""Bad input to a Skiller: from PDDL objects, messages and recorded bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.events import Level
from cxbridge.skiller.mapping import ActionSkillMapping
from tests.skiller.rig import Rig, write_skills
from tests.skiller.test_language import SKILLS

NASTY = [
    'x"} print_error("injected") tell{what="y',
    "x'} print_error('injected') tell{what='y",
    'x\\"} print_error("injected") --',
    "two\nlines\r\nand a NUL \0 here",
    "]]} print_error('injected') --[[",
    "\\",
    'ends with a quote"',
    "%s %d größe",
]
TEMPLATES = ["tell{what=?(p)s}", 'tell{what="?(p)y"}', "tell{what='?(p)y'}"]


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig()
    rig.lua([write_skills(tmp_path, SKILLS)], space="space")
    return rig


@pytest.mark.parametrize("template", TEMPLATES)
@pytest.mark.parametrize("value", NASTY)
def test_quotes_and_newlines_in_parameters_run_no_lua(rig: Rig, template: str, value: str):
    mapped = ActionSkillMapping({"act": template}).map("act", {"p": value})
    rig.exec(mapped.text)
    assert rig.status == "S_FINAL"
    assert rig.logged(Level.ERROR) == []
    # the log has the exact bytes of the object's name; printing ends at NUL, as in C
    assert f"{value} 1" in rig.logged(Level.INFO) or "\0" in value


@pytest.mark.parametrize("value", NASTY)
def test_bare_parameter_with_code_makes_no_skill_string(value: str):
    mapped = ActionSkillMapping({"act": "tell{what=?(p)y}"}).map("act", {"p": value})
    assert mapped.text == ""
    assert mapped.messages[0][0] is Level.ERROR


def test_parameter_runs_lua_in_fawkes_mode(rig: Rig, tmp_path: Path):
    mapped = ActionSkillMapping({"act": TEMPLATES[0]}, mode="fawkes").map("act", {"p": NASTY[0]})
    rig.exec(mapped.text)
    assert "injected" not in rig.logged(Level.ERROR)  # strict mode takes the skill string as data
    fawkes = Rig()
    fawkes.lua([write_skills(tmp_path, SKILLS)], space="space", mode="fawkes")
    fawkes.exec(mapped.text)
    assert "injected" in fawkes.logged(Level.ERROR)


@pytest.mark.parametrize("value", ["\udcff\udcfe", "caf\udce9"])
def test_parameter_outside_utf8_is_unchanged(value: str):
    """Surrogates stand for such bytes."""
    mapped = ActionSkillMapping({"act": "tell{what=?(p)s}"}).map("act", {"p": value})
    assert mapped.text == f'tell{{what="{value}"}}'


def send_bytes(rig: Rig, text: bytes) -> Any:
    message = rig.commander.MESSAGES["ExecSkillMessage"]()
    chunk = bytearray(message.to_bytes())
    offset = message.field("skill_string").offset
    chunk[offset : offset + len(text)] = text
    message.set_from_chunk(chunk)
    rig.commander.msgq_enqueue(message)
    rig.loop()
    return rig.state


def test_skill_string_outside_utf8_reaches_skill(rig: Rig):
    state = send_bytes(rig, b'tell{what="a\xffb"}')
    assert state.to_bytes().find(b'tell{what="a\xffb"}') >= 0
    assert rig.logged(Level.INFO)[-1] == "a\N{REPLACEMENT CHARACTER}b 1"


def test_skill_string_that_fills_field_is_refused(rig: Rig):
    """The string may have been cut, and its start may be a chunk with another meaning. Fawkes runs it."""
    rig.exec("final{} " + "-" * 2000 + "\ntell{}")
    assert len(rig.state.skill_string) == 1023
    assert (rig.status, rig.state.error) == (
        "S_FAILED",
        "the skill string fills its field of 1023 bytes: it may have been cut",
    )


def test_error_longer_than_field_is_cut(rig: Rig):
    rig.exec(f"{'long' * 150}{{}}")
    assert len(rig.state.error) == 127


def test_graph_longer_than_field_is_cut_with_error(tmp_path: Path):
    states = ", ".join(f'"S{i:030}"' for i in range(400))
    big = f"""
module(..., skillenv.module_init)
name = "big"
fsm = SkillHSM:new{{name = name, start = "S{0:030}"}}
documentation = "Many states."
skillenv.skill_module(_M)
fsm:define_states{{export_to = _M, {states}}}
"""
    space = (
        "require('fawkes.modinit') module(..., fawkes.modinit.register_all) skillenv.use_skill('skills.big')"
    )
    rig = Rig()
    rig.lua([write_skills(tmp_path, {"big": big, "space": space})], space="space")
    rig.exec("big{}")
    viewer: Any = rig.board.open_for_reading("SkillerDebugInterface", "Skiller", owner="viewer")
    viewer.read()
    assert len(viewer.graph) == 8191
    assert any("exceeds its maximum size" in text for text in rig.logged(Level.ERROR))
