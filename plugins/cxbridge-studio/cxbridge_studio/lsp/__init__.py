"""The language server: what editors ask about the files of an agent (Language Server Protocol).

:mod:`.session` has the agent's model, the knowledge of CLIPS and the results of checks; each request has its
module: :mod:`.diagnostics`, :mod:`.describe` (hover), :mod:`.completion`, :mod:`.navigation`,
:mod:`.symbols`. :mod:`.server` speaks the protocol, with pygls. See ``docs/editors.md``.
"""
