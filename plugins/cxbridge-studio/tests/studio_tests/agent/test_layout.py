"""The layout of CLIPS text changes white space only, and is stable."""

from __future__ import annotations

import re
from textwrap import dedent

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clipstext.syntax import TOKEN
from cxbridge_studio.agent.layout import indent_clips
from tests.support import FAWKES_DIR, ROBOTINO_DIR, ROOT, needs_fawkes, needs_robotino

UNFORMATTED = """\
(deftemplate cup   "A cup."
   (slot colour
   (type SYMBOL))   ; of the cup \t
)



(defrule take ; one
(declare (salience 10))
\t?c <- (cup (colour red)
\t(owner bob))
  (and (a)
  (b))
=>
    (if (> 1 2)
    then
      (printout t "two
  lines" crlf)
    else (modify ?c (colour
      blue)))
)
"""

FORMATTED = """\
(deftemplate cup   "A cup."
  (slot colour
    (type SYMBOL))   ; of the cup
)


(defrule take ; one
  (declare (salience 10))
  ?c <- (cup (colour red)
             (owner bob))
  (and (a)
       (b))
  =>
  (if (> 1 2)
   then
    (printout t "two
  lines" crlf)
   else (modify ?c (colour
                     blue)))
)
"""


def split_tokens(text: str) -> list[str]:
    """Return the tokens of a text, with comments without trailing blanks."""
    result = []
    for match in TOKEN.finditer(text.replace("\r\n", "\n")):
        token = match.group()
        if match.lastgroup != "blank" or token.startswith(";"):
            result.append(token.rstrip(" \t\r\f\v") if match.lastgroup == "blank" else token)
        elif set(token) - set(" \t\n\r\f\v"):
            result.append(token)
    return result


def check_layout(text: str) -> None:
    formatted = indent_clips(text)
    assert split_tokens(formatted) == split_tokens(text)
    assert indent_clips(formatted) == formatted


def test_parentheses_determine_indentation():
    assert indent_clips(UNFORMATTED) == FORMATTED
    check_layout(UNFORMATTED)


@pytest.mark.parametrize("text", ["(defrule a (b)\n   (c", '(a "b\n )', "(a))\n  (b)", ")(", "   )"])
def test_unbalanced_text_is_unchanged(text):
    assert indent_clips(text) == text


def test_line_ends_are_unchanged():
    assert indent_clips("(a\r\n(b))\r\n") == "(a\r\n  (b))\r\n"
    assert indent_clips("") == ""
    assert indent_clips("\n\n (a)") == "(a)\n"


WORDS = st.sampled_from(
    [
        *(
            "(",
            ")",
            " ",
            "\n",
            "\t",
            "\r\n",
            "\r",
            "a",
            "defrule",
            "if",
            "then",
            "?x",
            "<-",
            "=>",
            "&",
            "~",
            "1.5",
        ),
        *('"s"', '"two\n  lines"', '"\\""', "; c \n", ";\n", "\xa0", "\x0c", "\n\n\n\n", "<", "a<b"),
    ]
)


@st.composite
def balanced_texts(draw: st.DrawFn) -> str:
    inner = st.recursive(
        WORDS.filter(lambda word: word not in "()"),
        lambda children: st.lists(children, max_size=6).map(lambda items: "(" + " ".join(items) + ")"),
    )
    return "\n".join(draw(st.lists(inner, max_size=5)))


@given(balanced_texts())
def test_layout_of_balanced_text_keeps_tokens_and_is_stable(text):
    check_layout(text)


def test_line_indented_by_two_columns_is_unchanged():
    """Long names would move the slots of a nested fact far to the right."""
    text = "(assert (plan-action (id 1) (action-name go)\n          (param-names to)))\n"
    assert indent_clips(text) == text
    moved = indent_clips(text.replace("          (param", "       (param"))
    assert moved == text.replace("          (param", "                     (param")


def test_texts_of_manual_scenarios_and_templates_are_laid_out():
    files = [*ROOT.glob("scenarios/**/*.clp"), *ROOT.glob("templates/**/*.clp*")]
    texts = [(file, file.read_text("utf-8")) for file in files]
    for page in sorted(ROOT.glob("docs/**/*.md")):
        for block in re.finditer(r"^( *)```lisp.*\n((?s:.*?))^ *```", page.read_text("utf-8"), re.MULTILINE):
            text = dedent(block[2]).lstrip("\n")
            if not text.startswith(("(define ", "(with-eval-after-load")):  # PDDL, Emacs
                texts.append((page, text))
    assert len(texts) > 50
    for place, text in texts:
        assert indent_clips(text) == text, place


@needs_fawkes
@needs_robotino
def test_layout_of_fawkes_and_rcll_files_is_stable():
    assert FAWKES_DIR is not None
    assert ROBOTINO_DIR is not None
    paths = [*FAWKES_DIR.rglob("*.clp"), *ROBOTINO_DIR.rglob("*.clp")]
    assert len(paths) > 150
    for path in paths:
        check_layout(path.read_bytes().decode("utf-8", "surrogateescape"))
