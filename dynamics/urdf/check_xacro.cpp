// SPDX-License-Identifier: BSD-3-Clause
//
// A robot description that xacro has yet to expand: urdfdom would pass over its macros and read a part of the robot.
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/urdf/check.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

constexpr const char* kExpand = "; expected a URDF file, which xacro makes: xacro FILE > robot.urdf";

[[noreturn]] void fail_unexpanded(const UrdfText& text, const XMLElement& element, const std::string& what) {
  text.fail(element, what + " is left of xacro" + kExpand);
}

void check_element(const UrdfText& text, const XMLElement& element) {
  if (std::string_view(element.Name()).starts_with("xacro:"))
    fail_unexpanded(text, element, std::string("<") + one_line(element.Name()) + ">");
}

// Names of mesh files are not read, so what they hold does not matter.
void check_attributes_expanded(const UrdfText& text, const XMLElement& element) {
  for (auto* a = element.FirstAttribute(); a; a = a->Next()) {
    const std::string_view value(a->Value());
    if (std::string_view(a->Name()) == "filename") continue;
    if (value.find("${") == value.npos && value.find("$(") == value.npos) continue;
    fail_unexpanded(text, element,
                    std::string("<") + one_line(element.Name()) + " " + one_line(a->Name()) + "=\"" +
                        one_line(a->Value()) + "\">");
  }
}

// In what only draws, a note.  tinyxml2 bounds the depth of nesting, so the recursion is bounded too.
void check_expanded_below(const UrdfText& text, const XMLElement& element, std::vector<std::string>& notes) {
  check_element(text, element);
  check_attributes_expanded(text, element);
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
    try {
      check_expanded_below(text, *child, notes);
    } catch (const FileError& e) {
      if (!only_draws(*child)) throw;
      notes.push_back(e.what());
    }
  }
}

}  // namespace

// Blocks for other programs (gazebo, transmission) may hold what they like.
void check_urdf_is_expanded(const UrdfText& text, std::vector<std::string>& notes) {
  check_attributes_expanded(text, text.robot());
  for (auto* child = text.robot().FirstChildElement(); child; child = child->NextSiblingElement()) {
    const std::string_view name(child->Name());
    if (name == "link" || name == "joint") check_expanded_below(text, *child, notes);
    check_element(text, *child);
  }
}

}  // namespace dyntape::dynamics
