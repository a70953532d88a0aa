"""The page's modules as one script."""

from __future__ import annotations

import re

import pytest

from cxbridge_web.report import modules
from cxbridge_web.report.modules import ModuleFormError, bundle
from cxbridge_web.report.page import SHARED_SCRIPT


@pytest.fixture
def files(monkeypatch):
    """The modules that there are, by path."""
    found: dict[str, str] = {}
    monkeypatch.setattr(modules, "_read", found.__getitem__)
    bundle.cache_clear()
    yield found
    bundle.cache_clear()


def test_what_is_imported_comes_first_and_once(files):
    files |= {
        "a/top.js": 'import { one } from "../one.js";\nimport { two as deux } from "./two.js";\none(deux);\n',
        "a/two.js": 'import * as all from "../one.js";\nexport const two = all.one;\n',
        "one.js": "// a comment\nexport function one() {}\nexport const { x, y: z } = one;\n",
    }
    script = bundle("a/top.js")
    assert re.findall(r"^// (.*)", script, re.MULTILINE) == ["one.js", "a/two.js", "a/top.js"]
    assert "const { two: deux } = module1;" in script
    assert "const all = module0;" in script
    assert "return { one, x, z };" in script
    assert not re.search(r"^\s*(import|export)\b", script, re.MULTILINE)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("export default 1;\n", "export default 1;"),
        ('import "./side.js";\n', 'import "./side.js"'),
        ("export { a };\n", "export { a };"),
        ('import { no } from "./one.js";\n', "one.js exports no no"),
        ('import { one } from "./top.js";\n', "imports itself"),
        ('export const a = "</script>";\n', "cannot contain"),
    ],
)
def test_other_forms_are_an_error(files, text, reason):
    files |= {"top.js": text, "one.js": "export const one = 1;\n"}
    with pytest.raises(ModuleFormError, match=re.escape(reason)):
        bundle("top.js")


def test_two_names_in_one_declaration_are_an_error_where_the_second_is_imported(files):
    """The second one was undefined, and the bars of a report were drawn nowhere."""
    files |= {"top.js": 'import { b } from "./one.js";\n', "one.js": "export const a = 1,\n  b = 2;\n"}
    with pytest.raises(ModuleFormError, match=re.escape("one.js exports no b")):
        bundle("top.js")


def test_the_report_has_the_timeline_and_nothing_that_talks_to_a_daemon():
    script = bundle(SHARED_SCRIPT)
    assert "// timeline/timeline.js" in script
    assert "fetch(" not in script
    assert "EventSource" not in script
