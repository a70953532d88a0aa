"""The history of a run: goals, plan-actions, skills and planner calls.

:mod:`.transitions` derives events from facts, :mod:`.builder` builds the :mod:`.model` from live or recorded
events, and :mod:`.linking` pairs plan-actions with the skills that executed them.
"""
