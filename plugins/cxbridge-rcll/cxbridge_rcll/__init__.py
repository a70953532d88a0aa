"""Games of the RoboCup Logistics League: referee, machines and robots in a run, usually on the virtual clock.

In the league, robots carry workpieces between machines to make the products that are ordered. The referee box
(rcll-refbox) controls the machines and awards points. Its CLIPS rules run here in a separate environment.
"""
