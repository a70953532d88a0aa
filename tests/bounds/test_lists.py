"""The lists of queues and unpackings on the page about security are those of the code."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.support import ROOT, module_files, needs_all_plugins, short_path

PACKERS = {"zstandard", "zstd", "lz4", "bz2", "gzip", "zlib", "lzma", "zipfile", "tarfile", "base64"}
PACKERS |= {"websockets", "foxglove"}
QUEUES = {"deque", "Queue", "SimpleQueue", "LifoQueue", "PriorityQueue"}


def listed(heading: str) -> set[str]:
    """Return the files in the first column of the table below a heading."""
    text = (ROOT / "docs/evidence/security.md").read_text()
    table = text[text.index(heading) :].partition("\n\n**")[0]
    return set(re.findall(r"^\| `([\w/]+\.py)` \|", table, re.MULTILINE))


def files(words: set[str]) -> Iterator[tuple[str, ast.Module]]:
    """Yield the files that have one of the words, with their trees."""
    for path in module_files().values():
        text = Path(path).read_text()
        if any(word in text for word in words):
            yield short_path(path), ast.parse(text)


def is_unlimited(node: ast.AST) -> bool:
    """Whether a call makes a queue that has no limit where it is made."""
    if not isinstance(node, ast.Call):
        return False
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return name in QUEUES and not any(each.arg == "maxlen" for each in node.keywords)


@needs_all_plugins
def test_the_page_lists_each_queue_without_a_limit():
    made = {name for name, tree in files(QUEUES) if any(map(is_unlimited, ast.walk(tree)))}
    assert listed("| queue in `cxbridge/` |") == made


def imports(tree: ast.Module) -> set[str]:
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found


@needs_all_plugins
def test_the_page_lists_each_file_that_can_unpack():
    found = {name for name, tree in files(PACKERS) if imports(tree) & PACKERS}
    assert listed("| code in `cxbridge/` |") == found
