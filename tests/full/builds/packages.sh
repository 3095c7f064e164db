#!/usr/bin/env bash
# A wheel and Debian's package of this build, each installed in a bare Debian 12 that has neither a compiler nor what dyntape is linked with.  There
# they solve the demo's task, the package in less than a second, and make a few calls from Python; a package of ROS 2's is linked with the libraries.
#   packages.sh SOURCE_DIR BUILD_DIR      77: no bare root can be made, or the build is without the Python package
set -euo pipefail
source=$1
export DYNTAPE_BUILD=$2
skip() { echo "packages: $1"; exit 77; }
[ "$(id -u)" = 0 ] || skip "a bare root needs root's rights"
command -v mmdebstrap >/dev/null || skip "mmdebstrap is missing, which tools/setup --full installs"
compgen -G "$DYNTAPE_BUILD/python/dyntape/_dyntape.*.so" >/dev/null || skip "this build is without the Python package, which tools/build --python makes"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
since() { python3 -c 'import sys, time; print(f"{time.time() - float(sys.argv[1]):.1f} s")' "$1"; }

start=$(date +%s.%N)
mmdebstrap --variant=apt --include=python3 --dpkgopt=force-unsafe-io --skip=cleanup/apt/lists bookworm "$root" >"$work/log" 2>&1 ||
  skip "mmdebstrap makes no root: $(tail -n 1 "$work/log")"
mkdir "$root/packages"
python3 -m pip download -q --disable-pip-version-check --only-binary :all: --python-version 3.11 -d "$root/packages" numpy pip ||
  skip "numpy is out of reach"
echo "packages: a bare root in $(since "$start")"
for kind in wheel deb; do
  start=$(date +%s.%N)
  "$source/tools/package" "$kind" "$root/packages" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
  echo "packages: the $kind is made in $(since "$start"): $(du -h "$root"/packages/dyntape[-_]0* | tail -n 1 | cut -f 1)"
done

inside() { chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"; }
quietly() { "$@" >"$work/log" 2>&1 || { tail -n 40 "$work/log" >&2; exit 1; }; }
# [NAME=VALUE ...]: the demo and a few calls, by Python with these variables.
python_works() {
  rm -rf "$root/tmp/first"
  quietly inside "$@" python3 -m dyntape demo /tmp/first
  [ "$(stat -c %s "$root/tmp/first/motion.html")" -gt 30000 ]
  quietly inside "$@" python3 - <<'PYTHON'
import dyntape, numpy as np
robot = dyntape.load(dyntape.config_folder() / "robots" / "panda.urdf")
q = robot.random(1000)
assert np.isfinite(robot.id_derivatives(q, q, q).dtau_dq).all()
f = dyntape.record(lambda x: np.sin(x[0]) * x[1], 2)
assert f.jacobian([0.0, 3.0]).tolist() == [3.0, 0.0]
scene = dyntape.Scene(dyntape.config_folder() / "scenes" / "pendulum.info")
assert np.isfinite(scene.rollout(np.concatenate([scene.q, scene.v]), steps=100)).all()
PYTHON
}
inside python3 -c 'import shutil; assert not any(map(shutil.which, ("cc", "gcc", "clang", "gnuplot", "dyntape")))'

start=$(date +%s.%N)
inside PYTHONPATH="/packages/$(basename "$root"/packages/pip-*.whl)" python3 -m pip install -q --no-index --find-links /packages --target /tmp/site \
  --root-user-action ignore dyntape
echo "packages: the wheel is installed in $(since "$start")"
python_works PYTHONPATH=/tmp/site
rm -r "$root/tmp/site"

start=$(date +%s.%N)
quietly inside apt-get install -y --no-install-recommends "/packages/$(basename "$root"/packages/dyntape_*.deb)"
echo "packages: the package is installed in $(since "$start"), with what it depends on"
inside python3 -c 'import shutil; assert not any(map(shutil.which, ("cc", "gcc", "clang")))'
python_works
inside python3 - <<'PYTHON'
import pathlib, resource, subprocess, time
def processor(): return sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
for run in "without a cache", "again":
    begin, used = time.time(), processor()
    subprocess.run(["dyntape", "solve", "/usr/share/dyntape/tasks/arm_around_obstacles.info", "--output", "/tmp/out"], check=True, capture_output=True)
    seconds, used = time.time() - begin, processor() - used
    print(f"packages: the demo's task is solved and drawn {run} in {seconds:.2f} s, {used:.2f} s of a processor")
    assert used < 1  # others at work here make it wait
for name in "motion.html", "motion.svg", "report.json", "trajectory.csv": assert pathlib.Path("/tmp/out", name).exists(), name
PYTHON

start=$(date +%s.%N)
quietly cmake -S "$source/tests/full/builds/ros_package" -B "$work/ros" -G Ninja -Ddyntape_DIR="$root/usr/lib/cmake/dyntape" \
  -DPython3_EXECUTABLE=/usr/bin/python3 -DMAIN="$root/usr/share/dyntape/examples/template/main.cpp"
quietly cmake --build "$work/ros"
"$work/ros/my_robot" "$root/usr/share/dyntape/robots/ur5.urdf"
quietly cmake --install "$work/ros" --prefix "$work/installed"
[ -f "$root/usr/share/ament_index/resource_index/packages/dyntape" ] && [ -f "$work/installed/share/ament_index/resource_index/packages/my_robot" ]
echo "packages: a package of ROS 2's is linked with it in $(since "$start")"
quietly inside apt-get remove -y dyntape
[ -z "$(find "$root/usr" -path '*dyntape*' -not -path '*/__pycache__*' -type f)" ]
