"""The debug adapter of ``cxbridge dap``; see docs/editors.md.

An editor talks to the adapter by the Debug Adapter Protocol. The adapter debugs a
:class:`~cxbridge_studio.dap.target.Target`: a run (:mod:`.live`), or a recording (:mod:`.recorded`), which
    can also be stepped backwards.
"""
