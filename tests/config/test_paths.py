"""The placeholders of configured paths."""

from __future__ import annotations

from pathlib import Path

from cxbridge.config import PLACEHOLDERS, substitute_path


def test_each_placeholder_is_replaced_where_it_stands_first() -> None:
    folders: dict[str, str | Path] = {"BASEDIR": "/base", "RESDIR": Path("/res")}
    assert substitute_path("@BASEDIR@/a/@BASEDIR@/@RESDIR@", folders) == "/base/a/@BASEDIR@//res"


def test_unknown_placeholders_stay() -> None:
    assert substitute_path("@CONFDIR@/x @BASEDIR", {"BASEDIR": "/base"}) == "@CONFDIR@/x @BASEDIR"


def test_names() -> None:
    assert PLACEHOLDERS == ("BASEDIR", "FAWKES_BASEDIR", "RESDIR", "CONFDIR")
