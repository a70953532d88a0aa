"""The lists of queues and unpackings on the page about security equal those of the code."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.support import ROOT, imported_packages, module_files, needs_all_plugins, short_path

PACKERS = {"zstandard", "zstd", "lz4", "bz2", "gzip", "zlib", "lzma", "zipfile", "tarfile", "base64"}
PACKERS |= {"websockets", "foxglove"}
QUEUES = {"deque", "Queue", "SimpleQueue", "LifoQueue", "PriorityQueue"}


def listed_paths(heading: str) -> set[str]:
    """Return the files in the first column of the table below a heading."""
    text = (ROOT / "docs/evidence/security.md").read_text()
    table = text[text.index(heading) :].partition("\n\n**")[0]
    return set(re.findall(r"^\| `([\w/]+\.py)` \|", table, re.MULTILINE))


def files(words: set[str]) -> list[Path]:
    """Return the files with any of the words."""
    return [path for path in module_files().values() if any(word in path.read_text() for word in words)]


def is_unlimited(node: ast.AST) -> bool:
    """Whether a call makes a queue without a limit in the call."""
    if not isinstance(node, ast.Call):
        return False
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return name in QUEUES and not any(keyword.arg == "maxlen" for keyword in node.keywords)


@needs_all_plugins
def test_page_lists_each_unlimited_queue():
    paths = [path for path in files(QUEUES) if any(map(is_unlimited, ast.walk(ast.parse(path.read_text()))))]
    assert listed_paths("| queue in `cxbridge/` |") == set(map(short_path, paths))


@needs_all_plugins
def test_page_lists_each_file_that_unpacks():
    found = {short_path(path) for path in files(PACKERS) if imported_packages([path]) & PACKERS}
    assert listed_paths("| code in `cxbridge/` |") == found
