"""The worlds that a run can meet: its choice points, who chooses there, and a run in such a world."""
