"""One model of an agent, made from text alone, one file at a time, for broken files, too.

:class:`.model.AgentModel` is the front: files in, questions about names out. :mod:`.names` has the types
of its answers, and there is one reader for each sort of file:
:mod:`.clips`, :mod:`.pddl`, :mod:`.yaml`, :mod:`.lua`, :mod:`.interface_xml`, :mod:`.protobuf`.
"""
