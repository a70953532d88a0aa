"""A model of an agent, made from the text of its files. Broken files are read as far as possible.

:class:`.model.AgentModel` has the files and finds names in them. :mod:`.names` has the types of its results.
Each file format has a reader: :mod:`.clips`, :mod:`.pddl`, :mod:`.yaml`, :mod:`.lua`, :mod:`.interface_xml`.
"""
