"""What a skill, and a skill string that is run as Lua, can reach: a walk over all of it.

The engine has a kernel, which has power, and a library, which skills may change as they like. The walk
goes through the library with power that no skill has (it sees upvalues, environments, metatables), and stops
at the functions of the kernel.
"""

from __future__ import annotations

import re
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.events import Level
from tests.skiller.lua.walker import Reached, attack, spy, spying, walk
from tests.skiller.rig import Rig
from tests.support import many

SECRET = "5ec2e7-0f-the-daemon"

# C functions that a skill file may reach in any way. None of them loads code, looks into a function, changes
# an environment, or knows of files, processes and memory.
HARMLESS = {
    *[
        "assert",
        "error",
        "getmetatable",
        "ipairs",
        "next",
        "pairs",
        "pcall",
        "rawequal",
        "rawget",
        "rawset",
        "select",
        "setmetatable",
    ],
    *["tonumber", "tostring", "type", "unpack", "xpcall", "debug.traceback", "os.difftime", "os.time"],
    *(
        f"string.{name}"
        for name in ["byte", "char", "find", "format", "gfind", "gmatch", "gsub", "len", "lower", "match"]
    ),
    *(f"string.{name}" for name in ["rep", "reverse", "sub", "upper"]),
    *(
        f"table.{name}"
        for name in ["concat", "foreach", "foreachi", "getn", "insert", "maxn", "remove", "setn", "sort"]
    ),
    *(
        f"math.{name}"
        for name in [
            "abs",
            "acos",
            "asin",
            "atan",
            "atan2",
            "ceil",
            "cos",
            "cosh",
            "deg",
            "exp",
            "floor",
            "fmod",
            "frexp",
        ]
    ),
    *(
        f"math.{name}"
        for name in [
            "ldexp",
            "log",
            "log10",
            "max",
            "min",
            "mod",
            "modf",
            "pow",
            "rad",
            "random",
            "randomseed",
            "sin",
        ]
    ),
    *(f"math.{name}" for name in ["sinh", "sqrt", "tan", "tanh"]),
}


@pytest.fixture(scope="module")
def rig() -> Rig:
    config = Configuration()
    config.set("/cxbridge/web/token", SECRET)
    config.set("/url", f"https://me:{SECRET}@host/")
    config.set("/other", "plain")
    rig = Rig()
    with spying(), pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOME_TOKEN", SECRET)
        rig.lua(space="mobile", config=config)
    # after use there is more to find: opened interfaces, machines with traces, caches
    rig.exec("say{text='x'}; wait{seconds=1}", loops=3)
    return rig


@pytest.fixture(scope="module")
def engine(rig: Rig) -> Any:
    return rig.backends[0].engine


@pytest.fixture(scope="module")
def files(engine: Any) -> Reached:
    """What skill files reach: their globals, all modules, and whatever hangs on them."""
    return walk(engine, "{{world, 'world'}}")


# Functions of the kernel that a skill file may reach, by the last name on the way.
GATES = {
    *[
        "module",
        "place_in_skill",
        "require",
        "seeall",
        "__index",
        "__newindex",
        "module_init",
        "register_all",
        "register_global_funcs",
        "init",
    ],
    *[
        "find",
        "match",
        "gfind",
        "gmatch",
        "gsub",
        "rep",
        "insert",
        "remove",
        "concat",
        "sort",
        "foreach",
        "foreachi",
        "getn",
        "maxn",
    ],
    *[
        "unpack",
        "xpcall",
        "date",
        "time",
        "charge",
        "include",
        "proxies",
        "new_userdata",
        "calling_module",
        "traceback",
        "compile_condition",
    ],
    # of the host, each in a function that passes its arguments on
    *[
        "log",
        "send",
        "now_usec",
        "elapsed_usec",
        "random",
        "randomseed",
        "find_module",
        "config_exists",
        "config_get",
        "config_is",
    ],
    *[
        "getenv",
        "describe",
        "open",
        "close",
        "read",
        "write",
        "read_all",
        "write_changed",
        "query",
        "timestamp",
        "get",
        "set",
    ],
    *["queue_first", "queue_size", "queue_pop", "queue_flush", "queue_remove"],
    *["tf_frame_exists", "tf_can_transform", "tf_lookup", "tf_lookup_via"],
}


def test_the_walk_goes_through_all_of_the_library(files: Reached):
    assert files.size > 2000
    assert len(files.gates) > 60
    assert {"Flite", "SpeechSynthInterface"} <= set(files.texts)


def test_skill_files_reach_no_object_of_the_engine(files: Reached):
    assert files.forbidden == {}


