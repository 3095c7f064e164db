// SPDX-License-Identifier: BSD-3-Clause
//
// Hashes of what the algorithms give for random trees, in double: a line a tree.  aarch64.sh compares those of this
// machine with those of an emulated aarch64, whose registers hold two doubles.
//
// Sines and cosines are the C library's and differ between processors in the last bit, so none is taken: continuous joints
// and free-flyers get numbers of unit length, revolute joints stay at zero.  Floats are left out: Eigen sums four of them in
// an order of each processor.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>

#include <dyntape/dynamics/algorithms/algorithms.h>

using namespace dyntape::dynamics;

namespace {

struct Hash {
  std::uint64_t value = 14695981039346656037u;
  template <class M>
  void add(const M& x) {
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, x.data() + k, sizeof(*x.data()));
      value = (value ^ bits) * 1099511628211u;
      value ^= value >> 29;
    }
  }
};

struct Random {
  std::mt19937_64 engine{1};
  double number() { return static_cast<double>(engine() >> 11) * 0x1p-52 - 1; }
  Vector3<double> vector() { return {number(), number(), number()}; }
};

Placement<double> placement(Random& random) {
  // A turn of rational numbers: the quaternion (3, 4, 12, 0) / 13 or one of its like, written out.
  const double part[] = {3, 4, 12};
  const int k = static_cast<int>(random.engine() % 3);
  const double w = part[k] / 13, x = part[(k + 1) % 3] / 13, y = part[(k + 2) % 3] / 13;
  Matrix3<double> R;
  R << 1 - 2 * y * y, 2 * x * y, 2 * w * y,  //
      2 * x * y, 1 - 2 * x * x, -2 * w * x,  //
      -2 * w * y, 2 * w * x, 1 - 2 * (x * x + y * y);
  return {R, random.vector()};
}

Model<double> tree(Random& random, int joints) {
  constexpr JointType kTypes[] = {JointType::kRevolute, JointType::kContinuous, JointType::kPrismatic,
                                  JointType::kSpherical};
  Model<double> model;
  model.gravity = {0.3, -0.2, -9.81};
  for (int i = 0; i < joints; ++i) {
    Joint<double> joint;
    joint.name = std::to_string(i);
    joint.type = i == 0 && joints % 2 ? JointType::kFreeFlyer : kTypes[random.engine() % 4];
    joint.axis = Vector3<double>::Unit(static_cast<Eigen::Index>(random.engine() % 3));
    joint.armature = 0.1 + random.number() * 0.05;
    const Matrix3<double> I = Vector3<double>(0.3, 0.4, 0.5).asDiagonal();
    const int parent = i == 0 ? -1 : static_cast<int>(random.engine() % static_cast<unsigned>(i));
    const Placement<double> place = placement(random);
    const double mass = 1.5 + random.number();
    model.add_joint(parent, joint, place, {mass, random.vector(), I});
  }
  return model;
}

VectorX<double> configuration(const Model<double>& model, Random& random) {
  VectorX<double> q = VectorX<double>::Zero(model.nq);
  for (const Joint<double>& joint : model.joints) {
    const int at = joint.idx_q;
    if (joint.type == JointType::kPrismatic) q[at] = random.number();
    if (joint.type == JointType::kContinuous) q[at] = 0.6, q[at + 1] = 0.8;
    if (joint.type == JointType::kSpherical) q.segment(at, 4) << 0.1, 0.3, -0.3, 0.9;
    if (joint.type == JointType::kFreeFlyer) q.segment(at, 7) << random.vector(), 0.5, 0.5, -0.5, 0.5;
  }
  return q;
}

void add(Hash& hash, const Model<double>& model, const VectorX<double>& q, Random& random) {
  Data<double> data(model);
  VectorX<double> v(model.nv), a(model.nv);
  for (int i = 0; i < model.nv; ++i) v[i] = random.number(), a[i] = random.number();
  hash.add(rnea<double>(model, data, q, v, a)), hash.add(aba<double>(model, data, q, v, a));
  hash.add(crba<double>(model, data, q)), hash.add(minverse<double>(model, data, q));
  id_derivatives<double>(model, data, q, v, a);
  hash.add(data.dtau_dq), hash.add(data.dtau_dv);
  fd_derivatives<double>(model, data, q, v, a);
  hash.add(data.ddq_dq), hash.add(data.ddq_dv);
}

}  // namespace

int main() {
  Random random;
  for (int joints = 1; joints <= 24; ++joints) {
    const Model<double> model = tree(random, joints);
    Hash hash;
    for (int k = 0; k < 5; ++k) {
      const VectorX<double> q = configuration(model, random);
      add(hash, model, q, random);
    }
    std::printf("%d joints %016llx\n", joints, static_cast<unsigned long long>(hash.value));
  }
}
