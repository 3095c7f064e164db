// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/text.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include <dyntape/autodiff/error.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> result;
  for (size_t begin = text.find_first_not_of(kBlanks); begin != text.npos;) {
    const size_t end = std::min(text.find_first_of(kBlanks, begin), text.size());
    result.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kBlanks, end);
  }
  return result;
}

// What is wrong with the word as a finite number, or nothing; the number goes to `value`.
std::string read_number(std::string_view word, double& value) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';  // from_chars knows no leading '+'
  const char* begin = word.data() + (plus ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error == std::errc::result_out_of_range) return "is out of the range of a double";
  if (error != std::errc() || stop != end) return "is not a number";
  if (!std::isfinite(value)) return "is not a finite number";
  return "";
}

// Of the element that its parser names: "XMLElement name=link".
std::string unclosed(const tinyxml2::XMLDocument& document) {
  const std::string said = document.ErrorStr() ? document.ErrorStr() : "";
  const std::size_t at = said.rfind("name=");
  return at == std::string::npos ? "an element" : "<" + one_line(said.substr(at + 5)) + ">";
}

std::string xml_problem(const tinyxml2::XMLDocument& document) {
  switch (document.ErrorID()) {
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT:
      return "the file is empty; expected a <robot> element";
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT:
      return "not well-formed XML: " + unclosed(document) + " is closed by another name, or not at all";
    case tinyxml2::XML_ERROR_PARSING:
      return "not well-formed XML: the file ends before the element that begins here is closed";
    case tinyxml2::XML_ERROR_PARSING_COMMENT:
      return "not well-formed XML: the file ends before the comment that begins here is closed";
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
      return "elements are nested too deeply for a URDF file";
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE:
      return "not well-formed XML: an attribute must read name=\"value\"";
    default:
      return std::string("not well-formed XML (") + document.ErrorName() + ")";
  }
}

// Of files that are no XML, in words for whoever gave the wrong one.
void check_is_xml(std::string_view contents, const std::string& file) {
  if (contents.starts_with("\xEF\xBB\xBF")) contents.remove_prefix(3);
  const size_t first = contents.find_first_not_of(kBlanks);
  if (first == contents.npos || contents[first] == '<') return;
  if (file.ends_with(".info"))
    throw FileError(
        file +
        ": this is an .info file, not a URDF; expected a robot, a file that begins with <; tasks are "
        "for dyntape solve and dyntape check-config");
  throw FileError(file + ":1: this is not XML; expected a URDF file, which begins with <, got \"" +
                  one_line(std::string(contents.substr(first, 1))) + "\"");
}

// Other descriptions of robots by their root elements.
std::string kind_of_root(std::string_view root) {
  if (root == "sdf") return ", an SDF file (of Gazebo)";
  if (root == "mujoco") return ", an MJCF file (of MuJoCo)";
  if (root == "COLLADA") return ", a COLLADA mesh";
  return "";
}

std::string where_else(std::string_view root) {
  return root == "sdf" || root == "mujoco" ? ", as the PyPI package robot_descriptions has it of many robots "
                                             "that are described in other formats"
                                           : "";
}

}  // namespace

UrdfText::UrdfText(std::unique_ptr<tinyxml2::XMLDocument> document, std::string file)
    : document_(std::move(document)), file_(std::move(file)) {
  for (const XMLElement* link : children("link"))
    if (const char* name = link->Attribute("name")) links_.emplace(name, link);
  for (const XMLElement* joint : children("joint"))
    if (const char* name = joint->Attribute("name")) joints_.emplace(name, joint);
}

std::vector<const XMLElement*> UrdfText::children(const char* tag) const {
  std::vector<const XMLElement*> result;
  for (auto* e = robot().FirstChildElement(tag); e; e = e->NextSiblingElement(tag)) result.push_back(e);
  return result;
}

const XMLElement* UrdfText::find_link(const std::string& name) const {
  const auto found = links_.find(name);
  return found == links_.end() ? nullptr : found->second;
}

const XMLElement* UrdfText::find_joint(const std::string& name) const {
  const auto found = joints_.find(name);
  return found == joints_.end() ? nullptr : found->second;
}

std::string UrdfText::where(const XMLElement& element) const {
  return file_ + ":" + std::to_string(element.GetLineNum()) + ": ";
}

void UrdfText::fail(const XMLElement& element, const std::string& sentence) const {
  throw FileError(where(element) + sentence);
}

std::optional<double> UrdfText::number(const XMLElement& element, const char* attribute) const {
  const auto values = numbers(element, attribute, 1);
  if (!values) return std::nullopt;
  return values->front();
}

std::optional<std::vector<double>> UrdfText::numbers(const XMLElement& element, const char* attribute,
                                                     int count) const {
  const char* text = element.Attribute(attribute);
  if (!text) return std::nullopt;
  const std::string what = std::string("<") + element.Name() + " " + attribute + "=\"" + text + "\">";
  const auto found = words(text);
  std::vector<double> values;
  for (std::string_view word : found) {
    const std::string problem = read_number(word, values.emplace_back());
    if (!problem.empty()) fail(element, what + ": \"" + std::string(word) + "\" " + problem);
  }
  if (values.size() != static_cast<size_t>(count))
    fail(element, what + ": expected " + std::to_string(count) + (count == 1 ? " number" : " numbers") +
                      " separated by blanks, got " + std::to_string(values.size()));
  return values;
}

Eigen::Vector3d UrdfText::vector_below(const XMLElement& element, const char* tag, const char* attribute,
                                       const Eigen::Vector3d& otherwise) const {
  const XMLElement* child = element.FirstChildElement(tag);
  if (!child) return otherwise;
  const auto values = numbers(*child, attribute, 3);
  return values ? Eigen::Vector3d((*values)[0], (*values)[1], (*values)[2]) : otherwise;
}

UrdfText parse_urdf_text(const std::string& contents, const std::string& file) {
  if (contents.find('\0') != contents.npos)
    throw FileError(file + ": contains a zero byte; expected a URDF text file");
  check_is_xml(contents, file);
  auto document = std::make_unique<tinyxml2::XMLDocument>();
  if (document->Parse(contents.c_str(), contents.size()) != tinyxml2::XML_SUCCESS)
    throw FileError(file + ":" + std::to_string(std::max(1, document->ErrorLineNum())) + ": " +
                    xml_problem(*document));
  const XMLElement* root = document->RootElement();
  if (!root) throw FileError(file + ":1: the file holds no element; expected <robot>");
  if (std::string_view(root->Name()) != "robot")
    throw FileError(file + ":" + std::to_string(root->GetLineNum()) + ": the root element is <" +
                    root->Name() + ">" + kind_of_root(root->Name()) + "; expected <robot>, a URDF file" +
                    where_else(root->Name()));
  return UrdfText(std::move(document), file);
}

std::string describe(const XMLElement& element) {
  const char* name = element.Attribute("name");
  return one_line(element.Name()) + (name ? " \"" + one_line(name) + "\"" : "");
}

std::string digits(double x) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, x, std::chars_format::general, 4).ptr;
  return std::string(buffer, end);
}

}  // namespace dyntape::dynamics
