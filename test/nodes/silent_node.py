"""A node that lives and never answers, also as a process: says when it is asked."""

import contextlib

import rclpy
from rclpy.executors import ExternalShutdownException
from std_srvs.srv import Trigger

from walk_optimizer.nodes.suite_node import SuiteNode

FOREVER = 3600.0


class Silent(SuiteNode):
    """The node."""

    def __init__(self, announced=True):
        super().__init__("silent", [])
        self.asked = 0
        self.serve(Trigger, "~/ask", self._keep_silent)
        if announced:
            self.announce()

    async def _keep_silent(self, _request, _response):
        self.asked += 1
        print("asked", flush=True)
        await self.sleep(FOREVER)


if __name__ == "__main__":
    rclpy.init()
    with contextlib.suppress(ExternalShutdownException):
        rclpy.spin(Silent())
