"""Text is made safe for terminals and logs."""

from __future__ import annotations

import io
import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.printing import (
    UNSAFE_CODE_POINTS,
    VisibleStream,
    escape_log_entry,
    escape_record,
    indent_lines,
    one_line,
    unescape_record,
    unfiltered_stream,
    visible,
)

DANGEROUS = set(map(chr, UNSAFE_CODE_POINTS))
texts = st.text(st.one_of(st.characters(), st.sampled_from([*DANGEROUS, "\n", "\\", "u", "0"])))


def test_all_controls_and_bidirectional_marks_are_dangerous():
    """Held against Python's Unicode data, not against our own list."""
    for code in range(0x110000):
        character = chr(code)
        control = unicodedata.category(character) in {"Cc", "Zl", "Zp", "Cs"} and character not in "\t\n"
        turns = unicodedata.bidirectional(character) in {
            *("LRE", "RLE", "PDF", "LRO", "RLO", "LRI", "RLI", "FSI", "PDI")
        }
        assert (character in DANGEROUS) == (control or turns), hex(code)


@given(texts)
def test_escaped_text_has_no_dangerous_characters(text):
    assert not DANGEROUS & set(visible(text) + one_line(text) + indent_lines(text))
    assert "\n" not in one_line(text)
    assert all(not line or line.startswith("  ") for line in indent_lines(text).split("\n")[1:])


@given(st.text(st.characters(categories=["L", "M", "N", "P", "S", "Zs"])))
def test_harmless_text_stays(text):
    plain_text = text.replace("\\", "/")
    assert (
        visible(plain_text)
        == one_line(plain_text)
        == escape_record(plain_text)
        == escape_log_entry(plain_text)
        == plain_text
    )
    assert visible(f"{plain_text}\tx\n") == f"{plain_text}\tx\n"


@given(texts)
def test_record_and_log_entry_are_read_back(text):
    assert "\n" not in escape_record(text)
    assert unescape_record(escape_record(text)) == text
    assert unescape_record(escape_log_entry(text)) == text
    assert all(line[:1] in {"", " ", "\t", "(", ")"} for line in escape_log_entry(text).split("\n")[1:])


def test_stream_escapes_terminal_sequences():
    raw = io.StringIO()
    stream = VisibleStream(raw)
    print("a\x1b[31mb", file=stream)
    stream.writelines(["c\x9b", "d\n"])
    print("\x1b[0m", end="", file=unfiltered_stream(stream))
    assert raw.getvalue() == "a\\u001b[31mb\nc\\u009bd\n\x1b[0m"
    assert stream.encoding is raw.encoding
    assert unfiltered_stream(raw) is raw
