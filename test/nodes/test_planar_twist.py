"""What a walker that neither turns nor sidesteps makes of velocities."""

import math

import pytest

pytest.importorskip("rclpy")

from geometry_msgs.msg import Twist, Vector3

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.nodes.planar_twist import IgnoredParts, forward_speed


def test_its_speed_is_that_along_x_whatever_the_rest_is():
    assert forward_speed(Twist(linear=Vector3(x=0.4, y=1.0), angular=Vector3(z=2.0))) == 0.4


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("vector", ["linear", "angular"])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_part_that_is_not_finite_makes_all_of_it_refused(vector, axis, value):
    message = Twist(linear=Vector3(x=0.4))
    setattr(getattr(message, vector), axis, value)
    with pytest.raises(InvalidRequestError, match=f"{vector}.{axis}={value}, allowed are finite numbers"):
        forward_speed(message)


def test_what_is_ignored_is_told_once_for_each_change_and_not_too_often():
    ignored = IgnoredParts()
    ahead, sideways = Twist(linear=Vector3(x=0.4)), Twist(linear=Vector3(x=0.4, y=0.1))
    turning = [Twist(linear=Vector3(x=0.4), angular=Vector3(z=value)) for value in (0.5, 0.6)]
    assert ignored.warning(ahead, 0.0) is None
    assert "angular.z=0.5 ignored: the walker is planar" in ignored.warning(turning[0], 0.0)
    assert ignored.warning(turning[1], 5.0) is None
    assert "linear.y=0.1 ignored" in ignored.warning(sideways, 6.0)
    assert ignored.warning(ahead, 6.1) is None
    assert ignored.warning(turning[0], 6.2) is None
    assert "angular.z=0.6 ignored" in ignored.warning(turning[1], 7.1)
