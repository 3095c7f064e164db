// SPDX-License-Identifier: BSD-3-Clause
//
// The text of a URDF file with line numbers, which urdfdom does not give.
//
//   UrdfText text = parse_urdf_text(contents, "arm.urdf");     // FileError if not well formed XML
//   for (const XMLElement* link : text.children("link")) ...
//   text.fail(element, "link \"arm\" has no name");            // throws FileError "arm.urdf:12: link ..."
//
// Numbers are read strictly (the whole attribute, finite, the right count), independent of the locale.
#pragma once

#include <tinyxml2.h>

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace dyntape::dynamics {

class UrdfText {
 public:
  UrdfText(std::unique_ptr<tinyxml2::XMLDocument> document, std::string file);

  const tinyxml2::XMLElement& robot() const { return *document_->RootElement(); }

  // Elements <tag> directly below <robot>, in file order.
  std::vector<const tinyxml2::XMLElement*> children(const char* tag) const;
  // The first link or joint of this name, or nullptr.
  const tinyxml2::XMLElement* find_link(const std::string& name) const;
  const tinyxml2::XMLElement* find_joint(const std::string& name) const;

  // "file:line: "
  std::string where(const tinyxml2::XMLElement& element) const;
  [[noreturn]] void fail(const tinyxml2::XMLElement& element, const std::string& sentence) const;

  // One finite number; nullopt if the attribute is absent.
  std::optional<double> number(const tinyxml2::XMLElement& element, const char* attribute) const;
  // `count` finite numbers separated by blanks; nullopt if the attribute is absent.
  std::optional<std::vector<double>> numbers(const tinyxml2::XMLElement& element, const char* attribute,
                                             int count) const;
  // Three numbers of <tag attribute="x y z"> below `element`; `otherwise` if tag or attribute is absent.
  Eigen::Vector3d vector_below(const tinyxml2::XMLElement& element, const char* tag, const char* attribute,
                               const Eigen::Vector3d& otherwise) const;

 private:
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  std::string file_;
  std::map<std::string, const tinyxml2::XMLElement*> links_, joints_;
};

// Parses well-formed XML with root <robot>; FileError with the line otherwise.
UrdfText parse_urdf_text(const std::string& contents, const std::string& file);

// `link "arm"`, or `link` if it has no name.
std::string describe(const tinyxml2::XMLElement& element);

// A number for a message: four significant digits, independent of the locale.
std::string digits(double x);

}  // namespace dyntape::dynamics
