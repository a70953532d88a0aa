"""Games of the RoboCup Logistics League: referee, machines and robots in one run, on the virtual clock."""
