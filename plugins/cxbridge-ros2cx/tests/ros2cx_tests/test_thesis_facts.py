"""Every function of the thesis' C++ is defined here, and its facts have templates."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from ros2cx_tests.inside import look_inside
from tests.support import ROS2CX_DIR, needs_ros2cx

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

    bench = Bench(folder)
    bench.manager.close()
    return bench.defined


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
