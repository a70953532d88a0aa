"""``cxbridge format``: files are laid out, or only named."""

from __future__ import annotations

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


def test_bytes_that_are_no_text_stay(tmp_path):
    file = tmp_path / "a.clp"
    file.write_bytes(b'(a\r\n"\xff\xe4")\r\n')
    assert invoke(["format", str(file)]) == 0
    assert file.read_bytes() == b'(a\r\n  "\xff\xe4")\r\n'


def test_a_broken_file_stays_and_says_so(tmp_path, capsys):
    file = tmp_path / "a.clp"
    file.write_text("(a\n(b)\n")
    assert invoke(["format", str(file)]) == 0
    assert file.read_text() == "(a\n(b)\n"
    assert "do not match" in capsys.readouterr().err


def test_a_file_that_is_not_there(tmp_path, capsys):
    assert invoke(["format", str(tmp_path / "none.clp")]) == 2
    assert "there is no such file" in capsys.readouterr().err
