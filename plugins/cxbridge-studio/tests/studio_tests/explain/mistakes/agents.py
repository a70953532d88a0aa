"""Agents with a mistake: a shipped scenario, an edit, and the question of the author."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from tests.support import ROOT

_TALK = "test-scenario"
_LEAF = "(assert (goal (class ?class) (id ?id)))"


@dataclass(frozen=True)
class Mistake:
    """An agent with a mistake.

    :param file: the file of the scenario in which ``old`` becomes ``new``.
    :param question: the rule or the goal of the question.
    :param cause: the words that the first line of the answer must have.
    """

    name: str
    file: str
    old: str
    new: str
    question: str
    cause: tuple[str, ...]
    scenario: str = _TALK
    at: float = 15.0

    def write(self, folder: Path) -> Path:
        """Write the agent below a folder; return the folder of the agent."""
        agent = folder / self.scenario
        shutil.copytree(ROOT / "scenarios" / self.scenario, agent)
        file = agent / self.file
        text = file.read_text()
        assert text.count(self.old) == 1, f"{self.file} has changed: {self.old}"
        file.write_text(text.replace(self.old, self.new))
        return agent


MISTAKES = (
    Mistake(
        "a function in the actions of a rule is misspelt: the rule is refused",
        "talk-plans.clp",
        "(talk-step ?goal 1 say-hello",
        "(talk-stp ?goal 1 say-hello",
        "TALK",
        ("talk-plan-for-talk", "talk-plans.clp:", "refused", "talk-stp"),
    ),
    Mistake(
        "a slot in the condition of a rule is misspelt: the rule is refused",
        "talk-leaves.clp",
        "(id ?id) (mode EXPANDED) (class TALK|PRINT)",
        "(id ?id) (mod EXPANDED) (class TALK|PRINT)",
        "rule talk-planned-commit",
        ("talk-planned-commit", "refused", "talk-leaves.clp:", "'mod'"),
    ),
    Mistake(
        "the mapping of an action is missing",
        "scenario.yaml",
        '        say-hello: say{text="Hello ?(name)y", wait=true}\n',
        "",
        "TALK",
        ("say-hello", "action-mapping"),
    ),
    Mistake(
        "a mapping names a skill that does not exist",
        "scenario.yaml",
        "say-hello: say{",
        "say-hello: sya{",
        "TALK",
        ("say-hello", "no skill 'sya'"),
    ),
    Mistake(
        "a mapping names an argument that the skill does not take",
        "scenario.yaml",
        'say-hello: say{text="Hello',
        'say-hello: say{txt="Hello',
        "TALK",
        ("say-hello", 'say{txt="Hello peggy"', "text"),
    ),
    Mistake(
        "a plan has an action that the domain has not",
        "talk-plans.clp",
        "(talk-step ?goal 1 say-hello ",
        "(talk-step ?goal 1 say-helo ",
        "TALK",
        ("say-helo", "operator", "did you mean say-hello"),
    ),
    Mistake(
        "the actions of a plan are in the wrong order",
        "talk-plans.clp",
        "(talk-step ?goal 1 say-hello ",
        "(talk-step ?goal 1 say-goodbye ",
        "TALK",
        ("say-goodbye", "(said peggy hello)", "false"),
    ),
    Mistake(
        "an argument of an action is misspelt",
        "talk-plans.clp",
        "(talk-step ?goal 3 say-goodbye (create$) (create$ peggy))",
        "(talk-step ?goal 3 say-goodbye (create$) (create$ pegy))",
        "TALK",
        ("say-goodbye", "(said pegy hello)", "false", "(said peggy hello)"),
    ),
    Mistake(
        "an action has a parameter too many",
        "talk-plans.clp",
        "(talk-step ?goal 1 say-hello (create$ name) (create$ peggy))",
        "(talk-step ?goal 1 say-hello (create$ name how) (create$ peggy loud))",
        "TALK",
        ("say-hello", "how"),
    ),
    Mistake(
        "no action selection is loaded",
        "scenario.yaml",
        "          - name: selection\n"
        "            files: [action-selection/sequential.clp, action-selection/temporal.clp]\n",
        "",
        "TALK",
        ("no action selection", "action-selection/sequential.clp"),
    ),
    Mistake(
        "a file of the agent is not loaded",
        "scenario.yaml",
        "          - name: plans\n            file: talk-plans.clp\n",
        "",
        "TALK",
        ("talk-plans.clp", "does not load"),
    ),
    Mistake(
        "the rule of the question is in a file that is not loaded",
        "scenario.yaml",
        ", talk-world.clp]",
        "]",
        "rule talk-world-location",
        ("talk-world-location", "talk-world.clp", "does not load"),
        at=1.0,
    ),
    Mistake(
        "the class of a goal is misspelt in a rule",
        "talk-leaves.clp",
        "(mode SELECTED) (class TALK|PRINT)",
        "(mode SELECTED) (class TLAK|PRINT)",
        "TALK",
        ("talk-planned-expand", "TLAK"),
    ),
    Mistake(
        "no rule locks the resources of goals",
        "talk-goals.clp",
        _LEAF,
        "(assert (goal (class ?class) (id ?id) (required-resources arm)))",
        "TALK",
        ("resource arm", "resource-locks.clp"),
    ),
    Mistake(
        "a second goal holds the resource for ever",
        "talk-goals.clp",
        _LEAF,
        "(assert (goal (id HOLDER) (class HOLD) (mode DISPATCHED) (acquired-resources arm)))"
        "(assert (goal (class ?class) (id ?id) (required-resources arm)))",
        "TALK",
        ("resource arm", "held by goal HOLDER"),
    ),
    Mistake(
        "no rule sees the effect of an action",
        "talk-domain.clp",
        "(action-name ?action&say-hello|",
        "(action-name ?action&say-helo|",
        "TALK",
        ("say-hello", "(said peggy hello)", "sensed"),
    ),
    Mistake(
        "the file that executes actions with skills is not loaded",
        "scenario.yaml",
        "files: [skills-actions.clp, talk-print.clp]",
        "files: [talk-print.clp]",
        "TALK",
        ("say-hello", "skills-actions.clp"),
    ),
    Mistake(
        "the rule that executes an action has its name wrong",
        "talk-print.clp",
        "(plan-action (action-name print) (state PENDING)",
        "(plan-action (action-name pritn) (state PENDING)",
        "TALK",
        ("print", "talk-print-start", "pritn"),
    ),
    Mistake(
        "the goal of a planner has an object that does not exist",
        "meet-goals.clp",
        '"(said PEGGY GOODBYE)"',
        '"(said PEGY GOODBYE)"',
        "SAY-GOODBYE",
        ("planner", "PEGY"),
        scenario="test-scenario-pddl",
    ),
    Mistake(
        "the goal of a planner cannot be reached",
        "domain.pddl",
        ":precondition (not (said ?name HELLO))",
        ":precondition (said ?name GOODBYE)",
        "SAY-GOODBYE",
        ("planner", "no plan", "(said PEGGY GOODBYE)"),
        scenario="test-scenario-pddl",
    ),
    Mistake(
        "a fact is misspelt, so that no goal is ever formulated",
        "talk-domain.clp",
        "(assert (domain-facts-loaded))",
        "(assert (domain-fact-loaded))",
        "TESTGOAL-PARENT",
        ("TESTGOAL-PARENT", "talk-begin", "domain-facts-loaded"),
    ),
    Mistake(
        "no rule makes the fact that a rule waits for",
        "talk-domain.clp",
        "(assert (domain-facts-loaded))",
        "(assert (domain-fact-loaded))",
        "rule talk-begin",
        ("talk-begin", "no fact of 'domain-facts-loaded'"),
    ),
)
"""The agents."""
