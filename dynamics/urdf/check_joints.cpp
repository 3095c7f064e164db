// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string_view>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/dynamics/urdf/check.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

std::string_view type_of(const XMLElement& joint) {
  const char* type = joint.Attribute("type");
  return type ? type : "";
}

// Of the root link, which then is the world.
bool hangs_on_root(const UrdfText& text, const XMLElement& joint) {
  const XMLElement* parent = joint.FirstChildElement("parent");
  const char* root = parent ? parent->Attribute("link") : nullptr;
  for (const XMLElement* other : text.children("joint")) {
    const XMLElement* child = other->FirstChildElement("child");
    const char* link = child ? child->Attribute("link") : nullptr;
    if (root && link && std::string_view(root) == link) return false;
  }
  return root;
}

void check_type(const UrdfText& text, const XMLElement& joint) {
  static const std::vector<std::string> kSupported = {"revolute", "continuous", "prismatic", "planar",
                                                      "fixed"};
  const std::string type(type_of(joint));
  if (std::find(kSupported.begin(), kSupported.end(), type) != kSupported.end()) return;
  const std::string expected = "expected revolute, continuous, prismatic, planar or fixed";
  if (type.empty()) text.fail(joint, describe(joint) + " has no type; " + expected);
  if (type == "floating" && hangs_on_root(text, joint)) return;
  if (type == "floating")
    text.fail(joint,
              describe(joint) + " is of the type floating and does not hang on the root link; " + expected);
  text.fail(joint,
            describe(joint) + " has the type \"" + type + "\"; " + expected + suggestion(type, kSupported));
}

void check_axis(const UrdfText& text, const XMLElement& joint, std::vector<std::string>& notes) {
  const XMLElement* element = joint.FirstChildElement("axis");
  if (!element) return;  // x, as URDF says
  if (!element->Attribute("xyz"))
    text.fail(*element, describe(joint) + ": <axis> needs the attribute \"xyz\"");
  const Eigen::Vector3d axis = text.vector_below(joint, "axis", "xyz", Eigen::Vector3d::UnitX());
  if (axis.isZero(0)) text.fail(*element, describe(joint) + " has a zero axis; expected a direction");
  const double length = axis.stableNorm();
  if (std::abs(length - 1) > 1e-6)
    notes.push_back(text.where(*element) + describe(joint) + " has an axis of length " + digits(length) +
                    ", scaled to 1");
}

void check_limit(const UrdfText& text, const XMLElement& joint, std::vector<std::string>& notes) {
  const XMLElement* limit = joint.FirstChildElement("limit");
  const bool bounded = type_of(joint) != "continuous" && type_of(joint) != "planar";
  if (!limit && bounded)
    text.fail(joint, describe(joint) + " has no <limit>; a " + std::string(type_of(joint)) +
                         " joint needs lower, upper, velocity and effort");
  if (!limit) return;
  for (const char* name : {"velocity", "effort"}) {
    const auto value = text.number(*limit, name);
    if (!value) text.fail(*limit, describe(joint) + ": <limit> needs the attribute \"" + name + "\"");
    if (*value < 0)
      text.fail(*limit, describe(joint) + " has the " + name + " limit " + digits(*value) +
                            "; expected zero or more");
  }
  if (!bounded) return;
  const auto lower = text.number(*limit, "lower"), upper = text.number(*limit, "upper");
  if (lower.value_or(0) > upper.value_or(0))
    text.fail(*limit, describe(joint) + " has lower limit " + digits(lower.value_or(0)) +
                          " above upper limit " + digits(upper.value_or(0)));
  for (const auto& [name, value] : {std::pair{"lower", lower}, {"upper", upper}})
    if (!value)
      notes.push_back(text.where(*limit) + describe(joint) + " gives no " + name +
                      " limit, which reads as 0");
}

void check_mimic(const UrdfText& text, const XMLElement& joint, bool follow,
                 std::vector<std::string>& notes) {
  const XMLElement* mimic = joint.FirstChildElement("mimic");
  if (!mimic) return;
  const char* other = mimic->Attribute("joint");
  if (!other) text.fail(*mimic, describe(joint) + ": <mimic> needs the attribute \"joint\"");
  std::string missing;
  if (!text.find_joint(other)) {
    std::vector<std::string> names;
    for (const XMLElement* j : text.children("joint")) names.emplace_back(j->Attribute("name"));
    missing = ", and there is no such joint" + suggestion(other, names);
  }
  const std::string subject = describe(joint) + " mimics \"" + other + "\"" + missing;
  if (!follow) {
    notes.push_back(text.where(*mimic) + subject + kReadAsIndependent);
  } else if (!missing.empty()) {
    text.fail(*mimic, subject);
  } else if (type_of(*text.find_joint(other)) == "fixed") {
    text.fail(*mimic, subject + ", which is fixed; expected a joint that moves");
  }
}

}  // namespace

void check_urdf_joints(const UrdfText& text, bool follow_mimics, std::vector<std::string>& notes) {
  for (const XMLElement* joint : text.children("joint")) {
    check_type(text, *joint);
    if (type_of(*joint) == "floating") continue;
    if (type_of(*joint) == "fixed") {
      const XMLElement* mimic = joint->FirstChildElement("mimic");
      if (mimic && follow_mimics) text.fail(*mimic, describe(*joint) + " is fixed and cannot mimic another");
      continue;
    }
    check_axis(text, *joint, notes);
    check_limit(text, *joint, notes);
    check_mimic(text, *joint, follow_mimics, notes);
    note_repeated(text, *joint, {"parent", "child", "origin", "axis", "limit", "dynamics", "mimic"}, notes);
  }
}

}  // namespace dyntape::dynamics
