"""The walker in an independent rigid-body library: nothing here is shared with the package's model."""

import numpy as np
import pinocchio as pin

from walk_optimizer.model.parameters import KneeSpring, WalkerParameters

# Our q4 and q6 are pi for a stretched knee, where the library's revolute joint is at zero.
STRETCHED = np.array([0.0, 0.0, 0.0, np.pi, 0.0, np.pi])


class PinocchioWalker:
    """Prismatic x and y, then hip and knee of both legs, turning about z; y points up."""

    def __init__(self, walker: WalkerParameters, spring: KneeSpring | None = None):
        self.spring = spring or KneeSpring()
        self.model = pin.Model()
        self.model.gravity.linear = np.array([0.0, -walker.gravity, 0.0])
        across = self.model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "x")
        hip = self.model.addJoint(across, pin.JointModelPY(), pin.SE3.Identity(), "y")
        self._add_mass(hip, walker.hip_mass, 0.0)
        for leg in (1, 2):
            upper = self.model.addJoint(hip, pin.JointModelRZ(), pin.SE3.Identity(), f"hip_{leg}")
            self._add_mass(upper, walker.upper_leg_mass, walker.upper_leg_length / 2)
            below = _down(walker.upper_leg_length)
            lower = self.model.addJoint(upper, pin.JointModelRZ(), below, f"knee_{leg}")
            self._add_mass(lower, walker.lower_leg_mass, walker.lower_leg_length / 2)
            foot = pin.Frame(f"foot_{leg}", lower, _down(walker.lower_leg_length), pin.FrameType.OP_FRAME)
            self.model.addFrame(foot)
        self.data = self.model.createData()
        self._feet = [self.model.getFrameId(f"foot_{leg}") for leg in (1, 2)]

    def _add_mass(self, joint, mass, distance):
        point = pin.Inertia(mass, np.array([0.0, -distance, 0.0]), np.zeros((3, 3)))
        self.model.appendBodyToJoint(joint, point, pin.SE3.Identity())

    def mass_matrix(self, q):
        upper = np.triu(pin.crba(self.model, self.data, q - STRETCHED))
        return upper + np.triu(upper, 1).T

    def gravity(self, q):
        """dV/dq of gravity, (6,)."""
        return pin.computeGeneralizedGravity(self.model, self.data, q - STRETCHED).copy()

    def bias(self, q, qdot):
        """Coriolis, centrifugal and gravity terms of M qddot + bias = tau, (6,)."""
        return pin.nonLinearEffects(self.model, self.data, q - STRETCHED, qdot).copy()

    def force(self, q, qdot):
        """-dH/dq: as dM/dt = C + C', the derivative of the co-energy is C' qdot."""
        coriolis = pin.computeCoriolisMatrix(self.model, self.data, q - STRETCHED, qdot)
        rate = coriolis.T @ qdot - self.gravity(q)
        rate[[3, 5]] -= self.spring.stiffness * (q[[3, 5]] - self.spring.equilibrium)
        return rate

    def energy(self, q, qdot):
        kinetic = pin.computeKineticEnergy(self.model, self.data, q - STRETCHED, qdot)
        bend = q[[3, 5]] - self.spring.equilibrium
        springs = self.spring.stiffness / 2 * float(bend @ bend)
        return kinetic + pin.computePotentialEnergy(self.model, self.data, q - STRETCHED) + springs

    def feet(self, q):
        """Positions of the feet, (2, 2): rows x and y, one column a foot."""
        pin.framesForwardKinematics(self.model, self.data, q - STRETCHED)
        return np.column_stack([self.data.oMf[foot].translation[:2] for foot in self._feet])

    def foot_jacobians(self, q):
        """(2, 2, 6): foot, x and y, coordinate."""
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        joints = q - STRETCHED
        return np.array(
            [pin.computeFrameJacobian(self.model, self.data, joints, foot, frame)[:2] for foot in self._feet]
        )


def _down(distance):
    return pin.SE3(np.eye(3), np.array([0.0, -distance, 0.0]))
