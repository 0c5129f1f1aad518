"""A ROS 2 node that has fervor tell how intensely each tracked person shows an emotion.

`Perception` is the core: it knows no ROS, no clock and no socket. `Uplink` is its line to the service; `main`, `node`
and `subscriptions` alone import rclpy.
"""
