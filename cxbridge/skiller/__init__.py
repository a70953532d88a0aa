"""The Skiller: exclusive control, skill strings, Lua engine, speech, simulator, and action mapping.

All parts communicate with the rest of a run only over the blackboard; see ``docs/skiller.md``.
"""
