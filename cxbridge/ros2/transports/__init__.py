"""The ways to the nodes of ROS 2: one file a transport; ``executor.TRANSPORTS`` names them."""
