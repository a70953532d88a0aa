-- The statuses of skills, as SkillerInterface numbers them.

return {S_INACTIVE = 0, S_FINAL = 1, S_RUNNING = 2, S_FAILED = 3}
