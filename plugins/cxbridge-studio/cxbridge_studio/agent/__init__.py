"""A model of an agent, made from the text of its files; broken files are read, too.

:class:`.model.AgentModel` takes files and finds names. :mod:`.names` has the types of its results. Each file
format has a reader: :mod:`.clips`, :mod:`.pddl`, :mod:`.yaml`, :mod:`.lua`, :mod:`.interface_xml`,
:mod:`.protobuf`.
"""
