"""The debug adapter of ``cxbridge dap``; see docs/editors.md.

An editor talks to the adapter by the Debug Adapter Protocol. The adapter debugs a run (:mod:`.debugged_run`).
"""
