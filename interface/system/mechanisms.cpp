// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/mechanisms.h>

#include <numeric>

namespace dyntape {

namespace {

// Sets of joints that are joined two by two; each is called by its first member.
class JoinedJoints {
 public:
  explicit JoinedJoints(int n) : first_(std::size_t(n)) { std::iota(first_.begin(), first_.end(), 0); }

  int first(int joint) const {
    while (first_[std::size_t(joint)] != joint) joint = first_[std::size_t(joint)];
    return joint;
  }
  void join(int a, int b) {
    if (a < 0 || b < 0) return;  // the world joins nothing
    const int i = first(a), k = first(b);
    first_[std::size_t(std::max(i, k))] = std::min(i, k);
  }

 private:
  std::vector<int> first_;
};

JoinedJoints joined_joints(const RobotScene& scene) {
  const auto& model = scene.model;
  JoinedJoints joined(model.njoints());
  for (int i = 0; i < model.njoints(); ++i) joined.join(i, model.parent[std::size_t(i)]);
  for (const auto& loop : scene.constraints.loops) joined.join(loop.body_1, loop.body_2);
  for (const auto& contact : scene.constraints.rigid.contacts) joined.join(contact.body, contact.plane_body);
  for (const auto& rule : scene.mimics)
    joined.join(model.joint_index(rule.joint), model.joint_index(rule.leader));
  for (const auto& tendon : scene.effects.tendons) {
    int last = -1;
    tendon.for_each_arm(model, [&](const dynamics::Joint<double>& joint, double) {
      const int i = int(&joint - model.joints.data());
      joined.join(last, i);
      last = i;
    });
  }
  return joined;
}

}  // namespace

std::vector<Mechanism> mechanisms_of(const RobotScene& scene) {
  const auto& model = scene.model;
  const JoinedJoints joined = joined_joints(scene);
  std::vector<Mechanism> mechanisms;
  std::vector<int> place(std::size_t(model.njoints()), -1);
  for (int i = 0; i < model.njoints(); ++i) {
    int& at = place[std::size_t(joined.first(i))];
    if (at < 0) {
      at = int(mechanisms.size());
      mechanisms.push_back({model.joints[std::size_t(i)].name, {}});
    }
    mechanisms[std::size_t(at)].joints.push_back(i);
  }
  return mechanisms;
}

std::vector<int> mechanism_of_joints(const std::vector<Mechanism>& mechanisms, int n_joints) {
  std::vector<int> place(std::size_t(n_joints), 0);
  for (std::size_t m = 0; m < mechanisms.size(); ++m) {
    for (const int joint : mechanisms[m].joints) place[std::size_t(joint)] = int(m);
  }
  return place;
}

}  // namespace dyntape
