// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/check.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

struct NumberAttribute {
  std::string_view element;
  const char* name;
  int count;
};

// Every numeric attribute of links and joints that URDF knows.
constexpr NumberAttribute kNumbers[] = {{"origin", "xyz", 3},
                                        {"origin", "rpy", 3},
                                        {"axis", "xyz", 3},
                                        {"mass", "value", 1},
                                        {"inertia", "ixx", 1},
                                        {"inertia", "ixy", 1},
                                        {"inertia", "ixz", 1},
                                        {"inertia", "iyy", 1},
                                        {"inertia", "iyz", 1},
                                        {"inertia", "izz", 1},
                                        {"limit", "lower", 1},
                                        {"limit", "upper", 1},
                                        {"limit", "velocity", 1},
                                        {"limit", "effort", 1},
                                        {"dynamics", "damping", 1},
                                        {"dynamics", "friction", 1},
                                        {"mimic", "multiplier", 1},
                                        {"mimic", "offset", 1},
                                        {"calibration", "rising", 1},
                                        {"calibration", "falling", 1},
                                        {"safety_controller", "k_position", 1},
                                        {"safety_controller", "k_velocity", 1},
                                        {"safety_controller", "soft_lower_limit", 1},
                                        {"safety_controller", "soft_upper_limit", 1},
                                        {"box", "size", 3},
                                        {"sphere", "radius", 1},
                                        {"cylinder", "radius", 1},
                                        {"cylinder", "length", 1},
                                        {"color", "rgba", 4}};

void check_attributes(const UrdfText& text, const XMLElement& element) {
  for (auto* a = element.FirstAttribute(); a; a = a->Next())
    for (auto* b = a->Next(); b; b = b->Next())
      if (std::string_view(a->Name()) == b->Name())
        text.fail(element,
                  std::string("<") + element.Name() + "> has the attribute \"" + a->Name() + "\" twice");
  for (const NumberAttribute& n : kNumbers)
    if (n.element == element.Name()) text.numbers(element, n.name, n.count);
}

void check_encoding(const UrdfText& text, const XMLElement& element) {
  const char* name = element.Attribute("name");
  const std::string fault = name ? fault_of_name(name) : "";
  if (!fault.empty()) text.fail(element, std::string("a <") + element.Name() + "> has a name that " + fault);
}

// Entities and the like, which urdfdom cannot read and tinyxml2 takes for text.
void check_document_type(const UrdfText& text) {
  for (auto* node = text.robot().GetDocument()->FirstChild(); node; node = node->NextSibling()) {
    if (!node->ToUnknown() || std::string_view(node->Value()).find('[') == std::string_view::npos) continue;
    text.fail(text.robot(),
              "before <robot> stands a <!DOCTYPE> with declarations, which cannot be read; expected none");
  }
}

// One factor for all, as other formats have it, is what files get wrong here.
void check_mesh(const UrdfText& text, const XMLElement& owner, const XMLElement& mesh) {
  try {
    text.numbers(mesh, "scale", 3);
  } catch (const FileError&) {
    text.fail(mesh, std::string("<mesh scale=\"") + one_line(mesh.Attribute("scale")) + "\"> of " +
                        describe(owner) +
                        ": expected three numbers, the factors along x, y and z, as in \"1 1 1\"");
  }
}

// Faults in what only draws: the first, and how many there are.
struct Undrawn {
  std::string first;
  int count = 0;
};

// tinyxml2 bounds the depth of nesting, so the recursion is bounded too.
void check_numbers_below(const UrdfText& text, const XMLElement& owner, const XMLElement& element,
                         Undrawn& undrawn) {
  check_attributes(text, element);
  if (std::string_view(element.Name()) == "mesh") check_mesh(text, owner, element);
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
    try {
      check_numbers_below(text, owner, *child, undrawn);
    } catch (const FileError& e) {
      if (!only_draws(*child)) throw;
      if (undrawn.count++ == 0) undrawn.first = e.what();
    }
  }
}

const XMLElement& required_child(const UrdfText& text, const XMLElement& owner, const XMLElement& element,
                                 const char* tag) {
  const XMLElement* child = element.FirstChildElement(tag);
  if (!child) text.fail(element, describe(owner) + " has <" + element.Name() + "> without <" + tag + ">");
  return *child;
}

double required_number(const UrdfText& text, const XMLElement& owner, const XMLElement& element,
                       const char* attribute) {
  const auto value = text.number(element, attribute);
  if (!value)
    text.fail(element,
              describe(owner) + ": <" + element.Name() + "> needs the attribute \"" + attribute + "\"");
  return *value;
}

