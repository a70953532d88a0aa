"""Templates of PDDL problems."""

from __future__ import annotations

import pytest

from cxbridge_planning import PlanningError
from cxbridge_planning.fawkes.templates import ProblemTemplate
from cxbridge_robot_memory.values import ObjectId
from tests.support import SHARED, needs_shared

DOCUMENTS = {
    "OBJECTS": [{"name": "BOB", "type": "name"}, {"name": "HELLO", "type": "text"}],
    "FACTS": [{"name": "said", "param_values": ["BOB", "HELLO"]}],
}


def fill(text, documents=None, **values):
    return ProblemTemplate(text).fill(documents or {}, values)


def test_section_is_repeated_for_each_document():
    text = '(:objects<<#OBJECTS|{"relation": "domain-object"}>> <<name>> - <<type>><</OBJECTS>>)'
    assert fill(text, DOCUMENTS) == "(:objects BOB - name HELLO - text)"
    assert ProblemTemplate(text).queries == {"OBJECTS": {"relation": "domain-object"}}


def test_array_has_blank_before_each_element():
    text = "<<#FACTS|{}>>(<<name>> <<param_values>>) <<param_values_1>><</FACTS>>"
    assert fill(text, DOCUMENTS) == "(said  BOB HELLO) HELLO"


def test_values_of_all_types():
    document = {
        "whole": 3,
        "real": 1.5,
        "yes": True,
        "id": ObjectId("0123456789abcdef01234567"),
        "none": None,
        "in": {"side": {"deep": "x"}},
        "list": [{"a": 1}],
    }
    text = "<<#D|{}>><<whole>> <<real>> <<yes>> <<id>> <<none>> <<in_side_deep>> <<list_0_a>> <<no>>.<</D>>"
    assert fill(text, {"D": [document]}) == "3 1.500000 1 0123456789abcdef01234567 INVALID_VALUE_TYPE x 1 ."


def test_goal_is_filled_inside_and_outside_sections():
    assert fill("<<GOAL>><<#D|{}>>,<<GOAL>><</D>>", {"D": [{}, {}]}, GOAL="(g)") == "(g),(g),(g)"


def test_repeated_and_nested_sections():
    text = "<<#D|{}>><<a>><</D>>|<<#D>>[<<a>>]<</D>><<#E>>never<</E>>"
    assert fill(text, {"D": [{"a": "1"}, {"a": "2"}]}) == "12|[1][2]"
    nested = '<<#D|{}>><<a>>:<<#E|{"b": 1}>><<a>><<b>><</E>> <</D>>'
    assert fill(nested, {"D": [{"a": "1"}, {"a": "2"}], "E": [{"b": "x"}]}) == "1:1x 2:2x "


def test_queries_of_old_templates_are_read():
    template = ProblemTemplate(
        "<<#D|{relation:'domain-fact', $or: [{a.b: 1}]}>><</D>><<#K|{a: 1}>><</K>><<#Q|{'a': 1}>><</Q>>"
    )
    assert template.queries == {
        "D": {"relation": "domain-fact", "$or": [{"a.b": 1}]},
        "K": {"a": 1},
        "Q": {"a": 1},
    }


def test_text_without_sections_is_unchanged():
    assert fill("plain > text <") == "plain > text <"


def test_different_queries_of_same_name_give_warning():
    assert ProblemTemplate('<<#D|{}>><</D>><<#D|{"a": 1}>><</D>>').warnings
    assert not ProblemTemplate("<<#D|{}>><</D>><<#D|{}>><</D>>").warnings


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("\n<<#D|{}>>", "section <<#D>> is never closed", 2),
        ("\n\n<</D>>", "<</D>> does not close a section", 3),
        ("<<#D|{}>><<#E|{}>><</D>>", "<</D>> does not close a section", 1),
        ("<<#D|{relation}>><</D>>", "is not JSON", 1),
        ("<<#D|{'a': b}>><</D>>", "is not JSON", 1),
        ("<<#D|[1]>><</D>>", "is not a JSON object", 1),
    ],
)
def test_invalid_template_is_reported_with_line(text, message, line):
    with pytest.raises(PlanningError, match=r"x\.tpl") as caught:
        ProblemTemplate(text, "x.tpl")
    assert message in caught.value.message
    assert caught.value.line == line


@needs_shared
@pytest.mark.parametrize("scenario", ["test-scenario-pddl", "visit-all", "rcll"])
def test_templates_of_fawkes_are_read(scenario):
    path = SHARED / "fawkes-data/pddl" / scenario / "problem-template.pddl"
    template = ProblemTemplate(path.read_text(), str(path))
    assert template.queries
    assert template.fill({}, {"GOAL": "(and)"})
