"""The command ``cxbridge format``."""

from __future__ import annotations

import pytest

from cxbridge.cli.main import invoke

UNFORMATTED = "(defrule a\n(b)\n=>\n)\n"
FORMATTED = "(defrule a\n  (b)\n  =>\n)\n"


def test_format_changes_file_and_check_option_does_not(tmp_path, capsys):
    file = tmp_path / "a.clp"
    file.write_text(UNFORMATTED)
    assert invoke(["format", "--check", str(tmp_path)]) == 1
    assert file.read_text() == UNFORMATTED
    assert capsys.readouterr().out == f"{file}: would change\n"
    assert invoke(["format", str(file)]) == 0
    assert file.read_text() == FORMATTED
    assert invoke(["format", "--check", str(file)]) == 0


@pytest.mark.parametrize(
    "content", [b'(a\r\n"\xff\xe4")\r\n', UNFORMATTED.encode("utf-16"), UNFORMATTED.encode("utf-16-le")]
)
def test_file_not_in_utf_8_is_refused_and_unchanged(tmp_path, capsys, content):
    first, file = tmp_path / "0.clp", tmp_path / "a.clp"
    first.write_text(UNFORMATTED)
    file.write_bytes(content)
    assert invoke(["format", str(tmp_path)]) == 2
    assert "not UTF-8" in capsys.readouterr().err
    assert file.read_bytes() == content
    assert first.read_text() == UNFORMATTED


def test_broken_file_is_unchanged_with_warning(tmp_path, capsys):
    file = tmp_path / "a.clp"
    file.write_text("(a\n(b)\n")
    assert invoke(["format", str(file)]) == 0
    assert file.read_text() == "(a\n(b)\n"
    assert "do not match" in capsys.readouterr().err


def test_missing_file_is_an_error(tmp_path, capsys):
    assert invoke(["format", str(tmp_path / "none.clp")]) == 2
    assert f"{tmp_path / 'none.clp'}: No such file" in capsys.readouterr().err
