"""Escaping of hostile texts in HTML, attributes and scripts."""

from __future__ import annotations

import json
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge_web.escaping import encode_for_script, escape_html, escape_invisible

HOSTILE = [
    "</script><script>document.title='owned'</script>",
    "<!--<script>",
    "]]><img src=x onerror=\"document.title='owned'\">",
    "\" onmouseover=\"document.title='owned'",
    "' autofocus onfocus='document.title=1",
    "\u2028document.title='owned'\u2029",
    "abc\u202egpj.exe\u2066",
    "\\u003c/script>\\",
    "${document.title='owned'}",
    "a\x00b\x1bc\x7fd\x9be",
    "\udcff\ud800",
    "__proto__",
    "constructor",
    "\U000e0041tag",
]


class Collector(HTMLParser):
    def __init__(self):
        super().__init__()
        self.tags, self.attributes, self.data = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes.extend(attrs)

    def handle_data(self, data):
        self.data.append(data)


texts = st.one_of(st.sampled_from(HOSTILE), st.text(st.characters()), st.text("<>&\"'/!-script\\u2028\u2028"))


@given(texts)
def test_escaped_text_stays_text_and_attribute(text):
    collector = Collector()
    collector.feed(f'<b title="{escape_html(text)}">{escape_html(text)}</b>')
    collector.close()
    assert collector.tags == ["b"]
    assert collector.attributes == [("title", escape_invisible(text))]
    assert "".join(collector.data) == escape_invisible(text)


@given(texts)
def test_embedded_data_has_no_markup_and_keeps_values(text):
    embedded = encode_for_script({text: [text]})
    assert not set("<>&\u2028\u2029") & set(embedded)
    embedded.encode()
    # the page's script escapes characters below 0x20 like escape_invisible()
    decoded = json.loads(embedded)
    assert {
        escape_invisible(key): [escape_invisible(each) for each in value] for key, value in decoded.items()
    } == {escape_invisible(text): [escape_invisible(text)]}


@pytest.mark.parametrize("text", HOSTILE)
def test_invisible_characters_are_escaped(text):
    assert all(character.isprintable() for character in escape_invisible(text))


def test_nan_is_refused():
    with pytest.raises(ValueError, match="JSON"):
        encode_for_script([float("nan")])
