"""The history of a run: its goals, plan-actions, skills and planner calls, made of events, live or recorded.

:mod:`.transitions` makes events of facts, :mod:`.builder` makes the :mod:`.model` of events, and
:mod:`.linking` pairs plan-actions with the skills that executed them. :mod:`.state` has what holds at
one moment.
"""
