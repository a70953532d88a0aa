"""The library that every CLIPS environment starts with: lists, strings, time, the search path, templates."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.executive.host.values import FALSE, TRUE, Value
from tests.executive.core.core_bench import Bench

_LIBRARY = Bench()
"""One environment for all tests that only call functions."""

Seconds = st.integers(-(2**40), 2**40)
Micros = st.integers(0, 999_999)
Times = st.tuples(Seconds, Micros)


def call(function: str, *arguments: Value) -> Value:
    """Call a function of the library."""
    return _LIBRARY.env.call(function, *arguments)


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("(append$ (create$ a) b c)", ("a", "b", "c")),
        ("(append$ (create$))", ()),
        ("(set-eq (create$ a b) (create$ b a a))", TRUE),
        ("(set-eq (create$ a b) (create$ b))", FALSE),
        ("(set-eq (create$) (create$))", TRUE),
        ("(set-diff (create$ a b c b) (create$ b))", ("a", "c")),
        ("(is-even-int 4)", TRUE),
        ("(is-even-int 3)", FALSE),
        ("(is-odd-int 3)", TRUE),
        ("(is-odd-int -2)", FALSE),
        ('(str-replace "a.b.c" "." "::")', "a::b.c"),
        ('(str-replace "abc" "x" "y")', "abc"),
        ('(str-replace "x" "x" "")', ""),
        ('(str-replace "@B@/a" "@B@" "/home")', "/home/a"),
        ('(string> "b" "a")', TRUE),
        ('(string> "a" "a")', FALSE),
        ('(str-prefix "/a/" "/a/b")', TRUE),
        ('(str-prefix "/a/b" "/a/")', FALSE),
        ('(str-prefix "b" "ab")', FALSE),
        ('(str-prefix "" "ab")', TRUE),
        ('(str-split "/a//b/c/" "/")', ("a", "b", "c")),
        ('(str-split "" "/")', ()),
        ('(str-split "abc" "/")', ("abc",)),
        ("(time-diff (create$ 10 1) (create$ 8 2))", (1, 999_999)),
        ("(time-diff (create$ 8 0) (create$ 10 500000))", (-3, 500_000)),
        ("(time-diff-sec (create$ 8 0) (create$ 10 500000))", -2.5),
        ("(time> (create$ 1 2) (create$ 1 1))", TRUE),
        ("(time> (create$ 1 2) (create$ 1 2))", FALSE),
        ("(time> (create$ 1 2) (create$ 2 0))", FALSE),
        ("(time-trunc-ms (create$ 5 123456))", (5, 123_000)),
        ("(time-trunc-ms (create$ 5))", (5,)),
    ],
)
def test_functions_of_library(expression: str, value: Value) -> None:
    assert _LIBRARY.env.eval(expression) == value


def test_timeout_is_strict() -> None:
    assert call("timeout", (15, 0), (10, 0), 5) == FALSE
    assert call("timeout", (15, 1), (10, 0), 5) == TRUE
    assert call("timeout", (15, 0), (0, 0), 14.5) == TRUE


@given(st.lists(st.text("ab/", min_size=0, max_size=4)))
def test_split_undoes_join(parts: list[str]) -> None:
    joined = "/".join(parts)
    assert list(call("str-split", joined, "/")) == [part for part in joined.split("/") if part]


# --- time facts and timers --------------------------------------------------------------------------------


def test_time_fact_lives_for_one_run() -> None:
    bench = Bench()
    bench.env.build('(defrule see (time ?s ?u) => (printout t "time " ?s crlf))')
    bench.tick()
    assert bench.texts() == [f"time {bench.clock.now_us() // 1_000_000}"]
    assert not bench.all("time")


# --- path -------------------------------------------------------------------------------------------------


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Bench, Path]:
    """An environment that searches two folders, named with substitutions."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    bench = Bench()
    bench.env.call("path-add-subst", "@TOP@", str(tmp_path))
    bench.env.eval('(path-add "@TOP@/one/" "@TOP@/two/")')
    return bench, tmp_path


def test_path_is_searched_in_order_and_survives_reset(folders: tuple[Bench, Path]) -> None:
    bench, top = folders
    for name in ("one", "two"):
        (top / name / "both.clp").write_text("")
    (top / "two" / "second.clp").write_text("")
    bench.env.eval("(reset)")
    assert bench.env.eval("(path-get)") == (f"{top}/one/", f"{top}/two/")
    assert bench.env.eval("(path-string)") == f"{top}/one/:{top}/two/"
    assert bench.env.eval('(path-resolve "both.clp")') == f"{top}/one/both.clp"
    assert bench.env.eval('(path-resolve "second.clp")') == f"{top}/two/second.clp"
    assert bench.env.eval('(path-resolve "third.clp")') == FALSE
    assert f"Trying CLIPS file {top}/one/second.clp (looking for second.clp)" in bench.texts("D")


@pytest.mark.parametrize("function", ["path-load", "path-load*"])
def test_load_defines_constructs_and_path_info(folders: tuple[Bench, Path], function: str) -> None:
    bench, top = folders
    (top / "two" / "f.clp").write_text("(deffunction answer () 42)")
    assert bench.env.call(function, "f.clp") == TRUE
    assert bench.env.call("answer") == 42
    assert bench.one("path-info") == {
        "file": "f.clp",
        "path": f"{top}/two/f.clp",
        "loaded": TRUE,
        "error-msg": "",
    }


@pytest.mark.parametrize(
    ("function", "verb"),
    [
        ("path-load", "load"),
        ("path-load*", "load"),
        ("path-batch", "batch load"),
        ("path-batch*", "batch load"),
    ],
)
def test_missing_file_is_logged_and_asserted(folders: tuple[Bench, Path], function: str, verb: str) -> None:
    bench, top = folders
    assert bench.env.call(function, "no.clp") == FALSE
    message = f"Cannot {verb} file no.clp (file not found in {top}/one/:{top}/two/)"
    assert bench.texts("E") == [message]
    info = bench.one("path-info")
    assert (info["loaded"], info["error-msg"], info["path"]) == (FALSE, message, "")


# --- completeness -----------------------------------------------------------------------------------------
