// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string_view>

#include <dyntape/dynamics/urdf/check.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

using Tags = std::vector<std::string_view>;

// Elements of one kind: how many, and whose the first is.
struct LeftOut {
  std::string tag;
  int count = 0;
  std::string first;
};

class LeftOutList {
 public:
  // The children of an element but those that are read; `kind` "link", "joint" or "": of the robot.
  void add(const XMLElement& owner, const std::string& kind, const Tags& read) {
    for (auto* child = owner.FirstChildElement(); child; child = child->NextSiblingElement()) {
      const std::string tag = child->Name();
      if (std::find(read.begin(), read.end(), tag) != read.end()) continue;
      auto& kinds = kind == "link" ? links_ : kind == "joint" ? joints_ : robot_;
      auto at = std::find_if(kinds.begin(), kinds.end(), [&](const LeftOut& l) { return l.tag == tag; });
      if (at == kinds.end()) at = kinds.insert(at, {tag, 0, describe(owner)});
      ++at->count;
    }
  }

  std::vector<std::string> sentences() const {
    std::vector<std::string> all;
    for (const auto& [kinds, kind] : {std::pair(&links_, " links"), {&joints_, " joints"}, {&robot_, ""}}) {
      for (const LeftOut& l : *kinds) {
        const std::string many = std::to_string(l.count), tag = "<" + l.tag + ">";
        if (kinds == &robot_)
          all.push_back(l.count == 1 ? tag : many + " times " + tag);
        else
          all.push_back(tag + " of " + (l.count == 1 ? l.first : many + kind));
      }
    }
    return all;
  }

 private:
  std::vector<LeftOut> links_, joints_, robot_;
};

}  // namespace

std::vector<std::string> elements_left_out(const UrdfText& text) {
  LeftOutList list;
  for (const XMLElement* link : text.children("link")) list.add(*link, "link", {"inertial", "visual"});
  for (const XMLElement* joint : text.children("joint")) {
    const char* type = joint->Attribute("type");
    if (type && std::string_view(type) == "fixed")
      list.add(*joint, "joint", {"parent", "child", "origin", "axis", "limit", "dynamics", "calibration"});
    else
      list.add(*joint, "joint", {"parent", "child", "origin", "axis", "limit", "dynamics", "mimic"});
  }
  list.add(text.robot(), "", {"link", "joint", "material"});
  return list.sentences();
}

}  // namespace dyntape::dynamics
