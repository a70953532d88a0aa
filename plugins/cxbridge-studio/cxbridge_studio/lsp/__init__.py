"""The language server: what editors ask about the files of an agent (Language Server Protocol).

:mod:`.session` has the agent's model, what CLIPS knows and what a check has found; each question has its
module: :mod:`.diagnostics`, :mod:`.describe` (hover), :mod:`.completion`, :mod:`.navigation`,
:mod:`.symbols`. :mod:`.server` speaks the protocol, with pygls. See ``docs/editors.md``.
"""
