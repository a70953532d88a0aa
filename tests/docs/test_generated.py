"""The parts of the manual that are made from the code are those of the code."""

from __future__ import annotations

import pytest

from tests.docs.generated import COMMAND, DOCS, PARTS, pattern, text


@pytest.mark.parametrize("name", PARTS)
def test_a_part_is_that_of_the_code(name):
    found = pattern(name).search((DOCS / PARTS[name][0]).read_text())
    assert found is not None
    assert found[0].split("\n") == text(name).split("\n"), f"run: {COMMAND}"
