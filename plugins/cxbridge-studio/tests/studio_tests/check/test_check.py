"""The check finds each mistake of an agent once, at its place, without a run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from cxbridge.clipstext.syntax import definitions
from cxbridge.executive.executive import BUILTIN_CX
from cxbridge.run import RunOptions
from cxbridge.run.result import BAD_INPUT, TIMED_OUT
from cxbridge_studio.agent import sub_types
from cxbridge_studio.check.formats import FORMATS, format_text
from cxbridge_studio.check.run import check
from tests.run import mini
from tests.support import needs_plugin, scenarios_of_installed_plugins, share

TREES = (BUILTIN_CX / "goal-tree.clp").read_text()
SCENARIOS = [folder.name for folder in scenarios_of_installed_plugins()]

SPEC = """\
clips-executive:
  spec: s
  assert-time-each-loop: true
  specs:
    s:
      action-mapping:
        greet: say{text=?(who)s}
      init:
        stage-1:
          - name: pddl-parser
        stage-3:
          - name: agent
            files: [people.clp, agent.clp]
"""
DOMAIN_CLP = '(defrule load (executive-init) => (parse-pddl-domain (path-resolve "domain.pddl")))\n'
DOMAIN = (
    "(define (domain d) (:requirements :strips :negative-preconditions) (:predicates (met ?who)) "
    "(:action greet :parameters (?who) :precondition (not (met ?who)) :effect (met ?who)))\n"
)
AGENT = "(deftemplate thing (slot a) (slot b)) (deffacts things (thing (a 1))) (defrule look (thing) =>)\n"


def write_agent(folder: Path, clips: str = "", **files: str) -> Path:
    """Write a correct agent with additional CLIPS text and files."""
    texts = {
        "scenario_yaml": SPEC,
        "people_clp": DOMAIN_CLP,
        "domain_pddl": DOMAIN,
        "agent_clp": AGENT + clips,
    }
    for name, text in (texts | files).items():
        (folder / name.replace("_", ".")).write_text(text)
    return folder


def list_findings(folder: Path) -> list[tuple[str, str, int, int]]:
    return [
        (finding.code.name, Path(finding.place.file).name, finding.place.line, finding.place.column)
        for finding in check(RunOptions(scenario=folder))
    ]


@pytest.mark.parametrize("name", share(SCENARIOS, 4))
def test_shipped_scenarios_have_no_findings(name):
    findings = check(RunOptions(scenario=Path(name)))
    assert findings == [], format_text(findings)


@pytest.mark.parametrize(
    ("clips", "code", "column", "message"),
    share(
        [
            ("(defrule r (thing (c 1)) => (halt))", "CX203", 20, "the deftemplate 'thing' has no slot 'c'"),
            ("(defrule r (thing (a ?x)) => (assert (thing (d ?x))))", "CX203", 46, "has no slot 'd'"),
            ("(defrule r (nothing (a 1)) => (halt))", "CX202", 12, "there is no deftemplate 'nothing'"),
            ("(defrule r (not (thng (a 1))) => (halt))", "CX202", 17, "there is no deftemplate 'thng'"),
            (
                '(defrule r (MotorInterface (id ?x)) => (blackboard-open "MotorInterface" ?x))',
                "CX202",
                12,
                "there is no deftemplate 'MotorInterface' until a rule opens the interface",
            ),
            ("(defrule r (thing (a ?x)) => (fooo ?x))", "CX204", 31, "there is no function 'fooo'"),
            ("(defrule r (thing) => (printout t ?*no*))", "CX205", 35, "there is no global variable ?*no*"),
            ("(defrule r (thing) => (sym-cat))", "CX206", 24, "'sym-cat' expected at least 1 argument"),
            (
                "(deffunction f (?a) ?a)(defrule r (thing) => (f))",
                "CX206",
                47,
                "'f' expected exactly 1 argument",
            ),
            ("(defrule r (thing (a ?x)) => (printout t ?y))", "CX207", 42, "?y"),
            (
                "(defrule r (thing (a ?x)) => (bind ?f (assert (thing (a 1 2)))))",
                "CX206",
                20,
                "single field slot 'a'",
            ),
            ("(defrule r (thing (a ?x) => (halt))", "CX201", 12, "defrule r never closes"),
        ],
        5,
    ),
    ids=lambda value: value if isinstance(value, str) and value.startswith("(") else "",
)
def test_refused_construct_has_one_finding(tmp_path, clips, code, column, message):
    findings = check(RunOptions(scenario=write_agent(tmp_path, clips)))
    assert [(finding.code.name, finding.place.line, finding.place.column) for finding in findings] == [
        (code, 2, column)
    ]
    assert message in findings[0].message


def test_unclosed_parenthesis_has_one_finding(tmp_path):
    clips = (
        "(defrule one (thing (a 1) => (halt))\n\n(deffunction two () 2)\n(defrule three (thing) => (two))\n"
    )
    (finding,) = check(RunOptions(scenario=write_agent(tmp_path, clips)))
    assert (finding.code.name, finding.place.line) == ("CX201", 2)
    assert finding.message == ("defrule one never closes: its list (thing is open")
    assert finding.hint == "a ) is missing before line 4; defrule begins in line 2"


def test_consequence_of_mistake_has_no_finding(tmp_path):
    clips = "(deffunction two () (fooo))\n(defrule three (thing) => (two))\n"
    (finding,) = check(RunOptions(scenario=write_agent(tmp_path, clips)))
    assert (finding.code.name, finding.place.line, finding.message) == (
        "CX204",
        2,
        "deffunction two: there is no function 'fooo'",
    )


def test_hint_names_file_that_defines_function_later(tmp_path):
    scenario = SPEC.replace("agent.clp]", "agent.clp, later.clp]")
    write_agent(
        tmp_path, "(defrule r (thing) => (late))", scenario_yaml=scenario, later_clp="(deffunction late () 1)"
    )
    (finding,) = check(RunOptions(scenario=tmp_path))
    assert finding.hint == "later.clp defines it, and is loaded later: load it earlier"


@needs_plugin("robot-memory")
def test_hint_names_feature_of_unknown_function(tmp_path):
    (finding,) = check(
        RunOptions(scenario=write_agent(tmp_path, "(defrule r (thing) => (robmem-query a b))"))
    )
    assert finding.code.name == "CX204"
    assert finding.hint == "it is a function of the feature robot_memory: request it in stage-1 of the spec"


def test_comment_with_reason_silences_finding(tmp_path):
    broken = "(defrule r (thing (c 1)) => (halt))"
    assert list_findings(write_agent(tmp_path, f"; cx-check: ignore CX203 known\n{broken}")) == []
    assert list_findings(write_agent(tmp_path, f"; cx-check: ignore CX203\n{broken}")) != []  # no reason
    assert list_findings(write_agent(tmp_path, f"; cx-check: ignore CX204 another\n{broken}")) != []


@pytest.mark.parametrize("target", ["arm.py:Arms", "none.py:Arm", "arm"])
def test_finding_about_broken_executor_has_place(tmp_path, target):
    board = f'skill-board: {{agents: {{r1: {{executors: {{arm: {{class: "{target}"}}}}}}}}}}\n'
    folder = write_agent(tmp_path, scenario_yaml=SPEC + board)
    (folder / "arm.py").write_text("class Arm: pass\n")
    ((code, file, line, _),) = list_findings(folder)
    assert code == "CX411"
    assert (file, line) in {("scenario.yaml", 14), ("arm.py", 1), ("none.py", 0)}


def test_formats_of_findings(tmp_path):
    findings = check(RunOptions(scenario=write_agent(tmp_path, "(defrule r (thing (c 1)) => (halt))")))
    file = str(tmp_path / "agent.clp")
    assert json.loads(FORMATS["json"](findings)) == [
        {
            "code": "CX203",
            "severity": "error",
            "file": file,
            "line": 2,
            "column": 20,
            "message": "defrule r: the deftemplate 'thing' has no slot 'c'",
            "hint": "it has: a, b",
        }
    ]
    assert FORMATS["github"](findings) == (
        f"::error file={file},line=2,col=20,title=CX203"
        "::defrule r: the deftemplate 'thing' has no slot 'c'%0Ait has: a, b"
    )
    assert FORMATS["text"](findings).splitlines()[-1] == "1 error"


GOAL = """
(defrule make (thing) => (assert (goal (id G) (class WALK))))
(defrule select ?g <- (goal (id G) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(deffunction plan-it (?id) (assert (plan (id p) (goal-id ?id))))
"""


@pytest.mark.parametrize(
    ("rule", "is_expanded"),
    [
        ("(defrule x ?g <- (goal (class WALK) (mode SELECTED)) => (modify ?g (mode EXPANDED)))", True),
        ("(defrule x (goal (id ?id) (class WALK) (mode SELECTED)) => (plan-it ?id))", True),
        ("(defrule x (goal (id ?id) (mode SELECTED)) => (assert (plan (id p) (goal-id ?id))))", True),
        ("(defrule x ?g <- (goal (mode ?m&SELECTED|EXPANDED)) => (modify ?g (mode COMMITTED)))", True),
        ("(defrule x ?g <- (goal (class ?c&:(eq ?c WALK)) (mode SELECTED)) => (retract ?g))", True),
        ('(defrule x (goal (class WALK) (mode SELECTED)) => (printout t "walk"))', False),
        ("(defrule x ?g <- (goal (class RUN) (mode SELECTED)) => (modify ?g (mode EXPANDED)))", False),
        ("(defrule x ?g <- (goal (class WALK) (mode EXPANDED)) => (modify ?g (mode COMMITTED)))", False),
    ],
)
def test_goal_class_without_expanding_rule_is_found(tmp_path, rule, is_expanded):
    codes = [finding[0] for finding in list_findings(write_agent(tmp_path, GOAL + rule))]
    assert ("CX505" in codes) is not is_expanded


SUB_TYPE = """
(defrule make (thing) => {action})
(defrule select ?g <- (goal (id G) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(defrule expand ?g <- (goal (id G) (mode SELECTED)) => (modify ?g (mode EXPANDED)))
"""
MAKERS = [finding.name for finding in definitions(TREES) if finding.name.startswith("goal-tree-assert-")]
FILES = sub_types.find_core_files(BUILTIN_CX)


@pytest.mark.parametrize(("sub_type", "file"), share(FILES.items(), 2))
def test_sub_type_without_loaded_file_is_found(tmp_path, sub_type, file):
    clips = SUB_TYPE.format(action=f"(assert (goal (id G) (class WALK) (sub-type {sub_type})))")
    folder = write_agent(tmp_path, clips)
    (finding,) = check(RunOptions(scenario=folder))
    assert (finding.code.name, finding.place.line, finding.place.column) == ("CX508", 3, 34)
    assert finding.message == f"no rule handles goals of the sub-type {sub_type}"
    assert finding.hint == f"add {file} to the files of the spec"
    other_files = sorted({*FILES.values()} - {file})
    write_agent(
        folder, clips, scenario_yaml=SPEC.replace("agent.clp", f"{', '.join(other_files)}, agent.clp")
    )
    assert [finding_row[0] for finding_row in list_findings(folder)] == ["CX508"]
    write_agent(folder, clips, scenario_yaml=SPEC.replace("agent.clp", f"{file}, agent.clp"))
    assert list_findings(folder) == []


@pytest.mark.parametrize("name", share(MAKERS, 3))
def test_sub_type_of_core_function_without_loaded_file_is_found(tmp_path, name):
    clips = SUB_TYPE.format(action=f"({name} WALK NONE (assert (goal (id G) (class RUN))))")
    spec = SPEC.replace("agent.clp", "goal-tree.clp, agent.clp")
    (finding,) = check(RunOptions(scenario=write_agent(tmp_path, clips, scenario_yaml=spec)))
    assert (finding.code.name, finding.place.column) == ("CX508", 26)
    loaded = finding.hint.split()[1]
    write_agent(tmp_path, clips, scenario_yaml=spec.replace("goal-tree.clp", f"goal-tree.clp, {loaded}"))
    assert list_findings(tmp_path) == []


@pytest.mark.parametrize(
    ("sub_type", "rule"),
    [
        ("SIMPLE", "?g <- (goal (sub-type SIMPLE) (mode EXPANDED))"),
        ("SIMPLE", "?g <- (goal (sub-type OTHER|SIMPLE) (mode EXPANDED))"),
        ("SIMPLE", "?g <- (goal (sub-type ?s&:(eq ?s SIMPLE)) (mode EXPANDED))"),
        ("SIMPLE", "?g <- (goal (mode EXPANDED))"),
        (
            "RETRY-SUBGOALS",
            "?g <- (goal (id ?i)) (or (goal (id ?i) (sub-type RETRY-SUBGOALS)) (goal (id ?i) (sub-type A)))",
        ),
        ("RETRY-SUBGOALS", "?g <- (goal (class WALK) (mode EXPANDED))"),
        ("nil", "?g <- (goal (class RUN) (mode EXPANDED))"),
    ],
)
def test_sub_type_handled_by_agent_has_no_finding(tmp_path, sub_type, rule):
    clips = SUB_TYPE.format(action=f"(assert (goal (id G) (class WALK) (sub-type {sub_type})))")
    clips += f"(defrule commit {rule} => (modify ?g (mode COMMITTED)))"
    assert "CX508" not in [finding[0] for finding in list_findings(write_agent(tmp_path, clips))]


STEPS = """
(deffunction step (?action $?values)
  (assert (plan-action (id 1) (action-name ?action) (param-values $?values))))
(deffunction named (?action ?names ?values)
  (assert (plan-action (id 1) (action-name ?action) (param-names ?names) (param-values ?values))))
"""


@pytest.mark.parametrize(
    ("call", "code"),
    share(
        [
            ("(step greet peggy)", None),
            ("(step gret peggy)", "CX303"),
            ("(named greet (create$ who) (create$ peggy))", None),
            ("(named gret (create$ who) (create$ peggy))", "CX303"),
        ],
        4,
    ),
)
def test_action_planned_by_function_is_checked(tmp_path, call, code):
    used = f"{call} (step greet a) (named greet who b)"
    clips = f"(defglobal ?*names* = (create$))\n{STEPS}(defrule plan (thing) => {used})"
    codes = [finding[0] for finding in list_findings(write_agent(tmp_path, clips))]
    assert codes == [code] * (code is not None)


MODULES = """\
(defmodule ALONE)
(deftemplate ALONE::thing (slot c))
(defclass ALONE::ROBOT (is-a USER)
  (role concrete) (single-slot label) (multislot seen (create-accessor read)))
(definstances ALONE::robots (r1 of ROBOT (label "one") (seen a b)) ([r2] of ROBOT))
(defmessage-handler ALONE::ROBOT greet primary (?who) (printout t ?self:label " " ?who crlf))
(deffacts ALONE::begin (thing (c 1)) (thing (c 2)))
(defrule ALONE::greet
  (thing (c ?x))
  ?robot <- (object (is-a ROBOT) (label ?name) (seen $? ?y&:(> (length$ (create$ ?y)) 0) $?))
  =>
  (make-instance (gensym*) of ROBOT (label (str-cat "r" ?x)) (seen ?y))
  (modify-instance ?robot (seen (rest$ (create$ ?x ?y))))
  (do-for-all-instances ((?r ROBOT)) (eq ?r:label ?name) (send ?r greet (nth$ 1 ?r:seen)))
  (focus ALONE))
"""


def test_modules_and_objects_have_no_findings(tmp_path):
    assert list_findings(write_agent(tmp_path, MODULES)) == []


def test_each_file_begins_in_main_module(tmp_path):
    module = '(defmodule ALONE) (deffunction ALONE::more () (load* "more.clp")) (defrule ALONE::r => (more))'
    folder = write_agent(tmp_path, module, more_clp="")
    (folder / "scenario.yaml").write_text(SPEC.replace("agent.clp", "agent.clp, last.clp"))
    (folder / "last.clp").write_text("(defrule last (wm-fact (key a)) => (assert (wm-fact (key a))))")
    assert list_findings(folder) == []


def test_mistake_in_module_is_found_in_its_file(tmp_path):
    clips = MODULES + "(defrule ALONE::wrong ?t <- (thing (c 1)) => (modify ?t (d 2)))"
    assert {(code, name) for code, name, *_ in list_findings(write_agent(tmp_path, clips))} == {
        ("CX210", "agent.clp")
    }


def test_forward_declared_functions_have_no_finding(tmp_path):
    declared = "(deffunction odd (?n))(deffunction even (?n) (odd ?n))"
    used = "(deffunction odd (?n) (even ?n))(defrule r => (printout t (even 2)))"
    assert list_findings(write_agent(tmp_path, declared + used)) == []
    redefinition = "(deffunction odd (?n) 1)"
    assert [code for code, *_ in list_findings(write_agent(tmp_path, declared + used + redefinition))] == [
        "CX208"
    ]
    definitions = "(deffunction odd (?n) ?n)(deffunction even (?n) (odd ?n))"
    assert [code for code, *_ in list_findings(write_agent(tmp_path, definitions + used))] == ["CX208"]


@pytest.mark.parametrize(
    ("clips", "message", "hint"),
    [
        ("(defrule r (initial-fact) => (halt))", "no 'initial-fact'", "omit (initial-fact)"),
        ("(deffacts f (pair 1)) (defrule r (pair ?) (pear ?) => (halt))", "'pear'", "did you mean pair?"),
        ("(defrule r (time ?now) => (halt))", "needs 1 field, but facts 'time' have 2", "(time ? ?)"),
        ("(deffacts f (pair 1 2)) (defrule r (pair ?x) => (assert (pair ?x 3)))", "1 field", "(pair ? ?)"),
    ],
)
def test_pattern_without_possible_fact_is_found(tmp_path, clips, message, hint):
    (finding,) = check(RunOptions(scenario=write_agent(tmp_path, clips)))
    assert finding.code.name == "CX501"
    assert message in finding.message
    assert hint in finding.hint


@pytest.mark.parametrize(
    "clips",
    [
        "(defrule r (time $?now) (time ? ?) (time ?s $?) => (halt))",
        "(deffacts f (pair 1 2)) (defrule r (pair ?x) => (assert (pair (create$ ?x))))",
        "(deffacts f (initial-fact)) (defrule r (initial-fact) => (halt))",
        '(defrule r (pair ?) => (load-facts "pairs.txt"))',
    ],
)
def test_pattern_with_possible_fact_has_no_finding(tmp_path, clips):
    assert list_findings(write_agent(tmp_path, clips)) == []


def test_file_is_checked_as_part_of_agent(tmp_path):
    folder = write_agent(
        tmp_path, "(defrule r (thing (c 1)) => (halt))", people_clp=DOMAIN_CLP + "(deffacts f (no))"
    )
    assert [code for code, *_ in list_findings(folder / "agent.clp")] == ["CX203"]
    assert [code for code, *_ in list_findings(folder / "people.clp")] == ["CX502"]


@pytest.mark.parametrize("scenario", [SPEC, "clips-executive: ["])
def test_file_beside_other_or_broken_agent_is_checked(tmp_path, scenario):
    file = write_agent(tmp_path, scenario_yaml=scenario, program_clp=MODULES) / "program.clp"
    assert list_findings(file) == []
    file.write_text("(defrule begin => (foo))")
    assert [code for code, *_ in list_findings(file)] == ["CX204"]


PROGRAM = {
    "main.clp": (
        "(clear)\n(defmodule MAIN (export ?ALL))\n(load* parts/a.clp)\n"
        "(if TRUE then (load parts/b.clp))\n(run)\n"
    ),
    "parts/a.clp": "(deftemplate MAIN::job (slot name))\n(defmodule WORK (import MAIN ?ALL))\n",
    "parts/b.clp": (
        "(deffacts WORK::jobs (job (name a)))\n(defrule WORK::do (job (name ?n)) => (printout t ?n))\n"
    ),
    "cases/one.clp": "(batch* main.clp)\nanswer\n",
}
"""A program for the CLIPS command ``batch``, which loads files of its folder and of the parent folder."""


@pytest.mark.parametrize("name", ["main.clp", "cases/one.clp"])
def test_files_loaded_by_program_are_checked(tmp_path, name):
    for path, text in PROGRAM.items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text)
    assert list_findings(tmp_path / name) == []
    (tmp_path / "parts" / "b.clp").write_text(PROGRAM["parts/b.clp"].replace("(name a)", "(nam a)"))
    assert list_findings(tmp_path / name) == [("CX203", "b.clp", 1, 28)]
    (tmp_path / "parts" / "b.clp").unlink()
    assert {code for code, *_ in list_findings(tmp_path / name)} == {"CX102"}


def test_facts_with_core_names_are_found(tmp_path):
    clips = "(deffacts wanted (goal at 1 2)) (defrule r (goal at ?x ?y) => (halt))"
    file = tmp_path / "program.clp"
    file.write_text(clips)
    assert [code for code, *_ in list_findings(file)] == ["CX212"]
    findings = check(RunOptions(scenario=write_agent(tmp_path, clips)))
    assert {finding.code.name for finding in findings} == {"CX209"}
    assert all("'goal' has slots" in finding.message and "core" in finding.hint for finding in findings)


def test_arguments_of_skill_are_checked_in_its_skill_space(tmp_path):
    """Two skill spaces have skills with the same name and different arguments."""
    for space, argument in (("mine", "words"), ("other", "text")):
        (tmp_path / "lua" / space).mkdir(parents=True)
        (tmp_path / "lua" / f"{space}.lua").write_text(f'skillenv.use_skill("skills.{space}.say")\n')
        (tmp_path / "lua" / space / "say.lua").write_text(
            f'module(..., skillenv.module_init)\nname = "say"\ndocumentation = [==[@param {argument} it]==]\n'
        )
    folder = write_agent(tmp_path, scenario_yaml=SPEC + "skiller: {skillspace: mine}\n")
    (finding,) = check(RunOptions(scenario=folder, skill_dirs=(tmp_path / "lua",)))
    assert (finding.code.name, finding.hint) == ("CX413", "it has: words")
    folder = write_agent(tmp_path, scenario_yaml=SPEC + "skiller: {skillspace: other}\n")
    assert check(RunOptions(scenario=folder, skill_dirs=(tmp_path / "lua",))) == []


@pytest.mark.parametrize(
    ("clips", "word", "hint"),
    [
        ("(deffacts f (mode (is ONN)))", "ONN", "did you mean ON? it can be: OFF, ON"),
        ("(defrule r (mode (is ?x&OFF|ONN)) => (halt))", "ONN", "did you mean ON? it can be: OFF, ON"),
        ("(defrule r (thing) => (assert (mode (is middle))))", "middle", "it can be: OFF, ON"),
    ],
)
def test_refused_value_is_found_with_hint(tmp_path, clips, word, hint):
    template = "(deftemplate mode (slot is (allowed-values ON OFF)))"
    finding = check(RunOptions(scenario=write_agent(tmp_path, template + clips)))[0]
    assert finding.code.name == "CX209"
    assert finding.message.endswith(f"the slot 'is' of 'mode' cannot be {word}")
    assert finding.hint == hint


PLANNER = (
    '(defrule load (executive-init) => (ff-feature-request "planner") (parse-pddl-domain "domain.pddl"))\n'
)


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("(and (met Anna) (not (met Bob)))", ""),
        ("(forall (?x - object) (met ?x))", ""),
        ("(meet Anna)", "unknown predicate 'meet'"),
        ("(and (met Ana))", "unknown object 'Ana'"),
    ],
)
def test_unknown_names_in_planner_goal_are_found(tmp_path, formula, message):
    objects = "(deffacts o (domain-object (name Anna)) (domain-object (name Bob)))"
    clips = f'{objects}(defrule r (thing) => (planner-plan A "{formula}"))'
    findings = check(RunOptions(scenario=write_agent(tmp_path, clips, people_clp=PLANNER)))
    assert [(finding.code.name, message in finding.message) for finding in findings] == (
        [("CX309", True)] if message else []
    )


def test_plannable_action_without_executor_is_found(tmp_path):
    domain = DOMAIN.replace("(:action", "(:action wave :parameters (?who) :effect (met ?who)) (:action", 1)
    clips = '(defrule r (thing) => (planner-plan A "(met Anna)"))'
    folder = write_agent(tmp_path, clips, people_clp=PLANNER, domain_pddl=domain)
    (finding,) = check(RunOptions(scenario=folder))
    assert finding.code.name == "CX404"
    assert "'wave', which a planner may plan" in finding.message


ROS = """
skill-board:
  agents:
    robot1:
      executors:
        ros:
          class: cxbridge_ros2.skills:RosSkills
          packages: [ros]
          skills:
            say:
              {kind}: {name}
              name: /say
              {field}
"""
DRIVE = "float32 far\n---\nstring reason\n---\nfloat32 left\ngeometry_msgs/Pose at\n"


@pytest.mark.parametrize(
    ("kind", "name", "field", "message"),
    share(
        [
            ("service", "std_srvs/srv/Trigger", "success: success", ""),
            ("service", "std_srvs/srv/Trigger", "error: mesage", "Trigger_Response has no field 'mesage'"),
            ("service", "std_srvs/srv/Triger", "", "unknown ROS 2 type std_srvs/srv/Triger"),
            ("action", "robots/action/Drive", "feedback: at.position.x", ""),
            (
                "action",
                "robots/action/Drive",
                "feedback: at.positon.x",
                "geometry_msgs/msg/Pose has no field 'positon'",
            ),
            ("action", "robots/action/Drive", "error: why", "Drive_Result has no field 'why'"),
            ("action", "robots/action/Dive", "", "unknown ROS 2 type robots/action/Dive"),
        ],
        3,
    ),
)
def test_unknown_types_and_fields_of_ros_skills_are_found(tmp_path, kind, name, field, message):
    pytest.importorskip("rosbags", reason="the extra 'ros2' is not installed")
    package = tmp_path / "ros" / "robots"
    (package / "action").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robots</name></package>")
    (package / "action" / "Drive.action").write_text(DRIVE)
    folder = write_agent(tmp_path, scenario_yaml=SPEC + ROS.format(kind=kind, name=name, field=field))
    findings = check(RunOptions(scenario=folder))
    assert [(finding.code.name, message in finding.message) for finding in findings] == (
        [("CX415", True)] if message else []
    )


@pytest.mark.parametrize(
    ("template", "is_wrong"),
    [
        ("goto{place=?(to)s", True),
        ("goto place", True),
        ('goto{place="?(to)s}', True),
        ("goto(?(to)s)", False),
        ("?(to)y{}", False),
        ("x = 1; goto(x)", False),  # a Skiller of Fawkes evaluates Lua
    ],
)
def test_invalid_skill_template_is_found_in_its_line(tmp_path, template, is_wrong):
    folder = write_agent(
        tmp_path, scenario_yaml=SPEC.replace("greet: say{text=?(who)s}", f"greet: '{template}'")
    )
    places = [(finding[1], finding[2]) for finding in list_findings(folder) if finding[0] == "CX405"]
    assert places == ([("scenario.yaml", 7)] if is_wrong else [])


def test_failed_run_names_findings_of_check(tmp_path, capsys):
    agent_text = mini.AGENT.replace("(mode DISPATCHED)", "(mod DISPATCHED)")
    assert (
        invoke(["run", str(mini.write_scenario(tmp_path, agent=agent_text)), "--timeout", "5"]) == TIMED_OUT
    )
    assert "error CX210: defrule mini-dispatch: the deftemplate 'goal'" in capsys.readouterr().err


def test_misspelt_action_mapping_is_reported_once(tmp_path):
    scenario = SPEC.replace("action-mapping:", "action-maping:")
    scenario = scenario.replace("- name: pddl-parser", "- name: pddl-parser\n          - name: planner")
    plan = '(defrule plan (executive-init) => (planner-plan A "(met ann)"))'
    assert [finding[0] for finding in list_findings(write_agent(tmp_path, plan, scenario_yaml=scenario))] == [
        "CX117"
    ]


def test_command_names_files_relative_to_working_directory(tmp_path, monkeypatch, capsys):
    write_agent(tmp_path, ") junk", scenario_yaml=SPEC.replace("say{", "sya{"))
    monkeypatch.chdir(tmp_path)
    assert invoke(["check", "."]) == 1
    lines = [line for line in capsys.readouterr().out.splitlines() if " error CX" in line]
    assert [line.partition(":")[0] for line in lines] == ["scenario.yaml", "agent.clp"]


def test_folder_named_scenario_yaml_is_reported(tmp_path, capsys):
    (tmp_path / "scenario.yaml").mkdir()
    assert invoke(["run", str(tmp_path)]) == BAD_INPUT
    assert f"{tmp_path / 'scenario.yaml'}: the folder has no configuration file" in capsys.readouterr().err
