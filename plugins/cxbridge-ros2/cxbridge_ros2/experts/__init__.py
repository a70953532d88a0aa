"""Servers and clients for the experts and the planner of PlanSys2.

PlanSys2's experts are nodes with services: the domain expert has a PDDL domain, the problem expert a PDDL
problem, which clients change.
"""
