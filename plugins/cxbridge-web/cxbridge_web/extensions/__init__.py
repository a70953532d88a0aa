"""The endpoints of cxbridge that are not operations: status, rules, interfaces, commands.

A handler reads the executive and the blackboard in the main loop. Reading files and making the models of long
lists follows in the server's thread, in ``finish``.
"""
