"""The language server for the files of an agent (Language Server Protocol).

:mod:`.session` has the agent's model, the data from CLIPS and the findings. Requests have separate modules:
:mod:`.diagnostics`, :mod:`.describe` (hover), :mod:`.completion`, :mod:`.navigation`, :mod:`.symbols`.
:mod:`.server` implements the protocol with pygls. See docs/editors.md.
"""
