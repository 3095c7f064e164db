#!/usr/bin/env bash
# Agreement with Pinocchio on 1000 states, and times beside it, on our robots and on public files that are not ours; which of those are read.
#   pinocchio.sh DYNTAPE SOURCE_DIR BUILD_DIR
set -euo pipefail
dyntape=$1 source=$2 build=$3
python=$build/peers/bin/python
robots() { find "$build/peers/lib" -type d -path '*share/example-robot-data/robots' 2>/dev/null | head -n 1 || true; }
# The benchmarks may have made the folder, without what they do not need.
if ! "$python" -c 'import numpy, pinocchio' 2>/dev/null || [ -z "$(robots)" ]; then
  python3 -m venv "$build/peers"
  "$python" -m pip install -q pin numpy example-robot-data
fi
"$python" -m pip install -q upkie_description cookie_description jvrc_description
ours=$source/config/robots
theirs=$(robots)
[ -n "$theirs" ] || { echo "pinocchio.sh: example-robot-data brought no robots" >&2; exit 1; }
"$python" "$source/tests/full/robots/pinocchio_agreement.py" "$dyntape" --states 1000 \
  "$ours"/{pendulum,cart_pole,block,arm_2r,double_pendulum,ur5,panda,iiwa14,solo12}.urdf \
  "$ours"/{solo12,g1,talos,simple_humanoid}.urdf:floating \
  "$source"/tests/full/robots/planar_cart.urdf{,:floating} \
  "$theirs"/panda_description/urdf/panda.urdf "$theirs"/ur_description/urdf/ur5_robot.urdf \
  "$theirs"/talos_data/robots/talos_reduced.urdf:floating
"$python" "$source/tests/full/robots/public_robots.py" "$dyntape" "$build/peers/lib"
# Both in one process: the peer compiles, agrees and is timed.
"$dyntape" bench "$ours"/panda.urdf --peer --peer-prefix "$build/peers"
"$dyntape" bench "$ours"/solo12.urdf --base floating --peer --peer-prefix "$build/peers"
