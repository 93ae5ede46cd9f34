"""The ROS 2 nodes: messages to calls of the core, errors of the core to answers. No mathematics."""
