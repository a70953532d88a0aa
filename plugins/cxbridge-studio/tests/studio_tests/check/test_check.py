"""Mistakes of an agent are found without running it: each once, at its place, and nothing else."""

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


def agent(folder: Path, clips: str = "", **files: str) -> Path:
    """Write an agent without mistakes but for the given ones."""
    texts = {
        "scenario_yaml": SPEC,
        "people_clp": DOMAIN_CLP,
        "domain_pddl": DOMAIN,
        "agent_clp": AGENT + clips,
    }
    for name, text in (texts | files).items():
        (folder / name.replace("_", ".")).write_text(text)
    return folder


def found(folder: Path) -> list[tuple[str, str, int, int]]:
    return [
        (each.code.name, Path(each.place.file).name, each.place.line, each.place.column)
        for each in check(RunOptions(scenario=folder))
    ]


@pytest.mark.parametrize("name", share(SCENARIOS, 4))
def test_the_shipped_scenarios_are_fine(name):
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
def test_a_construct_that_clips_drops(tmp_path, clips, code, column, message):
    findings = check(RunOptions(scenario=agent(tmp_path, clips)))
    assert [(each.code.name, each.place.line, each.place.column) for each in findings] == [(code, 2, column)]
    assert message in findings[0].message


def test_a_parenthesis_that_never_closes_is_one_finding(tmp_path):
    clips = (
        "(defrule one (thing (a 1) => (halt))\n\n(deffunction two () 2)\n(defrule three (thing) => (two))\n"
    )
    (one,) = check(RunOptions(scenario=agent(tmp_path, clips)))
    assert (one.code.name, one.place.line) == ("CX201", 2)
    assert one.message == ("defrule one never closes: its list (thing is open")
    assert one.hint == "a ) is missing before line 4; defrule begins in line 2"


def test_what_follows_from_a_mistake_is_no_second_finding(tmp_path):
    clips = "(deffunction two () (fooo))\n(defrule three (thing) => (two))\n"
    (one,) = check(RunOptions(scenario=agent(tmp_path, clips)))
    assert (one.code.name, one.place.line, one.message) == (
        "CX204",
        2,
        "deffunction two: there is no function 'fooo'",
    )


def test_a_function_that_is_defined_later_is_named(tmp_path):
    scenario = SPEC.replace("agent.clp]", "agent.clp, later.clp]")
    agent(
        tmp_path, "(defrule r (thing) => (late))", scenario_yaml=scenario, later_clp="(deffunction late () 1)"
    )
    (one,) = check(RunOptions(scenario=tmp_path))
    assert one.hint == "later.clp defines it, and is loaded later: load it earlier"


@needs_plugin("robot-memory")
def test_a_function_of_a_feature_that_nobody_requests_is_named(tmp_path):
    (one,) = check(RunOptions(scenario=agent(tmp_path, "(defrule r (thing) => (robmem-query a b))")))
    assert one.code.name == "CX204"
    assert one.hint == "it is a function of the feature robot_memory: request it in stage-1 of the spec"


def test_a_comment_with_a_reason_silences(tmp_path):
    broken = "(defrule r (thing (c 1)) => (halt))"
    assert found(agent(tmp_path, f"; cx-check: ignore CX203 known\n{broken}")) == []
    assert found(agent(tmp_path, f"; cx-check: ignore CX203\n{broken}")) != []  # no reason
    assert found(agent(tmp_path, f"; cx-check: ignore CX204 another\n{broken}")) != []


@pytest.mark.parametrize("target", ["arm.py:Arms", "none.py:Arm", "arm"])
def test_an_executor_that_does_not_load_has_a_place(tmp_path, target):
    board = f'skill-board: {{agents: {{r1: {{executors: {{arm: {{class: "{target}"}}}}}}}}}}\n'
    folder = agent(tmp_path, scenario_yaml=SPEC + board)
    (folder / "arm.py").write_text("class Arm: pass\n")
    ((code, file, line, _),) = found(folder)
    assert code == "CX411"
    assert (file, line) in {("scenario.yaml", 14), ("arm.py", 1), ("none.py", 0)}


