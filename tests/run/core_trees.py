"""Generated agents with trees of goals, run with the built-in core and with Fawkes' core.

One random number makes an agent: trees, order and saliences of rules, actions of leaves. Some rules match
goals without their mode, so that they see each change that a core makes.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from random import Random

from cxbridge.events import GoalTransition, PlanActionTransition, RuleFired, SkillStatus
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run
from tests.run.mini import write_skill_space

SCENARIO = """
clips-executive:
  assert-time-each-loop: true
  automatic-goal-retraction: true
  steal-skiller-control: true
  exact-retry: true
  spec: trees
  specs:
    trees:
      init:
        stage-1:
          - name: pddl-parser
        stage-3:
          - name: agent
            files: [goal-tree.clp, {goals}, trees.clp, {later}]
      action-mapping:
        good: now{{text=?(text)s}}
        lit: now{{text=?(text)s}}
        stuck: now{{text=?(text)s}}
        slow: later{{text=?(text)s}}
        bad: never{{text=?(text)s}}
        unknown: nothing_like_this{{text=?(text)s}}
skiller:
  skillspace: trees
"""
SKILLS = {
    "now": "function execute() return S_FINAL end\nfunction reset() end",
    "never": 'function execute() fsm:set_error("never") return S_FAILED end\nfunction reset() end',
    "later": """local loops = 0
function execute()
    loops = loops + 1
    return loops > 12 and S_FINAL or S_RUNNING
end
function reset() loops = 0 end""",
}
SUB_TYPES = (
    "goals/automatic.clp, goals/retry.clp, goals/run-all.clp, goals/run-one.clp, "
    "goals/try-all.clp, goals/timeout.clp, goals/run-parallel.clp"
)
ALWAYS = (
    "action-selection/sequential.clp, skills-actions.clp, execmon/stalled-action.clp, "
    "execmon/stalled-sequential-plan.clp"
)

DOMAIN = """
  (progn$ (?name (create$ good bad unknown slow lit stuck))
    (assert (domain-operator (name ?name) (param-names text))))
  (assert (domain-predicate (name light) (param-names text)))
  (progn$ (?name (create$ lit stuck))
    (assert (pddl-formula (id (sym-cat ?name 1)) (part-of ?name) (type conjunction))
            (pddl-formula (id (sym-cat ?name 11)) (part-of (sym-cat ?name 1)) (type atom))
            (pddl-predicate (id (sym-cat ?name 11-atom)) (part-of (sym-cat ?name 11)) (predicate light)
                            (param-names text))))
  (assert (domain-effect (name lights) (part-of good) (predicate light) (type POSITIVE) (param-names text))
          (domain-effect (name dark) (part-of lit) (predicate light) (type NEGATIVE) (param-names text)))
"""

BEGIN = """
(deffunction plan-one (?id ?number ?action)
  (if (eq ?action lit) then
    (assert (domain-fact (name light) (param-values (str-cat ?id "-" ?number)))))
  (assert (plan-action (id ?number) (plan-id P) (goal-id ?id) (action-name ?action) (param-names text)
                       (param-values (str-cat ?id "-" ?number)))))
(defrule begin (executive-initialized) (not (begun)) =>
  (assert (begun) (skiller-control (skiller "Skiller")))
  {domain}
  {trees})
