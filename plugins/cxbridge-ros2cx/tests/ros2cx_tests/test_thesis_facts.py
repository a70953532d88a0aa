"""The functions and facts of the thesis' C++ code, which need definitions and templates here."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from ros2cx_tests.loaded_agent import load_agent
from tests.support import ROS2CX_DIR, needs_ros2cx

ORDERED = {"ff-feature", "ff-feature-loaded", "executive-init", "executive-finalize", "time"}
"""The facts without slots."""
TEST_FACTS = {"b"}
"""The facts of the mock feature, whose templates belong to the original's test."""

_STRINGS = r'((?:"(?:\\.|[^"\\])*"\s*)+)'
_FUNCTION = re.compile(r'add_function\(\s*(?://\s*)?"([^"]+)"')
_FACT = re.compile(rf"assert_fact(?:_f)?\(\s*{_STRINGS}")
_PIECE = re.compile(r'"((?:\\.|[^"\\])*)"')
_SLOT = re.compile(r"\(([a-z][\w-]*)")


def find_cpp_files() -> Iterator[Path]:
    """Yield the C++ files of the original without tests."""
    assert ROS2CX_DIR is not None
    for file in sorted(ROS2CX_DIR.rglob("src/**/*.cpp")):
        if "test" not in file.relative_to(ROS2CX_DIR).parts and "/clips/tests/" not in str(file):
            yield file


def find_functions() -> dict[str, str]:
    """Return the CLIPS functions of the original and their files, with functions in comments."""
    return {name: file.name for file in find_cpp_files() for name in _FUNCTION.findall(file.read_text())}


def find_facts() -> dict[str, set[str]]:
    """Return the asserted facts of the original, as relations and their slots."""
    slots_by_relation: dict[str, set[str]] = {}
    for file in find_cpp_files():
        for strings in _FACT.findall(file.read_text()):
            text = "".join(_PIECE.findall(strings)).replace('\\"', '"')
            relation, *slots = _SLOT.findall(text)
            if relation not in ORDERED:
                slots_by_relation.setdefault(relation, set()).update(slots)
            else:
                slots_by_relation.setdefault(relation, set())
    return slots_by_relation


@needs_ros2cx
def test_all_original_functions_are_defined(tmp_path: Path) -> None:
    names = find_functions()
    assert len(names) >= 27
    defined: set[str] = set()

    def inspect(env: ClipsEnvironment) -> None:
        defined.update(env.udfs.names)

    load_agent("test-nav2", look=inspect)
    blackboard_names = {name for name in names if name.startswith("blackboard-")}
    assert {name for name in names if name not in defined} == blackboard_names
    assert blackboard_names <= set(blackboard_functions(tmp_path))


def blackboard_functions(folder: Path) -> list[str]:
    from ros2cx_tests.test_blackboard_feature import Bench

    bench = Bench(folder)
    bench.manager.close()
    return bench.defined


@needs_ros2cx
def test_original_facts_have_templates_with_slots() -> None:
    missing: set[str] = set()

    def inspect(env: ClipsEnvironment) -> None:
        assert env.call("path-load", "blackboard.clp") == Symbol("TRUE")
        for relation, slots in find_facts().items():
            if relation in ORDERED:
                continue
            has_template = env.has_template(relation)
            if not has_template or any(
                env.call("deftemplate-slot-existp", Symbol(relation), Symbol(slot)) != "TRUE"
                for slot in slots
            ):
                missing.add(relation)

    load_agent("test-nav2", look=inspect)
    assert missing == TEST_FACTS