def test_the_formats(tmp_path):
    findings = check(RunOptions(scenario=agent(tmp_path, "(defrule r (thing (c 1)) => (halt))")))
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
    assert FORMATS["github"](findings).startswith(
        f"::error file={file},line=2,col=20,title=CX203::defrule r%3A"[:40]
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
def test_a_goal_class_that_a_rule_expands_or_not(tmp_path, rule, is_expanded):
    codes = [each[0] for each in found(agent(tmp_path, GOAL + rule))]
    assert ("CX505" in codes) is not is_expanded


SUB_TYPE = """
(defrule make (thing) => {made})
(defrule select ?g <- (goal (id G) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(defrule expand ?g <- (goal (id G) (mode SELECTED)) => (modify ?g (mode EXPANDED)))
"""
MAKERS = [each.name for each in definitions(TREES) if each.name.startswith("goal-tree-assert-")]
FILES = sub_types.find_core_files(BUILTIN_CX)


@pytest.mark.parametrize(("sub_type", "file"), share(FILES.items(), 2))
def test_a_sub_type_whose_file_is_not_loaded(tmp_path, sub_type, file):
    clips = SUB_TYPE.format(made=f"(assert (goal (id G) (class WALK) (sub-type {sub_type})))")
    folder = agent(tmp_path, clips)
    (finding,) = check(RunOptions(scenario=folder))
    assert (finding.code.name, finding.place.line, finding.place.column) == ("CX508", 3, 34)
    assert finding.message == f"no rule handles goals of the sub-type {sub_type}"
    assert finding.hint == f"add {file} to the files of the spec"
    others = sorted({*FILES.values()} - {file})
    agent(folder, clips, scenario_yaml=SPEC.replace("agent.clp", f"{', '.join(others)}, agent.clp"))
    assert [each[0] for each in found(folder)] == ["CX508"]
    agent(folder, clips, scenario_yaml=SPEC.replace("agent.clp", f"{file}, agent.clp"))
    assert found(folder) == []


@pytest.mark.parametrize("name", share(MAKERS, 3))
def test_a_function_of_the_core_gives_a_sub_type_whose_file_is_not_loaded(tmp_path, name):
    clips = SUB_TYPE.format(made=f"({name} WALK NONE (assert (goal (id G) (class RUN))))")
    spec = SPEC.replace("agent.clp", "goal-tree.clp, agent.clp")
    (finding,) = check(RunOptions(scenario=agent(tmp_path, clips, scenario_yaml=spec)))
    assert (finding.code.name, finding.place.column) == ("CX508", 26)
    loaded = finding.hint.split()[1]
    agent(tmp_path, clips, scenario_yaml=spec.replace("goal-tree.clp", f"goal-tree.clp, {loaded}"))
    assert found(tmp_path) == []


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
def test_a_sub_type_that_a_rule_of_the_agent_handles(tmp_path, sub_type, rule):
    clips = SUB_TYPE.format(made=f"(assert (goal (id G) (class WALK) (sub-type {sub_type})))")
    clips += f"(defrule commit {rule} => (modify ?g (mode COMMITTED)))"
    assert "CX508" not in [each[0] for each in found(agent(tmp_path, clips))]


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
def test_an_action_that_a_function_of_the_agent_plans(tmp_path, call, code):
    used = f"{call} (step greet a) (named greet who b)"
    clips = f"(defglobal ?*names* = (create$))\n{STEPS}(defrule plan (thing) => {used})"
    codes = [each[0] for each in found(agent(tmp_path, clips))]
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


def test_modules_and_objects_are_fine(tmp_path):
    assert found(agent(tmp_path, MODULES)) == []


def test_a_file_after_one_that_ends_in_a_module_is_of_main(tmp_path):
    module = '(defmodule ALONE) (deffunction ALONE::more () (load* "more.clp")) (defrule ALONE::r => (more))'
    folder = agent(tmp_path, module, more_clp="")
    (folder / "scenario.yaml").write_text(SPEC.replace("agent.clp", "agent.clp, last.clp"))
    (folder / "last.clp").write_text("(defrule last (wm-fact (key a)) => (assert (wm-fact (key a))))")
    assert found(folder) == []


def test_a_mistake_in_a_module_is_found_in_that_file_alone(tmp_path):
    clips = MODULES + "(defrule ALONE::wrong ?t <- (thing (c 1)) => (modify ?t (d 2)))"
    assert {(code, name) for code, name, *_ in found(agent(tmp_path, clips))} == {("CX210", "agent.clp")}


def test_functions_that_are_declared_before_they_call_each_other(tmp_path):
    declared = "(deffunction odd (?n))(deffunction even (?n) (odd ?n))"
    used = "(deffunction odd (?n) (even ?n))(defrule r => (printout t (even 2)))"
    assert found(agent(tmp_path, declared + used)) == []
    again = "(deffunction odd (?n) 1)"
    assert [code for code, *_ in found(agent(tmp_path, declared + used + again))] == ["CX208"]
    twice = "(deffunction odd (?n) ?n)(deffunction even (?n) (odd ?n))"
    assert [code for code, *_ in found(agent(tmp_path, twice + used))] == ["CX208"]


@pytest.mark.parametrize(
    ("clips", "message", "hint"),
    [
        ("(defrule r (initial-fact) => (halt))", "no 'initial-fact'", "omit (initial-fact)"),
        ("(deffacts f (pair 1)) (defrule r (pair ?) (pear ?) => (halt))", "'pear'", "did you mean pair?"),
        ("(defrule r (time ?now) => (halt))", "needs 1 field, but facts 'time' have 2", "(time ? ?)"),
        ("(deffacts f (pair 1 2)) (defrule r (pair ?x) => (assert (pair ?x 3)))", "1 field", "(pair ? ?)"),
    ],
)
def test_a_pattern_that_no_fact_can_match(tmp_path, clips, message, hint):
    (finding,) = check(RunOptions(scenario=agent(tmp_path, clips)))
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
def test_a_pattern_that_a_fact_may_match(tmp_path, clips):
    assert found(agent(tmp_path, clips)) == []


def test_one_file_is_checked_as_a_part_of_the_agent_around_it(tmp_path):
    folder = agent(
        tmp_path, "(defrule r (thing (c 1)) => (halt))", people_clp=DOMAIN_CLP + "(deffacts f (no))"
    )
    assert [code for code, *_ in found(folder / "agent.clp")] == ["CX203"]
    assert [code for code, *_ in found(folder / "people.clp")] == ["CX502"]


def test_one_file_alone(tmp_path):
    file = tmp_path / "program.clp"
    file.write_text(MODULES)
    assert found(file) == []
    file.write_text("(defrule begin => (foo))")
    assert [code for code, *_ in found(file)] == ["CX204"]


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
"""A program that CLIPS executes with ``batch``: it loads files of its folder, or of a folder around it."""


@pytest.mark.parametrize("name", ["main.clp", "cases/one.clp"])
def test_a_program_of_commands(tmp_path, name):
    for each, text in PROGRAM.items():
        (tmp_path / each).parent.mkdir(exist_ok=True)
        (tmp_path / each).write_text(text)
    assert found(tmp_path / name) == []
    (tmp_path / "parts" / "b.clp").write_text(PROGRAM["parts/b.clp"].replace("(name a)", "(nam a)"))
    assert found(tmp_path / name) == [("CX203", "b.clp", 1, 28)]
    (tmp_path / "parts" / "b.clp").unlink()
    assert {code for code, *_ in found(tmp_path / name)} == {"CX102"}


def test_a_program_whose_facts_have_names_of_the_core(tmp_path):
    clips = "(deffacts wanted (goal at 1 2)) (defrule r (goal at ?x ?y) => (halt))"
    file = tmp_path / "program.clp"
    file.write_text(clips)
    assert [code for code, *_ in found(file)] == ["CX212"]
    findings = check(RunOptions(scenario=agent(tmp_path, clips)))
    assert {each.code.name for each in findings} == {"CX209"}
    assert all("'goal' has slots" in each.message and "core" in each.hint for each in findings)


def test_a_skill_of_another_skill_space_does_not_count(tmp_path):
    """Two spaces have a skill of one name: the arguments are those of the agent's own."""
    for space, argument in (("mine", "words"), ("other", "text")):
        (tmp_path / "lua" / space).mkdir(parents=True)
        (tmp_path / "lua" / f"{space}.lua").write_text(f'skillenv.use_skill("skills.{space}.say")\n')
        (tmp_path / "lua" / space / "say.lua").write_text(
            f'module(..., skillenv.module_init)\nname = "say"\ndocumentation = [==[@param {argument} it]==]\n'
        )
    folder = agent(tmp_path, scenario_yaml=SPEC + "skiller: {skillspace: mine}\n")
    (finding,) = check(RunOptions(scenario=folder, skill_dirs=(tmp_path / "lua",)))
    assert (finding.code.name, finding.hint) == ("CX413", "it has: words")
    folder = agent(tmp_path, scenario_yaml=SPEC + "skiller: {skillspace: other}\n")
    assert check(RunOptions(scenario=folder, skill_dirs=(tmp_path / "lua",))) == []


@pytest.mark.parametrize(
    ("clips", "word", "near"),
    [
        ("(deffacts f (mode (is ONN)))", "ONN", "did you mean ON? it can be: OFF, ON"),
        ("(defrule r (mode (is ?x&OFF|ONN)) => (halt))", "ONN", "did you mean ON? it can be: OFF, ON"),
        ("(defrule r (thing) => (assert (mode (is middle))))", "middle", "it can be: OFF, ON"),
    ],
)
def test_a_value_that_clips_refuses(tmp_path, clips, word, near):
    template = "(deftemplate mode (slot is (allowed-values ON OFF)))"
    finding = check(RunOptions(scenario=agent(tmp_path, template + clips)))[0]
    assert finding.code.name == "CX209"
    assert finding.message.endswith(f"the slot 'is' of 'mode' cannot be {word}")
    assert finding.hint == near


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
def test_the_names_in_a_goal_of_a_planner(tmp_path, formula, message):
    objects = "(deffacts o (domain-object (name Anna)) (domain-object (name Bob)))"
    clips = f'{objects}(defrule r (thing) => (planner-plan A "{formula}"))'
    findings = check(RunOptions(scenario=agent(tmp_path, clips, people_clp=PLANNER)))
    assert [(each.code.name, message in each.message) for each in findings] == (
        [("CX309", True)] if message else []
    )


def test_an_action_without_executor_that_a_planner_may_plan(tmp_path):
    domain = DOMAIN.replace("(:action", "(:action wave :parameters (?who) :effect (met ?who)) (:action", 1)
    clips = '(defrule r (thing) => (planner-plan A "(met Anna)"))'
    folder = agent(tmp_path, clips, people_clp=PLANNER, domain_pddl=domain)
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
def test_the_types_and_fields_of_skills_of_ros(tmp_path, kind, name, field, message):
    pytest.importorskip("rosbags", reason="the extra 'ros2' is not installed")
    package = tmp_path / "ros" / "robots"
    (package / "action").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robots</name></package>")
    (package / "action" / "Drive.action").write_text(DRIVE)
    folder = agent(tmp_path, scenario_yaml=SPEC + ROS.format(kind=kind, name=name, field=field))
    findings = check(RunOptions(scenario=folder))
    assert [(each.code.name, message in each.message) for each in findings] == (
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
def test_a_template_that_never_makes_a_skill_string_is_found_in_its_line(tmp_path, template, is_wrong):
    folder = agent(tmp_path, scenario_yaml=SPEC.replace("greet: say{text=?(who)s}", f"greet: '{template}'"))
    places = [(finding[1], finding[2]) for finding in found(folder) if finding[0] == "CX405"]
    assert places == ([("scenario.yaml", 7)] if is_wrong else [])


def test_a_run_that_fails_names_the_mistakes_that_clips_does_not_notice_at_the_start(tmp_path, capsys):
    agent_text = mini.AGENT.replace("(mode DISPATCHED)", "(mod DISPATCHED)")
    assert (
        invoke(["run", str(mini.write_scenario(tmp_path, agent=agent_text)), "--timeout", "5"]) == TIMED_OUT
    )
    assert "error CX210: defrule mini-dispatch: the deftemplate 'goal'" in capsys.readouterr().err


def test_a_misspelt_action_mapping_is_reported_once(tmp_path):
    scenario = SPEC.replace("action-mapping:", "action-maping:")
    scenario = scenario.replace("- name: pddl-parser", "- name: pddl-parser\n          - name: planner")
    plan = '(defrule plan (executive-init) => (planner-plan A "(met ann)"))'
    assert [finding[0] for finding in found(agent(tmp_path, plan, scenario_yaml=scenario))] == ["CX117"]


def test_the_command_names_all_files_from_the_working_directory(tmp_path, monkeypatch, capsys):
    agent(tmp_path, ") junk", scenario_yaml=SPEC.replace("say{", "sya{"))
    monkeypatch.chdir(tmp_path)
    assert invoke(["check", "."]) == 1
    lines = [line for line in capsys.readouterr().out.splitlines() if " error CX" in line]
    assert [line.partition(":")[0] for line in lines] == ["scenario.yaml", "agent.clp"]


def test_a_folder_named_scenario_yaml_is_named(tmp_path, capsys):
    (tmp_path / "scenario.yaml").mkdir()
    assert invoke(["run", str(tmp_path)]) == BAD_INPUT
    assert f"{tmp_path / 'scenario.yaml'}: the folder has no configuration file" in capsys.readouterr().err
