"""Pinocchio as an independent judge of offline/arm: `pinocchio_compare.py FOLDER`.

FOLDER holds pairs NNN.urdf, NNN.txt. The text has the names of moving joints, links and tip, then states; every line is a name
and numbers (offline/arm/tests/pinocchio.rs writes it). Pinocchio reads the URDF by itself, computes everything at the same
states, and the worst deviation per quantity is printed. Exit status 0 if all agree within 1e-9 of the quantity's size, and the
accelerations of dynamics.csv, which carry rounding of their own, within 1e-7.
"""

import pathlib
import sys

import numpy as np
import pinocchio as pin

TOLERANCE = 1e-9
TOLERANCE_OF_VECTORS = 1e-7


def read(path):
    """Names and the list of states, each a dictionary of arrays."""
    head, states = {}, []
    for line in path.read_text().splitlines():
        name, *rest = line.split()
        if name == "state":
            states.append({})
        elif states:
            states[-1][name] = np.array([float(number) for number in rest])
        else:
            head[name] = rest
    return head, states


class Arm:
    """Pinocchio's model with joints in our order."""

    def __init__(self, urdf, head):
        self.model = pin.buildModelFromUrdf(str(urdf))
        self.data = self.model.createData()
        self.ids = [self.model.getJointId(name) for name in head["joints"]]
        assert len(self.ids) == self.model.njoints - 1, "moving joints differ"
        self.columns = [self.model.joints[i].idx_v for i in self.ids]
        self.links = [self.model.getFrameId(name) for name in head["links"]]
        self.tip = self.model.getFrameId(head["tip"][0])
        assert self.tip < self.model.nframes, "no tip"

    def configuration(self, q):
        """A continuous joint is a point of the circle here."""
        out = pin.neutral(self.model)
        for joint, value in zip(self.ids, q):
            joint = self.model.joints[joint]
            if joint.nq == 2:
                out[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                out[joint.idx_q] = value
        return out

    def spread(self, values):
        out = np.zeros(self.model.nv)
        out[self.columns] = values
        return out


def pose(transform):
    return transform.homogeneous[:3].ravel()


def compute(arm, state):
    """Everything under the names of the text."""
    model, data, columns = arm.model, arm.data, arm.columns
    q = arm.configuration(state["q"])
    qd, qdd = arm.spread(state["qd"]), arm.spread(state["qdd"])
    pin.forwardKinematics(model, data, q)
    pin.updateFramePlacements(model, data)
    parameters = np.concatenate([model.inertias[i].toDynamicParameters() for i in arm.ids])
    found = {
        "tip_pose": pose(data.oMf[arm.tip]),
        "link_poses": np.concatenate([pose(data.oMf[link]) for link in arm.links]),
        "jacobian": pin.computeFrameJacobian(model, data, q, arm.tip, pin.LOCAL_WORLD_ALIGNED)[:, columns].ravel(),
        "bias": pin.nonLinearEffects(model, data, q, qd)[columns],
        "gravity": pin.computeGeneralizedGravity(model, data, q)[columns].copy(),
        "inverse_dynamics": pin.rnea(model, data, q, qd, qdd)[columns],
        "kinetic_energy": np.array([pin.computeKineticEnergy(model, data, q, qd)]),
        "parameters": parameters,
    }
    upper = np.triu(pin.crba(model, data, q))
    mass_matrix = upper + np.triu(upper, 1).T
    found["mass_matrix"] = mass_matrix[np.ix_(columns, columns)].ravel()
    regressor = pin.computeJointTorqueRegressor(model, data, q, qd, qdd)[columns]
    blocks = [regressor[:, 10 * (joint - 1) : 10 * joint] for joint in arm.ids]
    found["regressor"] = np.hstack(blocks).ravel()
    if "tau" in state:
        accelerations = pin.aba(model, data, q, qd, arm.spread(state["tau"]))[columns]
        found["accelerations"] = found["vector_qdd"] = accelerations
    return found


def coriolis_torque(state, found):
    """C qd of our matrix against Pinocchio's bias less gravity; its own matrix need not be the same one."""
    n = len(state["qd"])
    return state["coriolis"].reshape(n, n) @ state["qd"], found["bias"] - found["gravity"]


def compare(folder):
    worst, arms, states = {}, 0, 0
    for text in sorted(folder.glob("*.txt")):
        head, cases = read(text)
        arm = Arm(text.with_suffix(".urdf"), head)
        arms += 1
        for state in cases:
            found = compute(arm, state)
            pairs = {name: (state[name], value) for name, value in found.items() if name in state}
            pairs["coriolis_torque"] = coriolis_torque(state, found)
            for name, (ours, theirs) in pairs.items():
                assert ours.shape == theirs.shape, (text.name, name, ours.shape, theirs.shape)
                size = 1.0 if name == "vector_qdd" else max(1.0, np.abs(theirs).max())
                deviation = float(np.abs(ours - theirs).max() / size)
                # What is no number is worst, and stays it.
                if name not in worst or np.isnan(deviation) or deviation > worst[name][0]:
                    worst[name] = (deviation, text.name)
            states += 1
    return worst, arms, states


def main():
    worst, arms, states = compare(pathlib.Path(sys.argv[1]))
    print(f"pinocchio {pin.__version__}; worst deviation, relative to the largest number of the quantity or 1")
    good = arms > 0 and states > 0
    for name, (deviation, case) in sorted(worst.items()):
        tolerance = TOLERANCE_OF_VECTORS if name == "vector_qdd" else TOLERANCE
        good = good and deviation < tolerance
        print(f"  {name:<18} {deviation:.1e}  arm {case}")
    print(f"{'agreed' if good else 'DIFFER'}: {arms} arms, {states} states")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
