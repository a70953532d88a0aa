"""The language server for the files of an agent (Language Server Protocol).

The server answers an editor's questions about the names in these files. :mod:`.session` stores the model of
the agent (its names with their positions), and the last examination of the agent by CLIPS. Each kind of
request has a module: :mod:`.diagnostics`, :mod:`.describe` (hover texts), :mod:`.completion`,
:mod:`.navigation`, :mod:`.symbols`. :mod:`.server` and :mod:`.handlers` implement the protocol with pygls.
See docs/editors.md.
"""
