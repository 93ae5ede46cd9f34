"""A publisher of references, of the test itself: it says what is walked, and when."""

import functools

from builtin_interfaces.msg import Time
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walk_optimizer_interfaces.msg import Gait as GaitMessage

from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.conversions import gait_to_message
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.references import JOINTS, cycle_reference
from walk_optimizer.references.profile import profile_of

NODE = "walker_visualizer"


@functools.cache
def packaged_gait(speed=0.32):
    gait, _ = GaitLibrary(WalkerParameters()).find(speed, "stiffness_and_equilibrium", "nearest")
    return gait


def stamp_of(nanoseconds):
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def nanoseconds_of(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


class Walk:
    """A publisher of references, of this test: it says what it walks, and when."""

    def __init__(self, graph, namespace="", gait=None):
        prefix = f"/{namespace}/" if namespace else ""
        self.gait = gait or packaged_gait()
        self.graph, self.profile = graph, profile_of(self.gait)
        self.references = {}
        self.gaits = graph.publisher(GaitMessage, f"{prefix}reference_publisher/gait", LATCHED)
        self.joints = graph.publisher(JointState, f"{prefix}reference_publisher/joint_reference", STREAM)
        self.transforms = graph.subscribe(TFMessage, f"{prefix}tf")
        self.markers = graph.subscribe(MarkerArray, f"{prefix}{NODE}/markers")
        graph.spin_for(0.5)

    def announce(self):
        self.gaits.publish(gait_to_message(self.gait))
        self.graph.spin_for(0.5)

    def publish(self, time, order=(0, 1, 2, 3), fields=("position", "velocity", "effort")):
        """Publish the reference of a time in [s]."""
        cycles, rest = divmod(time, 2 * self.profile.step_time)
        reference = cycle_reference(self.profile, rest)
        stamp = round(time * 1e9) + 10**12
        message = JointState(name=[JOINTS[place] for place in order])
        for field in fields:
            setattr(message, field, [float(getattr(reference, field)[place]) for place in order])
        message.header.stamp = stamp_of(stamp)
        self.references[stamp] = reference, reference.base[0] + 2 * cycles * self.profile.step_length
        self.joints.publish(message)
        return reference

    def send(self, time, **form):
        """Publish the reference of a time in [s], and wait for the picture."""
        before = len(self.markers)
        reference = self.publish(time, **form)
        self.graph.spin_until(
            lambda: len(self.markers) > before and len(self.transforms) >= len(self.markers), "a picture"
        )
        return reference

    def picture(self):
        """Transforms by child, and markers by namespace and number, of the last picture."""
        transforms = {one.child_frame_id: one for one in self.transforms[-1].transforms}
        return transforms, {(one.ns, one.id): one for one in self.markers[-1].markers}