def test_skill_files_reach_the_gates_of_the_kernel_only(files: Reached):
    assert {path for path in files.gates if re.split(r"[.<>]+", path.rstrip(">"))[-1] not in GATES} == set()


def test_skill_files_reach_no_python_object_and_no_thread(files: Reached):
    assert set(files.objects.values()) <= {"userdata interface"}


def test_skill_files_reach_harmless_functions_of_c_only(files: Reached):
    assert {name: path for name, path in files.native.items() if name not in HARMLESS} == {}


def test_skill_files_reach_no_secret(files: Reached):
    assert [text for text in files.texts if SECRET in text] == []


def test_the_globals_that_lua_starts_with_are_empty(engine: Any):
    assert spy(engine)("return next(start) == nil and next(debug.getregistry()._LOADED._G or {}) == nil")


@pytest.mark.parametrize(
    ("file", "before", "after", "what"),
    [
        ("boot", "local kit = {", "local kit = {spare = core.setfenv,", "native"),
        ("boot", "local kit = {", "local kit = {host_itself = host,", "forbidden"),
        ("boot", "local kit = {", "local kit = {power = core,", "forbidden"),
        ("boot", "local kit = {", "local kit = {more = core.collectgarbage,", "native"),
    ],
)
def test_the_walk_would_find_it(file: str, before: str, after: str, what: str):
    """Holes that somebody might make."""
    rig = Rig()
    with spying(**{file: (before, after)}):
        rig.lua(space="mobile")
    reached = walk(rig.backends[0].engine, "{{world, 'world'}}")
    found = {"native": set(reached.native) - HARMLESS, "forbidden": set(reached.forbidden)}
    assert {name for name, things in found.items() if things} >= {what}


# -- skill strings that are run as Lua


def test_a_skill_string_gets_hold_of_nothing_of_the_library(engine: Any):
    """Whatever it reads and calls with whatever it found: stand-ins, and harmless functions of C."""
    held, things, calls = attack(engine, most_calls=many(1_000_000, 60_000))
    assert (things > 300, calls > 50_000) == (True, True)
    assert {path: what for path, what in held.items() if what.removeprefix("C ") not in HARMLESS} == {}


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("clock = stand_in_for(time.Clock)", "clock = time.Clock"),
        (
            "function call_original(callee, ...) return all_given(",
            "function call_original(callee, ...) return (",
        ),
        ("return stand_in_for(originals[stand_in][key])", "return originals[stand_in][key]"),
    ],
)
def test_the_attack_would_find_it(before: str, after: str):
    rig = Rig()
    with spying(sandbox=(before, after)):
        rig.lua(space="mobile")
    held, _, _ = attack(rig.backends[0].engine, most_calls=60_000)
    assert [what for what in held.values() if not what.startswith("C ")]


# -- secrets

KINDS = ["string", "int", "uint", "float", "bool"]
ACCESSORS = ["exists", *(f"{how}_{kind}" for how in ("get", "is") for kind in KINDS)]
ACCESSORS += [f"get_{kind}_or_default" for kind in KINDS]


@pytest.mark.parametrize(
    "path", ["/cxbridge/web/token", "cxbridge//web/token", "/cxbridge/web/token/", "/cxbridge/web", "/url"]
)
@pytest.mark.parametrize("accessor", ACCESSORS)
def test_no_way_to_read_a_value_tells_a_secret(rig: Rig, engine: Any, accessor: str, path: str):
    rig.forget()
    engine.compile(f"print_info(tostring(config:{accessor}('{path}', 'x')))")
    told = engine.run().error + "".join(rig.logged(Level.INFO))
    assert told
    assert SECRET not in told


@pytest.mark.parametrize("name", ["SOME_TOKEN", "SOME_URL"])
def test_the_environment_tells_no_secret(rig: Rig, engine: Any, name: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("SOME_TOKEN", SECRET)
    monkeypatch.setenv("SOME_URL", f"https://me:{SECRET}@host/")
    monkeypatch.setenv("SOME_PLACE", "kitchen")
    rig.forget()
    engine.compile(f"print_info(os.getenv('SOME_PLACE')); print_info(os.getenv('{name}'))")
    told = engine.run().error + "".join(rig.logged(Level.INFO))
    assert "kitchen" in told
    assert SECRET not in told


def test_what_is_no_secret_is_told(rig: Rig, engine: Any):
    rig.forget()
    engine.compile("print_info(config:get_string('/other'))")
    assert engine.run().error == ""
    assert rig.logged(Level.INFO) == ["plain"]
