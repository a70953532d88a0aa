"""The experts of PlanSys2, and its planner: who answers their services, and who asks them."""
