"""A robot's file in, the torques that hold it at rest and their derivatives out."""
import sys

import dyntape
import numpy as np


def main() -> int:
    if len(sys.argv) != 2:
        print("usage: my-robot ROBOT.urdf", file=sys.stderr)
        return 2
    try:
        robot = dyntape.load(sys.argv[1])
    except dyntape.Error as problem:
        print(problem, file=sys.stderr)
        return 1
    q, zero = robot.neutral(), np.zeros(robot.nv)
    print(f"{robot.name}: {robot.nv} degrees of freedom")
    print("torques at rest:", robot.gravity(q))
    print("their derivatives by q:", robot.id_derivatives(q, zero, zero).dtau_dq, sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
