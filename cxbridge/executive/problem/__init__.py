"""Planning problems in an environment: facts, numbers and conditions, and the truth of conditions."""
