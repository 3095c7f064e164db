// SPDX-License-Identifier: BSD-3-Clause
#include "model_json.h"

#include <vector>

namespace dyntape::tools {
namespace {

template <class V>
nlohmann::json array(const V& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

}  // namespace

nlohmann::json model_json(const dynamics::Model<double>& model) {
  nlohmann::json j = {{"name", model.name}, {"nq", model.nq}, {"nv", model.nv}};
  j["gravity"] = array(model.gravity);
  for (int i = 0; i < model.njoints(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto& joint = model.joints[at];
    const auto& body = model.inertias[at];
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = model.X_PJ[at].R, I = body.I_c;
    j["joints"].push_back({{"type", dynamics::to_string(joint.type)},
                           {"parent", model.parent[at]},
                           {"idx_q", joint.idx_q},
                           {"idx_v", joint.idx_v},
                           {"axis", array(joint.axis)},
                           {"rotation", array(R)},
                           {"translation", array(model.X_PJ[at].p)},
                           {"mass", body.mass},
                           {"com", array(body.com)},
                           {"inertia", array(I)},
                           {"armature", joint.armature}});
  }
  return j;
}

}  // namespace dyntape::tools
