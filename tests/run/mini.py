"""A minimal scenario: one goal, one action, one skill."""

from __future__ import annotations

from pathlib import Path

SCENARIO = """
clips-executive:
  assert-time-each-loop: true
  automatic-goal-retraction: true
  steal-skiller-control: true
  spec: mini
  specs:
    mini:
      init:
        stage-1:
          - name: {feature}
        stage-3:
          - name: agent
            files: [mini.clp, action-selection/sequential.clp, skills-actions.clp, execmon/stalled-action.clp]
      action-mapping:
        {mapping}
skiller:
  skillspace: {space}
"""

AGENT = """
(defrule mini-begin
  (executive-initialized)
  (not (goal))
  (not (begun))
  =>
  (assert (begun) (skiller-control (skiller "Skiller")) (domain-operator (name act) (param-names text)))
  (assert (goal (id G) (class MINI)))
)
(defrule mini-select
  ?g <- (goal (id G) (mode FORMULATED))
  (skiller-control (acquired TRUE))
  => (modify ?g (mode SELECTED)))
(defrule mini-expand
  ?g <- (goal (id G) (mode SELECTED))
  =>
  (assert (plan (id P) (goal-id G) (type SEQUENTIAL)))
  (assert (plan-action (id 1) (plan-id P) (goal-id G) (action-name act)
                       (param-names text) (param-values "hello")))
  (modify ?g (mode EXPANDED)))
(defrule mini-commit ?g <- (goal (id G) (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule mini-dispatch ?g <- (goal (id G) (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule mini-evaluate ?g <- (goal (id G) (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule mini-retract ?g <- (goal (id G) (mode EVALUATED)) => (modify ?g (mode RETRACTED)))
"""


def write_scenario(
    folder: Path,
    *,
    mapping: str = "act: say{text=?(text)s, wait=true}",
    agent: str = AGENT,
    feature: str = "pddl-parser",
    space: str = "test",
    more: str = "",
) -> Path:
    """Write the scenario, with more lines of configuration, into a folder; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    text = SCENARIO.format(mapping=mapping, feature=feature, space=space)
    (folder / "scenario.yaml").write_text(text + more)
    (folder / "mini.clp").write_text(agent)
    return folder


SKILL = """module(..., skillenv.module_init)

name = "{name}"
documentation = [==[A skill of a test.]==]
skillenv.skill_module(_M)

{body}
"""

SPACE = """require("fawkes.modinit")
module(..., fawkes.modinit.register_all)
{uses}
"""


def write_skill_space(folder: Path, space: str, **skills: str) -> Path:
    """Write a skill space whose skills are given by their Lua bodies; return the folder of it.

    A body is what stands behind ``skillenv.skill_module(_M)``, e.g. ``function execute() ... end``.
    """
    here = folder / "skills" / space
    here.mkdir(parents=True)
    for name, body in skills.items():
        (here / f"{name}.lua").write_text(SKILL.format(name=name, body=body))
    uses = "\n".join(f'skillenv.use_skill("skills.{space}.{name}")' for name in skills)
    (folder / "skills" / f"{space}.lua").write_text(SPACE.format(uses=uses))
    return folder
