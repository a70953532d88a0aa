"""The debug adapter of ``cxbridge dap``; see docs/editors.md.

It debugs a :class:`~cxbridge_studio.dap.target.Target`: a run (:mod:`.live`) or a recording
(:mod:`.recorded`), which can also be stepped backwards.
"""
