"""The Skiller: exclusive control, skill strings, the Lua engine, speech, a simulator, and the action mapping.

Everything here meets the rest of a run only on the blackboard; see ``docs/skiller.md``.
"""
