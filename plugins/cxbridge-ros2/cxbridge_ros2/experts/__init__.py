"""The experts of PlanSys2, and its planner: servers and clients of their services."""
