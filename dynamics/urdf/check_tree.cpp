// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <set>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/dynamics/urdf/check.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

std::string on_line(const XMLElement& element) {
  return " (line " + std::to_string(element.GetLineNum()) + ")";
}

std::vector<std::string> names_of(const std::vector<const XMLElement*>& elements) {
  std::vector<std::string> names;
  for (const XMLElement* e : elements) names.emplace_back(e->Attribute("name"));
  return names;
}

void check_names(const UrdfText& text, const char* tag) {
  std::map<std::string, const XMLElement*> seen;
  for (const XMLElement* element : text.children(tag)) {
    const char* name = element->Attribute("name");
    if (!name || !*name) text.fail(*element, std::string("<") + tag + "> has no name");
    const auto [first, fresh] = seen.emplace(name, element);
    if (!fresh) text.fail(*element, describe(*element) + " is there already" + on_line(*first->second));
  }
}

// The link that <parent> or <child> of a joint names.
const XMLElement* named_link(const UrdfText& text, const XMLElement& joint, const char* tag) {
  const XMLElement* element = joint.FirstChildElement(tag);
  if (!element) text.fail(joint, describe(joint) + " has no <" + tag + " link=\"...\"/>");
  const char* name = element->Attribute("link");
  if (!name) text.fail(*element, describe(joint) + ": <" + tag + "> needs the attribute \"link\"");
  const XMLElement* link = text.find_link(name);
  if (!link)
    text.fail(*element, describe(joint) + " has the " + tag + " \"" + name + "\", and there is no such link" +
                            suggestion(name, names_of(text.children("link"))));
  return link;
}

struct Edges {
  std::map<const XMLElement*, const XMLElement*> joint_above;       // link -> the joint that carries it
  std::multimap<const XMLElement*, const XMLElement*> links_below;  // link -> links its joints carry
};

Edges read_edges(const UrdfText& text) {
  Edges edges;
  for (const XMLElement* joint : text.children("joint")) {
    const XMLElement* parent = named_link(text, *joint, "parent");
    const XMLElement* child = named_link(text, *joint, "child");
    if (parent == child)
      text.fail(*joint,
                describe(*joint) + " makes a loop: its parent and child are both " + describe(*child));
    const auto [other, fresh] = edges.joint_above.emplace(child, joint);
    if (!fresh)
      text.fail(*joint, describe(*child) + " has two parents: " + describe(*joint) + " and " +
                            describe(*other->second) + on_line(*other->second) +
                            "; expected a tree, cut closed chains at one joint");
    edges.links_below.emplace(parent, child);
  }
  return edges;
}

const XMLElement* find_root(const UrdfText& text, const Edges& edges) {
  const XMLElement* root = nullptr;
  for (const XMLElement* link : text.children("link")) {
    if (edges.joint_above.count(link)) continue;
    if (root)
      text.fail(*link, describe(*link) + " is a second root beside " + describe(*root) + on_line(*root) +
                           "; expected every link but one to be the child of a joint");
    root = link;
  }
  return root;
}

}  // namespace

void check_urdf_names(const UrdfText& text) {
  if (const char* name = text.robot().Attribute("name"); !name || !*name)
    text.fail(text.robot(), "<robot> has no name");
  if (text.children("link").empty())
    text.fail(text.robot(), describe(text.robot()) + " has no <link>; expected at least one");
  check_names(text, "link");
  check_names(text, "joint");
}

void check_urdf_tree(const UrdfText& text) {
  const Edges edges = read_edges(text);
  std::set<const XMLElement*> reached;
  std::vector<const XMLElement*> open;
  if (const XMLElement* root = find_root(text, edges)) open.push_back(root);
  while (!open.empty()) {
    const XMLElement* link = open.back();
    open.pop_back();
    reached.insert(link);
    const auto [begin, end] = edges.links_below.equal_range(link);
    for (auto below = begin; below != end; ++below) open.push_back(below->second);
  }
  // One parent each and not below the root: what is left can only be a loop and what hangs on it.
  for (const XMLElement* link : text.children("link")) {
    if (reached.count(link)) continue;
    const XMLElement* joint = edges.joint_above.at(link);
    text.fail(*joint, describe(*joint) + " carries " + describe(*link) +
                          ", which hangs on a loop of joints and on no root; expected a tree");
  }
}

}  // namespace dyntape::dynamics
