"""The list of long tests names tests that exist."""

from __future__ import annotations

import json
import re

from tests import long
from tests.support import ROOT


def test_each_long_test_exists() -> None:
    """A renamed long test would be in each run: `--costs=long` writes the list anew."""
    gone = []
    for name in json.loads(long.LIST.read_text("utf-8")):
        path, function_or_class = name.split("::")[:2]
        file = ROOT / path
        if not file.is_file() or not re.search(rf"\b{function_or_class}\b", file.read_text("utf-8")):
            gone.append(name)
    assert not gone
