"""Lua patterns: our own matcher agrees with C's, and no pattern holds up a loop."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.events import Level
from cxbridge.skiller.lua.engine import Limits
from tests.skiller.rig import SKILLS, Rig, write_skills
from tests.support import ROOT, many

lupa = pytest.importorskip("lupa.lua51")

PIECES = [
    "a", "b", ".", "%a", "%d", "[ab]", "[^a]", "[%d_]", "[a-c]", "%%", "(", ")", "()", "*", "+", "-", "?",
    "^", "$", "%b()", "%b", "%f[a]", "%f", "%1", "%2", "[", "]", "%", "x", "%s", "1", " ", "_", "%z",
]  # fmt: skip

COLLECT = """
return function(f, ...)
    local results = {pcall(f, ...)}
    for i = 1, 6 do results[i] = tostring(results[i]) end
    return table.concat(results, "|")
end, function(gmatch, ...)
    local found = {}
    local ok, problem = pcall(function(...)
        for a, b, c in gmatch(...) do
            found[#found + 1] = tostring(a) .. "," .. tostring(b) .. "," .. tostring(c)
            if #found > 30 then return end
        end
    end, ...)
    return tostring(ok) .. "|" .. (ok and "" or problem) .. "|" .. table.concat(found, "|")
end
"""


@pytest.fixture(scope="module")
def lua() -> Any:
    runtime = lupa.LuaRuntime(encoding="latin-1", unpack_returned_tuples=True)
    native = runtime.globals().string
    core = runtime.eval("{native = {string = string}}")
    own = runtime.execute((ROOT / "cxbridge/skiller/lua/matcher.lua").read_text(), core)
    return native, own, *runtime.execute(COLLECT)


def plain(text: str) -> str:
    """An outcome without the place in front of an error's text."""
    return re.sub(r"^false\|.*?: ", "false|", text)


patterns = st.lists(st.sampled_from(PIECES), max_size=7).map("".join)
subjects = st.text("aab c1(_)x\0", max_size=9)


@settings(max_examples=many(400, 100))
@given(pattern=patterns, subject=subjects, data=st.data())
def test_our_matcher_finds_what_c_finds(lua: Any, pattern: str, subject: str, data: Any):
    native, own, collect, collect_all = lua
    init = data.draw(st.integers(1, len(subject) + 1))
    for name in ("find", "match"):
        theirs = collect(native[name], subject, pattern, init)
        assert plain(collect(own[name], subject, pattern, init)) == plain(theirs)
    replacement, most = data.draw(st.sampled_from(["<%0>", "%1%1", "x", "%%"])), data.draw(st.integers(0, 5))
    theirs = collect(native.gsub, subject, pattern, replacement, most)
    assert plain(collect(own.gsub, subject, pattern, replacement, most)) == plain(theirs)
    theirs = collect_all(native.gmatch, subject, pattern)
    assert plain(collect_all(own.gmatch, subject, pattern)) == plain(theirs)


# -- in the engine


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig()
    limits = Limits(instructions_per_loop=2_000_000, seconds_per_loop=10)
    rig.lua([write_skills(tmp_path, SKILLS)], space="space", limits=limits, evaluates=True)
    return rig


SMALL = "('a'):rep(30)"
BOMBS = {
    "many loops": "string.find(('a'):rep(5000), ('a-'):rep(30) .. 'b')",
    "as a method": "local s = ('a'):rep(5000); s:find(('.-'):rep(30) .. 'b')",
    "many choices": "string.find(('a'):rep(40), ('a?'):rep(40) .. ('a'):rep(41))",
    "match": "string.match(('a'):rep(5000), ('.*'):rep(12) .. 'b')",
    "gmatch": "for _ in string.gmatch(('a'):rep(5000), ('.*'):rep(12) .. 'b') do end",
    "gsub": "string.gsub(('a'):rep(5000), ('.*'):rep(12) .. 'b', '')",
    "brackets": "string.find(('('):rep(100000), '%b()')",
    "a long pattern": "string.find(('a'):rep(400000), ('a?'):rep(200000))",
    "a long text in a long text": "local s = ('a'):rep(500000); s:find(s:sub(1, 250000) .. 'b', 1, true)",
    "repetitions of nothing": "while true do string.rep('', 2^31) end",
    "repetitions": "while true do local s = ('a'):rep(1000000) end",
    "elements in front": "local t = {}; while true do table.insert(t, 1, 0) end",
    "sorting": "local t = {}; for i = 1, 1e6 do t[i] = -i end; table.sort(t)",
}


@pytest.mark.parametrize("text", BOMBS.values(), ids=BOMBS)
def test_a_call_that_takes_for_ever_fails_the_skill_string(rig: Rig, text: str):
    rig.exec(text)
    assert rig.status == "S_FAILED"
    assert "endless loop?" in rig.logged(Level.ERROR)[0]
    rig.exec("count{}", loops=3)
    assert rig.status == "S_FINAL"


@pytest.mark.parametrize(
    "text",
    [
        "assert(('key = value'):match('^(%w+)%s*=%s*(%w+)$') == 'key')",
        "local n = 0; for w in ('one two three'):gmatch('%a+') do n = n + #w end; assert(n == 11)",
        "assert(('  x  '):rep(40):gsub('^%s*(.-)%s*$', '%1'):sub(1, 1) == 'x')",
        "local s, n = ('a.b.c'):gsub('%.', {['.'] = '/'}); assert(s == 'a/b/c' and n == 2)",
        "assert(('a'):rep(3) == 'aaa' and ('a'):rep(0) == '' and ('a'):rep(-1) == '')",
        "assert(('x'):rep(5000):find(('.-'):rep(2) .. 'x$') == 1)",
        "assert(string.find(5512, 51) == 2 and ('a+b'):find('+', 1, true) == 2)",
        "assert(string.find('abc', 'b', -1) == nil and string.find('abc', '', 10) == 4)",
        "local t = {3, 1, 2}; table.sort(t); table.insert(t, 1, 0); assert(table.concat(t) == '0123')",
        "assert(table.remove({7, 8}, 1) == 7 and ('a,b'):split(',')[2] == 'b')",
        "local s = ('ab '):rep(2000); local r = s:gsub('(%w+) *(%w+)', '%2 %1'); assert(#r > 4000)",
    ],
)
def test_what_skills_do_with_texts_works(rig: Rig, text: str):
    rig.exec(text)
    assert (rig.status, rig.logged(Level.ERROR)) == ("S_INACTIVE", [])


@pytest.mark.parametrize(
    "text", ["('a'):find('[')", "('a'):rep(1e12)", "string.find()", "string.gsub('a', 'a')"]
)
def test_what_c_refuses_is_refused(rig: Rig, text: str):
    rig.exec(text)
    assert rig.status == "S_FAILED"
    assert "endless loop?" not in rig.logged(Level.ERROR)[0]
