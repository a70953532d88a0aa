"""The debug adapter: `cxbridge dap` on stdin and stdout; docs/debug-adapter.md.

It debugs a :class:`~cxbridge_studio.dap.target.Target`: a run (:mod:`.live`), or a recording
(:mod:`.recorded`), which goes backwards, too.
"""
