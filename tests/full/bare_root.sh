#!/usr/bin/env bash
# A wheel of tools/wheel in a root with Python alone: no compiler, no package of Debian's besides Python's own.  Installs it and draws the first
# motion, and says how long both took; then a few calls.
#   bare_root.sh WHEEL_DIRECTORY      77: not root, or Debian's archive is out of reach
set -euo pipefail
[ "$(id -u)" = 0 ] || { echo "bare_root: needs root for chroot"; exit 77; }
wheels=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{debs,root/tmp,root/dev,root/wheels}
chmod a+rwx "$work"{,/debs}
(cd "$work/debs" && apt-get download -q libc6 libgcc-s1 libstdc++6 zlib1g libexpat1 libffi8 libssl3 libbz2-1.0 liblzma5 libuuid1 libcrypt1 \
  python3.11-minimal libpython3.11-minimal libpython3.11-stdlib dash coreutils libselinux1 libpcre2-8-0 libacl1 libattr1 libgmp10 >/dev/null 2>"$work/log") ||
  { echo "bare_root: Debian's archive is out of reach"; exit 77; }
root=$work/root
mkdir -p "$root"/usr/{bin,lib,sbin,lib64}
for folder in bin lib sbin lib64; do ln -s "usr/$folder" "$root/$folder"; done  # merged, as Debian's are
for deb in "$work"/debs/*.deb; do dpkg-deb --fsys-tarfile "$deb" | tar -x --keep-directory-symlink -C "$root"; done
ln -sf python3.11 "$root/usr/bin/python3"
mknod -m 666 "$root/dev/null" c 1 3; mknod -m 666 "$root/dev/urandom" c 1 9; mknod -m 666 "$root/dev/random" c 1 8
# What an index would give: numpy, and the installer itself.
python3.11 -m pip download -q --disable-pip-version-check --only-binary :all: --python-version 3.11 -d "$root/wheels" numpy pip \
  || { echo "bare_root: numpy is out of reach"; exit 77; }
cp "$wheels"/dyntape-*.whl "$root/wheels"
inside() { chroot "$root" /usr/bin/env -i HOME=/tmp PATH=/usr/bin "$@"; }
inside python3 -c 'import shutil; assert not any(map(shutil.which, ("cc", "gcc", "clang", "gnuplot")))'

begin=$(date +%s.%N)
inside python3 /wheels/"$(basename "$root"/wheels/pip-*.whl)"/pip install -q --no-index --find-links /wheels --target /tmp/site --no-warn-script-location dyntape
installed=$(date +%s.%N)
inside PYTHONPATH=/tmp/site python3 -m dyntape demo /tmp/first >"$work/demo.txt" 2>&1 || { cat "$work/demo.txt" >&2; exit 1; }
end=$(date +%s.%N)
[ "$(stat -c %s "$root/tmp/first/motion.html")" -gt 30000 ]
inside PYTHONPATH=/tmp/site python3 - <<'PYTHON'
import dyntape, numpy as np
robot = dyntape.load(dyntape.config_folder() / "robots" / "panda.urdf")
q = robot.random(1000)
assert np.isfinite(robot.id_derivatives(q, q, q).dtau_dq).all()
f = dyntape.record(lambda x: np.sin(x[0]) * x[1], 2)
assert f.jacobian([0.0, 3.0]).tolist() == [3.0, 0.0]
scene = dyntape.Scene(dyntape.config_folder() / "scenes" / "pendulum.info")
assert np.isfinite(scene.rollout(np.concatenate([scene.q, scene.v]), steps=100)).all()
PYTHON
python3 - "$begin" "$installed" "$end" <<'PYTHON'
import sys
begin, installed, end = map(float, sys.argv[1:])
print(f"bare_root: installed in {installed - begin:.1f} s, first picture {end - installed:.1f} s later")
sys.exit(end - begin > 60)
PYTHON