"""

RULES = (
    """(defrule select {salience} ?g <- (goal (mode FORMULATED) (parent nil) (type ACHIEVE))
      (skiller-control (acquired TRUE)) => (modify ?g (mode SELECTED)))""",
    """(defrule reject {salience} ?g <- (goal (class NO) (mode SELECTED)) =>
      (modify ?g (mode FINISHED) (outcome REJECTED)))""",
    """(defrule reject-late {salience} ?g <- (goal (class LATE) (mode EXPANDED)) =>
      (modify ?g (mode FINISHED) (outcome REJECTED) (error TOO-LATE) (message "too late")))""",
    """(defrule give-up {salience} ?g <- (goal (class GIVE-UP) (mode SELECTED)) =>
      (modify ?g (mode FINISHED) (outcome FAILED) (error GIVEN-UP 7) (message "given up")))""",
    """(defrule plan {salience} ?g <- (goal (id ?id) (class ?class&~TREE&~AUTOMATIC-SUBGOAL&~NO&~GIVE-UP)
                                        (mode SELECTED) (sub-type nil) (type ACHIEVE))
      =>
      (assert (plan (id P) (goal-id ?id) (type SEQUENTIAL)))
      (switch ?class
        (case TWO then (plan-one ?id 7 good) (plan-one ?id 3 good))
        (case BAD then (plan-one ?id 1 bad) (plan-one ?id 2 good))
        (case UNKNOWN then (plan-one ?id 1 unknown))
        (case SLOW then (plan-one ?id 1 slow))
        (case LIT then (plan-one ?id 1 lit))
        (case STUCK then (plan-one ?id 1 good) (plan-one ?id 2 stuck))
        (case NOTHING then (bind ?nothing TRUE))
        (default (plan-one ?id 1 good)))
      (modify ?g (mode EXPANDED)))""",
    """(defrule commit {salience} ?g <- (goal (class ~LATE) (sub-type nil) (type ACHIEVE) (mode EXPANDED)) =>
      (modify ?g (mode COMMITTED) (committed-to P)))""",
    """(defrule acquire {salience} ?g <- (goal (mode COMMITTED) (acquired-resources)
                                         (required-resources $?need&:(> (length$ ?need) 0)))
      =>
      (modify ?g (acquired-resources ?need)))""",
    """(defrule dispatch {salience} ?g <- (goal (sub-type nil) (type ACHIEVE) (mode COMMITTED)
                                         (required-resources $?need)
                                         (acquired-resources $?have&:(subsetp ?need ?have)))
      =>
      (modify ?g (mode DISPATCHED)))""",
    """(defrule release {salience} ?g <- (goal (mode RETRACTED) (acquired-resources ? $?)) (time $?) =>
      (modify ?g (acquired-resources)))""",
    """(defrule expand {salience} ?g <- (goal (class TREE) (mode SELECTED)
                                       (sub-type ~nil&~RETRY-SUBGOAL&~TIMEOUT-SUBGOAL))
      =>
      (modify ?g (mode EXPANDED)))""",
    """(defrule evaluate {salience} ?g <- (goal (class ~AUTOMATIC-SUBGOAL) (mode FINISHED)) =>
      (modify ?g (mode EVALUATED)))""",
    """(defrule retract {salience} ?g <- (goal (id ?id) (parent ?parent) (mode EVALUATED))
      (or (test (eq ?parent nil)) (goal (id ?parent) (type MAINTAIN)))
      =>
      (modify ?g (mode RETRACTED)))""",
    """(defrule select-below {salience} ?g <- (goal (mode FORMULATED) (parent ?parent))
      (goal (id ?parent) (type MAINTAIN) (mode DISPATCHED)) => (modify ?g (mode SELECTED)))""",
    """(defrule keep-up {salience} ?g <- (goal (type MAINTAIN) (parent nil) (mode FORMULATED)) =>
      (modify ?g (mode DISPATCHED)))""",
    """(defrule keep-up-no-longer {salience} ?g <- (goal (id ?id) (type MAINTAIN) (mode DISPATCHED))
      (not (goal (parent ?id))) => (modify ?g (mode FINISHED) (outcome COMPLETED)))""",
)
"""The rules that move goals, but for the core; ``{salience}`` is filled in."""

SPIES = (
    "(defrule spy-goal {first} (goal (id ?id) (class ?class)) => (assert (seen ?id)))",
    "(defrule spy-root {first} (goal (id ?id) (parent nil)) => (assert (seen ?id)))",
    "(defrule spy-family {first} (goal (id ?id) (parent ?p)) (goal (id ?p)) => (assert (seen ?id)))",
    "(defrule spy-outcome {first} (goal (id ?id) (outcome ?outcome&~UNKNOWN)) => (assert (seen ?id)))",
    """(defrule spy-oldest {first} (goal (mode FINISHED))
      => (do-for-fact ((?g goal)) (eq ?g:sub-type nil) (assert (oldest ?g:id ?g:mode))))""",
)
"""Rules that print the goals in the order of their changes. They fire before all other rules."""

FORGET = """
(defrule spy-seen (declare (salience 19999)) ?seen <- (seen ?) => (retract ?seen))
(defrule spy-oldest-is (declare (salience 19999)) (oldest ?id ?mode)
  => (printout t "oldest " ?id " " ?mode crlf))
