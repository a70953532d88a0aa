"""Foreign texts are compiled as Lua without execution: each is valid or has an error."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.stale_errors import ErrorTracker, find_syntax_error
from cxbridge.lua_syntax import LuaCompiler
from tests.support import module_files

_RUNTIME = re.compile(r"LuaRuntime\((?!\s*encoding=\"latin-1\")")


@pytest.mark.parametrize("length", range(30, 100))
def test_message_with_split_character_is_readable(length: int):
    """Lua quotes the first part of a text, and counts bytes."""
    for text in ("é" * length, f"a{'é' * length}", f"say{{text='{'é' * length}"):
        message = find_syntax_error(text)
        assert message.startswith("the skill string is not valid Lua: ")
        message.encode()


@given(st.text(st.characters(exclude_categories=()) | st.sampled_from("é\udcc3\0\x1b{}()'\"[]=#-\\")))
def test_random_text_is_lua_or_has_error(text: str):
    data = text.encode("utf-8", "surrogatepass")
    skill_string = data.decode("utf-8", "surrogateescape")
    message = ErrorTracker(1, "the error before").update(2, skill_string, "the error before", failed=True)
    message.encode()
    assert bool(find_syntax_error(skill_string)) == (LuaCompiler().find_error(data) is not None)
    assert message == (find_syntax_error(skill_string) or "the error before")


def test_precompiled_lua_is_refused():
    assert (
        find_syntax_error("\x1bLua") == "the skill string is not valid Lua: precompiled Lua is not accepted"
    )


def test_first_line_of_file_may_name_interpreter():
    compiler = LuaCompiler()
    assert compiler.find_error(b"#!/usr/bin/lua\nx = 1") is not None
    assert compiler.find_file_error(b"#!/usr/bin/lua\nx = 1") is None


def test_every_state_of_lua_accepts_invalid_utf_8():
    """With a different encoding, an error of Lua with a split character becomes a decoding error."""
    files = module_files().values()
    found = [path.name for path in files if _RUNTIME.search(path.read_text("utf-8"))]
    assert found == []
    assert any("LuaRuntime(" in path.read_text("utf-8") for path in files)
