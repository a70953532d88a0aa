"""Every function and fact of the thesis' C++ is here; thesis-facts.md cites lines that say so."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import cxbridge_ros2cx
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from ros2cx_tests.inside import look_inside
from tests.support import ROOT, ROS2CX_DIR, needs_ros2cx

PAGE = ROOT / "docs" / "evidence" / "thesis-facts.md"
SOURCES = (Path(cxbridge_ros2cx.__file__).parent, ROOT / "cxbridge" / "executive")

ORDERED = {"ff-feature", "ff-feature-loaded", "executive-init", "executive-finalize", "time"}
"""Facts without slots."""
OF_A_TEST = {"b"}
"""The mock feature's fact: its template is that of the original's test."""

_STRINGS = r'((?:"(?:\\.|[^"\\])*"\s*)+)'
_FUNCTION = re.compile(r'add_function\(\s*(?://\s*)?"([^"]+)"')
_FACT = re.compile(rf"assert_fact(?:_f)?\(\s*{_STRINGS}")
_PIECE = re.compile(r'"((?:\\.|[^"\\])*)"')
_SLOT = re.compile(r"\(([a-z][\w-]*)")


def cpp_files() -> Iterator[Path]:
    """The C++ of the original, without its tests."""
    assert ROS2CX_DIR is not None
    for file in sorted(ROS2CX_DIR.rglob("src/**/*.cpp")):
        if "test" not in file.relative_to(ROS2CX_DIR).parts and "/clips/tests/" not in str(file):
            yield file


def functions() -> dict[str, str]:
    """The functions that the original gives to CLIPS, those in comments included, and where."""
    return {name: file.name for file in cpp_files() for name in _FUNCTION.findall(file.read_text())}


def facts() -> dict[str, set[str]]:
    """The facts that the original asserts: relation, and the slots that any of the texts has."""
    found: dict[str, set[str]] = {}
    for file in cpp_files():
        for strings in _FACT.findall(file.read_text()):
            text = "".join(_PIECE.findall(strings)).replace('\\"', '"')
            relation, *slots = _SLOT.findall(text)
            if relation not in ORDERED:
                found.setdefault(relation, set()).update(slots)
            else:
                found.setdefault(relation, set())
    return found


@cache
def constants() -> dict[Path, frozenset[str]]:
    """The texts in our modules."""
    found = {}
    for folder in SOURCES:
        for file in folder.rglob("*.py"):
            tree = ast.parse(file.read_text("utf-8"))
            texts = {
                node.value
                for node in ast.walk(tree)
                if isinstance(node, ast.Constant) and isinstance(node.value, str)
            }
            found[file] = frozenset(texts)
    return found


@needs_ros2cx
def test_every_function_of_the_original_is_defined(tmp_path: Path) -> None:
    names = functions()
    assert len(names) >= 27
    defined: set[str] = set()

    def look(env: ClipsEnvironment) -> None:
        defined.update(env.udfs.names)

    look_inside("test-nav2", look=look)
    of_blackboard = {name for name in names if name.startswith("blackboard-")}
    assert {name for name in names if name not in defined} == of_blackboard
    assert of_blackboard <= set(blackboard_functions(tmp_path))


def blackboard_functions(folder: Path) -> list[str]:
    from ros2cx_tests.test_blackboard_feature import Bench

    bench = Bench(folder, "sane")
    bench.manager.close()
    return bench.defined


@needs_ros2cx
def test_every_fact_of_the_original_is_asserted_with_its_slots() -> None:
    asserted = facts()
    assert len(asserted) >= 12
    for relation, slots in asserted.items():
        somewhere = [
            file
            for file, texts in constants().items()
            if any(text == relation or text.lstrip().startswith(f"({relation} ") for text in texts)
            or any(text == f"({relation})" for text in texts)
            or any(f"({relation} " in text for text in texts)
        ]
        assert somewhere, relation
        if relation not in OF_A_TEST:
            assert any(slots <= constants()[file] for file in somewhere), (relation, slots)


@needs_ros2cx
def test_the_facts_have_templates_with_these_slots() -> None:
    missing: set[str] = set()

    def look(env: ClipsEnvironment) -> None:
        assert env.call("path-load", "blackboard.clp") == Symbol("TRUE")
        for relation, slots in facts().items():
            if relation in ORDERED:
                continue
            known = env.has_template(relation)
            if not known or any(
                env.call("deftemplate-slot-existp", Symbol(relation), Symbol(slot)) != "TRUE"
                for slot in slots
            ):
                missing.add(relation)

    look_inside("test-nav2", look=look)
    assert missing == OF_A_TEST


# -- the page

_CITED = re.compile(r"`([\w.-]+\.(?:cpp|hpp|h|clp|py|yaml|srv|msg|xml)):(\d+)`")
_NAMED = re.compile(r"`([^`]+)`")


def sections() -> str:
    """The text of the page, without the section that has tables of another kind."""
    parts = re.split(r"^(?=## )", PAGE.read_text("utf-8"), flags=re.MULTILINE)
    return "".join(part for part in parts if not part.startswith("## Skill execution"))


def rows() -> Iterator[tuple[str, list[tuple[str, int]]]]:
    """The rows of the page's tables that cite: the name in the first cell, and the citations in the last."""
    for line in sections().splitlines():
        cells = re.split(r"(?<!\\)\|", line)
        if line.startswith("|") and (cited := _CITED.findall(cells[-2])):
            named = _NAMED.search(cells[1])
            assert named, line
            yield named[1].strip('()"').split()[0], [(file, int(number)) for file, number in cited]


@needs_ros2cx
def test_each_line_that_is_cited_has_the_name() -> None:
    assert ROS2CX_DIR is not None
    cited = [(name, *place) for name, places in rows() for place in places]
    assert cited
    wrong = []
    for name, file, number in cited:
        (path,) = [found for found in ROS2CX_DIR.rglob(file) if found.is_file()]
        line = "".join(path.read_text("utf-8").splitlines()[number - 1 : number])
        if name not in line:
            wrong.append(f"{file}:{number} has no {name}: {line}")
    assert wrong == []


@needs_ros2cx
def test_the_page_has_every_function_and_fact() -> None:
    text = PAGE.read_text("utf-8")
    for name in (*functions(), *facts()):
        assert re.search(rf"`\(?{re.escape(name)}[ `)]", text), name
