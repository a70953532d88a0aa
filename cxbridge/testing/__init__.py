"""Tests of agents: a run that a test drives, skills that end as it says, golden runs. See docs/testing.md."""

from cxbridge.testing.agent_run import AgentRun
from cxbridge.testing.goals import Action, Goal
from cxbridge.testing.skills import Call, SkillRule

__all__ = ["Action", "AgentRun", "Call", "Goal", "SkillRule"]
