"""The generated parts of the manual equal those of the code."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import pytest

from tests.docs.generated import COMMAND, DOCS, PARTS, pattern
from tests.support import ROOT

PRINT = """
import json
from tests.docs.generated import PARTS, text
print(json.dumps({name: text(name) for name in PARTS}))
"""


@pytest.fixture(scope="module")
def texts():
    """The parts by name, from a separate process: in this process, a test may have installed a plug-in."""
    done = subprocess.run([sys.executable, "-c", PRINT], cwd=ROOT, capture_output=True, check=True, text=True)
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", PARTS)
def test_generated_part_equals_code(name, texts):
    found = pattern(name).search((DOCS / PARTS[name][0]).read_text())
    assert found is not None
    assert found[0].split("\n") == texts[name].split("\n"), f"run: {COMMAND}"


def test_pictures_show_no_local_path():
    # the ids of wm-facts look like paths, too
    path = re.compile(r"&quot;(?!/(?:template|domain)/)/[^&<]+")
    pictures = sorted((DOCS / "images").glob("*.svg"))
    assert pictures
    assert {picture.name: path.findall(picture.read_text()) for picture in pictures} == {
        picture.name: [] for picture in pictures
    }
