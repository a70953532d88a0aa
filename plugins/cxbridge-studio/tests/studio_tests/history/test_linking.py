"""`why` and the history of a run have the same skill for an action."""

from __future__ import annotations

from cxbridge_studio.explain.goal_story import GoalStoryWriter
from cxbridge_studio.explain.recorded import RecordedEvidence
from tests.history import test_board_linking as board
from tests.history.runs import ENV, ListRun, goal


def test_why_names_failed_skill_of_action():
    run = board.run_of_robots((0, 1, 2), (3.0, 5.0, 8.0))
    evidence = RecordedEvidence(
        ListRun([*run.events, goal(9, "g0", "FINISHED", "FAILED", "ACTION-FAILED")]), None, ENV
    )
    writer = GoalStoryWriter(evidence)
    story = writer.write_goal_story(writer.goals.find_goals("g0")[0])
    texts = [cause.text for cause in story.cause.because[0].because]
    assert texts == ["probably skill move to=place0 of robot1 of robot1-arm ended S_FAILED: door closed"]
