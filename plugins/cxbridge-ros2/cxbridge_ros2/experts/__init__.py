"""Servers and clients for the experts and the planner of PlanSys2."""
