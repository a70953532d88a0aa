"""Tests of agents: controlled runs, scripted skills, golden runs. See docs/testing.md."""

from cxbridge.history.model import GoalRecord as Goal
from cxbridge.history.model import PlanActionRecord as Action
from cxbridge.testing.agent_run import AgentRun
from cxbridge.testing.skills import Call, SkillRule

__all__ = ["Action", "AgentRun", "Call", "Goal", "SkillRule"]