Eigen::Matrix3d inertia_tensor(const UrdfText& text, const XMLElement& link, const XMLElement& inertia) {
  const auto entry = [&](const char* name) { return required_number(text, link, inertia, name); };
  const double xx = entry("ixx"), xy = entry("ixy"), xz = entry("ixz");
  const double yy = entry("iyy"), yz = entry("iyz"), zz = entry("izz");
  Eigen::Matrix3d I;
  I << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return I;
}

// Principal moments of the tensor about the centre of mass, ascending.
void check_inertia_tensor(const UrdfText& text, const XMLElement& link, const XMLElement& inertia,
                          double mass, bool accept_nonphysical, std::vector<std::string>& notes) {
  const Eigen::Matrix3d I = inertia_tensor(text, link, inertia);
  const double scale = I.cwiseAbs().maxCoeff();
  if (scale == 0) return;
  const Eigen::Vector3d e =
      scale * Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I / scale, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double kDust = 1e-15;  // kg m^2: below it all is rounding
  if (e[0] < -std::max({1e-9 * scale, 1e-12 * mass, kDust})) {
    const std::string fault = describe(link) + " has an inertia that no body has: its smallest principal " +
                              "moment is " + digits(e[0]) + " kg m^2";
    if (!accept_nonphysical)
      text.fail(inertia, fault +
                             "; expected none below zero.  To read it as it is: --inertia warn, in a file of "
                             "a task or scene "
                             "'inertia warn', in Python accept_nonphysical_inertia=True");
    notes.push_back(text.where(inertia) + fault + "; read as it is");
    return;
  }
  if (e[2] > (e[0] + e[1]) * (1 + 1e-6) + kDust)
    notes.push_back(text.where(inertia) + describe(link) +
                    " has an inertia that no rigid body has: principal " + "moments " + digits(e[0]) + ", " +
                    digits(e[1]) + ", " + digits(e[2]) + ", the largest above the sum of the others");
  if (mass == 0)
    notes.push_back(text.where(inertia) + describe(link) + " has rotational inertia but no mass");
}

}  // namespace

void note_repeated(const UrdfText& text, const XMLElement& element, std::initializer_list<const char*> tags,
                   std::vector<std::string>& notes) {
  for (const char* tag : tags) {
    const XMLElement* first = element.FirstChildElement(tag);
    if (const XMLElement* second = first ? first->NextSiblingElement(tag) : nullptr)
      notes.push_back(text.where(*second) + describe(element) + " has <" + tag +
                      "> more than once; only the first counts");
  }
}

bool only_draws(const XMLElement& element) {
  const std::string_view name(element.Name());
  return name == "visual" || name == "collision" || name == "material";
}

void check_urdf_numbers(const UrdfText& text, std::vector<std::string>& notes) {
  Undrawn undrawn;
  for (const char* tag : {"link", "joint"})
    for (const XMLElement* element : text.children(tag))
      check_numbers_below(text, *element, *element, undrawn);
  if (undrawn.count == 0) return;
  const std::string more =
      undrawn.count == 1 ? "" : ", and " + std::to_string(undrawn.count - 1) + " more like it";
  notes.push_back(undrawn.first + more + "; this only draws, and the robot moves as it would without");
}

void check_urdf_links(const UrdfText& text, bool accept_nonphysical_inertia,
                      std::vector<std::string>& notes) {
  for (const XMLElement* link : text.children("link")) {
    note_repeated(text, *link, {"inertial"}, notes);
    const XMLElement* inertial = link->FirstChildElement("inertial");
    if (!inertial) continue;
    note_repeated(text, *inertial, {"origin", "mass", "inertia"}, notes);
    const XMLElement& mass = required_child(text, *link, *inertial, "mass");
    const double m = required_number(text, *link, mass, "value");
    if (m < 0) text.fail(mass, describe(*link) + " has the mass " + digits(m) + " kg; expected zero or more");
    check_inertia_tensor(text, *link, required_child(text, *link, *inertial, "inertia"), m,
                         accept_nonphysical_inertia, notes);
  }
}

void check_urdf_encoding(const UrdfText& text) {
  check_document_type(text);
  check_encoding(text, text.robot());
  for (const char* tag : {"link", "joint"})
    for (const XMLElement* element : text.children(tag)) check_encoding(text, *element);
}

std::vector<std::string> check_urdf(const UrdfText& text, bool accept_nonphysical_inertia,
                                    bool follow_mimics) {
  std::vector<std::string> notes;
  check_urdf_encoding(text);
  check_urdf_is_expanded(text, notes);
  check_urdf_names(text);
  check_urdf_numbers(text, notes);
  check_urdf_tree(text);
  check_urdf_links(text, accept_nonphysical_inertia, notes);
  check_urdf_joints(text, follow_mimics, notes);
  return notes;
}

}  // namespace dyntape::dynamics
