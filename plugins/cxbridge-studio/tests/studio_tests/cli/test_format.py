"""``cxbridge format``: files are laid out, or only named."""

from __future__ import annotations

import pytest

from cxbridge.cli.main import invoke

WRITTEN = "(defrule a\n(b)\n=>\n)\n"
LAID_OUT = "(defrule a\n  (b)\n  =>\n)\n"


def test_a_file_is_changed_once(tmp_path, capsys):
    file = tmp_path / "a.clp"
    file.write_text(WRITTEN)
    assert invoke(["format", "--check", str(tmp_path)]) == 1
    assert file.read_text() == WRITTEN
    assert capsys.readouterr().out == f"{file}: would change\n"
    assert invoke(["format", str(file)]) == 0
    assert file.read_text() == LAID_OUT
    assert invoke(["format", "--check", str(file)]) == 0


@pytest.mark.parametrize(
    "content", [b'(a\r\n"\xff\xe4")\r\n', WRITTEN.encode("utf-16"), WRITTEN.encode("utf-16-le")]
)
def test_a_file_that_is_not_utf_8_is_refused_and_stays(tmp_path, capsys, content):
    before, file = tmp_path / "0.clp", tmp_path / "a.clp"
    before.write_text(WRITTEN)
    file.write_bytes(content)
    assert invoke(["format", str(tmp_path)]) == 2
    assert "not UTF-8" in capsys.readouterr().err
    assert file.read_bytes() == content
    assert before.read_text() == WRITTEN


def test_a_broken_file_stays_and_says_so(tmp_path, capsys):
    file = tmp_path / "a.clp"
    file.write_text("(a\n(b)\n")
    assert invoke(["format", str(file)]) == 0
    assert file.read_text() == "(a\n(b)\n"
    assert "do not match" in capsys.readouterr().err


def test_a_file_that_is_not_there(tmp_path, capsys):
    assert invoke(["format", str(tmp_path / "none.clp")]) == 2
    assert f"{tmp_path / 'none.clp'}: No such file" in capsys.readouterr().err
