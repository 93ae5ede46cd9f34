"""The walker of a URDF as an independent rigid-body library reads it, in the optimiser's coordinates."""

import numpy as np
import pinocchio as pin

from walk_optimizer.references import JOINTS


class DescribedWalker:
    """A URDF on a base that moves along ROS's x and z and does not turn."""

    def __init__(self, urdf: str):
        base = pin.JointModelComposite()
        base.addJoint(pin.JointModelPX())
        base.addJoint(pin.JointModelPZ())
        self.model = pin.buildModelFromXML(urdf, base)
        self.data = self.model.createData()
        # Where Pinocchio keeps x, z and the joints, in the order of JOINTS.
        places = [self.model.joints[self.model.getJointId(name)].idx_q for name in JOINTS]
        self._places = [0, 1, *places]

    def configuration(self, q):
        configuration = np.zeros(self.model.nq)
        configuration[self._places] = q
        return configuration

    def frame(self, name, q):
        """Position of a frame as ROS's x, y, z."""
        pin.framesForwardKinematics(self.model, self.data, self.configuration(q))
        return self.data.oMf[self.model.getFrameId(name)].translation.copy()

    def placement(self, name, q):
        pin.framesForwardKinematics(self.model, self.data, self.configuration(q))
        return self.data.oMf[self.model.getFrameId(name)].homogeneous

    def mass_matrix(self, q):
        upper = np.triu(pin.crba(self.model, self.data, self.configuration(q)))
        return (upper + np.triu(upper, 1).T)[np.ix_(self._places, self._places)]

    def limits(self):
        """Lowest and highest position, effort and velocity of JOINTS."""
        joints = self._places[2:]
        model = self.model
        return (
            model.lowerPositionLimit[joints],
            model.upperPositionLimit[joints],
            model.effortLimit[joints],
            model.velocityLimit[joints],
        )
