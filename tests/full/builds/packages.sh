#!/usr/bin/env bash
# A wheel and Debian's package of this build, each installed in a bare Debian 12 that has neither a compiler nor what dyntape is linked with.  There
# they solve the demo's task, the package in less than a second, and make a few calls from Python, README's ten lines among them; a package of ROS 2's
# is linked with the libraries.
#   packages.sh SOURCE_DIR BUILD_DIR [aarch64]      77: no bare root can be made, or the build is without the Python package
#   aarch64: those of `tools/package --aarch64`, in an emulated root, however long they take; a program of README's ten lines in place of ROS 2's package
set -euo pipefail
source=$1
export DYNTAPE_BUILD=$2
skip() { echo "packages: $1"; exit 77; }
package=("$source/tools/package") architecture=() platform=() most=1
if [ "${3:-}" = aarch64 ]; then
  package+=(--aarch64) architecture=(--architectures=arm64) platform=(--platform manylinux_2_28_aarch64) most=600
  "$source/tools/setup" --aarch64
  [ -e /proc/sys/fs/binfmt_misc/qemu-aarch64 ] || skip "this kernel starts no programs for aarch64 by qemu (update-binfmts --enable qemu-aarch64)"
fi
[ "$(id -u)" = 0 ] || skip "a bare root needs root's rights"
command -v mmdebstrap >/dev/null || skip "mmdebstrap is missing, which tools/setup --full installs"
[ ${#architecture[@]} -gt 0 ] || compgen -G "$DYNTAPE_BUILD/python/dyntape/_dyntape.*.so" >/dev/null || skip "this build is without the Python package, which tools/build --python makes"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
since() { python3 -c 'import sys, time; print(f"{time.time() - float(sys.argv[1]):.1f} s")' "$1"; }

start=$(date +%s.%N)
mmdebstrap "${architecture[@]}" --variant=apt --include=python3 --dpkgopt=force-unsafe-io --skip=cleanup/apt/lists bookworm "$root" >"$work/log" 2>&1 ||
  skip "mmdebstrap makes no root: $(tail -n 1 "$work/log")"
mkdir "$root/packages"
python3 -m pip download -q --disable-pip-version-check --only-binary :all: "${platform[@]}" --python-version 3.11 -d "$root/packages" numpy pip ||
  skip "numpy is out of reach"
echo "packages: a bare root in $(since "$start")"
for kind in wheel deb; do
  start=$(date +%s.%N)
  "${package[@]}" "$kind" "$root/packages" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
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
  sed -n '/^```python/,/^```/p' "$source/README.md" | grep -v '^```' >"$root/tmp/ten_lines.py"
  quietly inside "$@" python3 - <<'PYTHON'
import os, pathlib, dyntape, numpy as np
os.chdir(dyntape.config_folder().parent)  # which has config/
exec(pathlib.Path("/tmp/ten_lines.py").read_text())
def distance(x): return ((arm.frame_placement(x, frame="tool0").p - target) ** 2).sum()
assert value.shape[0] == gradient.shape[0] == hessian.shape[0] == 1000
for k in 0, 999:
  differences = [(distance(q[k] + d) - distance(q[k] - d)) / 2e-6 for d in 1e-6 * np.eye(6)]
  assert np.allclose(np.ravel(gradient[k]), differences, atol=1e-8), (gradient[k], differences)
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
inside python3 - $most <<'PYTHON'
import pathlib, resource, subprocess, sys, time
def processor(): return sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
for run in "without a cache", "again":
    begin, used = time.time(), processor()
    subprocess.run(["dyntape", "solve", "/usr/share/dyntape/tasks/arm_around_obstacles.info", "--output", "/tmp/out"], check=True, capture_output=True)
    seconds, used = time.time() - begin, processor() - used
    print(f"packages: the demo's task is solved and drawn {run} in {seconds:.2f} s, {used:.2f} s of a processor")
    assert used < float(sys.argv[1])  # others at work here make it wait
for name in "motion.html", "motion.svg", "report.json", "trajectory.csv": assert pathlib.Path("/tmp/out", name).exists(), name
PYTHON

if [ ${#architecture[@]} -eq 0 ]; then
  start=$(date +%s.%N)
  quietly cmake -S "$source/tests/full/builds/ros_package" -B "$work/ros" -G Ninja -Ddyntape_DIR="$root/usr/lib/cmake/dyntape" \
    -DPython3_EXECUTABLE=/usr/bin/python3 -DMAIN="$root/usr/share/dyntape/examples/template/main.cpp"
  quietly cmake --build "$work/ros"
  "$work/ros/my_robot" "$root/usr/share/dyntape/robots/ur5.urdf"
  quietly cmake --install "$work/ros" --prefix "$work/installed"
  [ -f "$root/usr/share/ament_index/resource_index/packages/dyntape" ] && [ -f "$work/installed/share/ament_index/resource_index/packages/my_robot" ]
  echo "packages: a package of ROS 2's is linked with it in $(since "$start")"
else
  start=$(date +%s.%N)
  mkdir "$work/ten_lines"
  cp "$source/examples/template/CMakeLists.txt" "$work/ten_lines"
  {
    printf '#include <dyntape/%s>\n' autodiff/record/record.h codegen/compiled_function.h dynamics/algorithms/algorithms.h dynamics/urdf/urdf.h
    printf '#include <cstdio>\nusing namespace dyntape;\nint main() {\n'
    sed -n '/^```cpp/,/^```/p' "$source/README.md" | grep -v '^```'
    printf 'std::printf("%%.17g %%zu %%zu\\n", r.y[0], r.jacobian.size(), r.hessian.size());\n}\n'
  } >"$work/ten_lines/main.cpp"
  quietly cmake -S "$work/ten_lines" -B "$work/ten_lines/build" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$source/tools/aarch64.cmake" \
    -Ddyntape_DIR="$root/usr/lib/cmake/dyntape"
  quietly cmake --build "$work/ten_lines/build"
  mkdir "$root/tmp/config"
  cp -r "$source/config/robots" "$root/tmp/config"
  cp "$work/ten_lines/build/my_robot" "$root/tmp"
  inside sh -c 'cd /tmp && ./my_robot' | tee "$work/log"
  grep -q ' [0-9]* [0-9]*$' "$work/log"
  echo "packages: README's ten lines are linked with it in $(since "$start")"
fi
quietly inside apt-get remove -y dyntape
[ -z "$(find "$root/usr" -path '*dyntape*' -not -path '*/__pycache__*' -type f)" ]
