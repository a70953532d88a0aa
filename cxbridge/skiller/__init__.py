"""Execution of skills: Skillers with Lua engine, speech and simulator, the skill board, and action mapping.

The Skillers serve SkillerInterfaces on the blackboard; see ``docs/skiller.md``. An action mapping makes the
skill string of an action.
"""