(defrule spy-oldest-forget (declare (salience 19998)) ?oldest <- (oldest $?) => (retract ?oldest))
"""

LEAVES = ("GOOD", "TWO", "BAD", "UNKNOWN", "NO", "LATE", "GIVE-UP", "SLOW", "LIT", "STUCK", "NOTHING")
WEIGHTS = (6, 2, 2, 1, 2, 1, 1, 1, 2, 1, 1)
MANY = ("run-all", "run-one", "try-all")
PARALLEL = tuple(f"run-parallel{late}" for late in ("", "-delayed"))
ON = ("NONE", "FAILED", "REJECTED")
ONE = ("retry {of} 2", "retry {of} 3", "timeout {of} 1000", "timeout {of} 2", "timeout {of} 0.2")


@dataclass
class Grower:
    """Makes trees; the leaves are called L0, L1 ... in the order of the expression."""

    random: Random
    leaves: int = 0

    def leaf(self) -> str:
        """Return an expression that asserts a leaf."""
        random = self.random
        kind = random.choices(LEAVES, WEIGHTS)[0]
        more = " (required-resources A B)" if random.random() < 0.1 else ""
        more += " (type MAINTAIN)" if random.random() < 0.03 else ""
        self.leaves += 1
        return f"(assert (goal (id L{self.leaves - 1}) (class {kind}){more}))"

    def tree(self, left: int, *, top: bool = True) -> str:
        """Return an expression that asserts a tree of at most this many levels below its root."""
        random = self.random
        if left == 0 or (not top and random.random() < 0.35):
            return self.leaf()
        name = random.choice(("TREE", "TREE", "AUTOMATIC-SUBGOAL"))
        if random.random() < 0.25:
            call = random.choice(ONE).format(of=name)
            return f"(goal-tree-assert-{call} {self.tree(left - 1, top=False)})"
        kind = random.choice(MANY + PARALLEL)
        on = f" {random.choice(ON)}" if kind in PARALLEL else ""
        below = " ".join(self.tree(left - 1, top=False) for _ in range(random.randint(1, 3)))
        return f"(goal-tree-assert-{kind} {name}{on} {below})"


def make_agent(seed: int) -> str:
    """Return the rules of an agent."""
    random = Random(seed)
    grower = Grower(random)
    depth = random.choice((2, 3, 3, 4))
    trees = [grower.tree(depth) for _ in range(random.choice((1, 1, 1, 2)))]
    if random.random() < 0.15:
        trees[0] = f"(assert (goal (id M) (class KEEP) (type MAINTAIN))) (modify {trees[0]} (parent M))"
    for leaf in range(grower.leaves):
        if random.random() < 0.1:
            priority = random.choice(("2.5", "-1.0", "7", "1.0"))
            trees.append(f"(do-for-fact ((?g goal)) (eq ?g:id L{leaf}) (modify ?g (priority {priority})))")
    mixed = list(RULES)
    if random.random() < 0.5:
        random.shuffle(mixed)
    rules = [rule.format(salience=_salience(random)) for rule in mixed]
    spies = [spy.format(first="(declare (salience 20000))") for spy in SPIES if random.random() < 0.3]
    spies.append(FORGET)
    begin = BEGIN.format(domain=DOMAIN, trees="\n  ".join(trees))
    before = random.random() < 0.5
    return "\n".join([begin, *(spies if before else []), *rules, *([] if before else spies), ""])


def _salience(random: Random) -> str:
    if random.random() < 0.9:
        return ""
    return f"(declare (salience {random.choice((-1, 1, 500))}))"


def write_agent(folder: Path, agent: str, goals: str = SUB_TYPES) -> Path:
    """Write a scenario with the agent into the folder; return the folder."""
    folder.mkdir(parents=True)
    (folder / "scenario.yaml").write_text(SCENARIO.format(goals=goals, later=ALWAYS))
    (folder / "trees.clp").write_text(agent)
    return folder


def run_both(folder: Path, agent: str, fawkes_dir: Path, *, timeout: float = 30) -> tuple[Way, Way]:
    """Run the agent with Fawkes' core and with the built-in core; return both ways."""
    skills = write_skill_space(folder, "trees", **SKILLS)
    ways = []
    for core, checkout in (("fawkes", fawkes_dir), ("builtin", None)):
        trace = folder / f"{core}.mcap"
        result = run_scenario(
            RunOptions(
                scenario=write_agent(folder / core, agent),
                fawkes_dir=checkout,
                skill_dirs=(skills,),
                trace=trace,
                trace_level="rules",
                trace_files=False,
                timeout=timeout,
                strict=False,  # some trees test actions without a skill
            )
        )
        ways.append(read_way(result.status, trace, agent))
    return ways[0], ways[1]


@dataclass(frozen=True)
class Way:
    """How a run went: its exit status, its transitions in their order, the firings of the agent's rules."""

    status: int
    steps: list[str]
    firings: Counter[str]


def read_way(status: int, trace: Path, agent: str) -> Way:
    """Return the way of a run from its recording."""
    own = set(re.findall(r"\(defrule (\S+)", agent))
    events = list(open_run(trace))
    fired = Counter(event.rule for event in events if isinstance(event, RuleFired) and event.rule in own)
    return Way(status, [step for event in events if (step := _step(event))], fired)


def _step(event: object) -> str:
    match event:
        case GoalTransition():
            return f"goal {event.goal} {event.mode} {event.outcome} {event.error}"
        case PlanActionTransition():
            return f"action {event.goal} {event.action_id} {event.state}"
        case SkillStatus():
            return f"skill {event.skill_string} {event.status}"
    return ""


def first_difference(theirs: Way, ours: Way, before: int = 12) -> str:
    """Return the first difference of two ways as text; empty for equal ways."""
    if theirs == ours:
        return ""
    if theirs.steps == ours.steps:
        more, less = theirs.firings - ours.firings, ours.firings - theirs.firings
        return f"Fawkes: {theirs.status} {more}, ours: {ours.status} {less}"
    pairs = zip(theirs.steps, ours.steps, strict=False)
    at = next((at for at, (a, b) in enumerate(pairs) if a != b), min(len(theirs.steps), len(ours.steps)))
    common, *after = (
        "\n".join(f"    {step}" for step in steps)
        for steps in (
            theirs.steps[max(0, at - before) : at],
            theirs.steps[at : at + 4],
            ours.steps[at : at + 4],
        )
    )
    return f"step {at}, after\n{common}\nFawkes:\n{after[0]}\nours:\n{after[1]}"
