"""A plan as a page: a timeline, the state after each step, why each step is there."""
