"""The endpoints of cxbridge that are not operations: status, rules, interfaces, commands.

A handler reads the executive and the blackboard in the main loop, or waits in a thread. Reading files and
making the models of long lists follows in ``finish``, in a further thread.
"""
