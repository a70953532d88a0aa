"""The prose linter finds bad prose at its line, and skips code."""

from __future__ import annotations

import re

import pytest

from tests.docs import prose
from tests.docs.prose import Linter, prose_of_markdown, prose_of_python
from tests.support import ROOT

LINTER = Linter()


def findings(page):
    return [(found.line, found.words) for found in LINTER.findings([("page.md", prose_of_markdown(page))])]


@pytest.mark.parametrize(
    "sentence",
    [
        "The user is told what happened.",
        "`show` tells the layout.",
        "Executors serve whoever asks.",
        "This is an own interface.",
        "The file is read anew.",
        "What is done when are rules.",
        "Behind `$` stands what you type.",
        "The name stands in the file.",
        "The server sends a good-bye.",
        "The page completes names, as one types.",
        "The folder lies in the checkout.",
        "A text is no number.",
        "It ends when it is no number.",
        "It lists the skills that there are.",
        "It waits for ever.",
        "Is something misspelt, a line with the file says so.",
        "A gateway in other surroundings takes its seat at the desk.",
        "The color of a bar shows its outcome.",
    ],
)
def test_bad_sentence_is_found(sentence):
    assert findings(sentence) != []


@pytest.mark.parametrize(
    "page",
    [
        "The executive reports the outcome.",
        "`told` is a name.",
        "```console\n$ cxbridge told anew\n```",
        "Text:\n\n    told anew\n\nText.",
        "[a page](told.md#anew) and https://told.org/anew",
        "A tree that stands alone stands for a run.",
    ],
)
def test_good_prose_and_code_pass(page):
    assert findings(page) == []


def test_only_docstrings_help_and_messages_are_read():
    source = (
        '"""Is told of one."""\n'
        "told = 'told of two'  # told of three\n"
        "def f(x: str = Option(help='told of four')):\n"
        '    """Do it.\n\n    Told of six.\n    """\n'
        "    raise ValueError(f'told of eight {told}')\n"
    )
    found = LINTER.findings([("m.py", prose_of_python(source))])
    assert sorted({one.line for one in found}) == [1, 3, 6, 8]


def test_all_files_are_read_and_finding_is_status_1(monkeypatch, capsys):
    names = {path.name for path, _ in prose.pages()}
    assert {"README.md", "CHANGELOG.md", "index.md", "errors.py"} <= names
    monkeypatch.setattr(prose, "pages", lambda: [(ROOT / "docs" / "bad.md", "Whoever asks.")])
    assert prose.main([]) == 1
    assert re.fullmatch(r"docs/bad.md:1: 'Whoever': .+\n", capsys.readouterr().out)
