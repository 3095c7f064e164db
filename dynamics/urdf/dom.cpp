// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/dom.h>

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <mutex>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/check.h>

namespace dyntape::dynamics {
namespace {

struct Message {
  std::string text;
  bool is_error;
};

// While one lives, urdfdom's logger writes here.
class CapturedConsole : public console_bridge::OutputHandler {
 public:
  CapturedConsole() : level_(console_bridge::getLogLevel()) {
    console_bridge::useOutputHandler(this);
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_WARN);
  }
  ~CapturedConsole() override {
    console_bridge::setLogLevel(level_);
    console_bridge::restorePreviousOutputHandler();
  }
  CapturedConsole(const CapturedConsole&) = delete;
  CapturedConsole& operator=(const CapturedConsole&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    messages.push_back({text, level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR});
  }

  std::vector<Message> messages;

 private:
  console_bridge::LogLevel level_;
};

bool mentions(const std::string& message, const std::string& name) {
  const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  for (size_t at = message.find(name); at != message.npos; at = message.find(name, at + 1)) {
    const size_t end = at + name.size();
    if ((at == 0 || !is_word(message[at - 1])) && (end == message.size() || !is_word(message[end])))
      return true;
  }
  return false;
}

// "  1 \n 2 " -> "1 2": urdfdom's parser of numbers stumbles over the blanks that XML leaves.
std::string with_single_blanks(const std::string& text) {
  std::string words;
  for (const char c : text) {
    const bool is_blank = c == ' ' || c == '\t' || c == '\n' || c == '\r';
    if (!is_blank) words += c;
    if (is_blank && !words.empty() && words.back() != ' ') words += ' ';
  }
  if (!words.empty() && words.back() == ' ') words.pop_back();
  return words;
}

// Names are kept as they are, but for tabs and line breaks, which XML reads as blanks.
void tidy_blanks(tinyxml2::XMLElement& element) {
  for (auto* a = element.FirstAttribute(); a; a = a->Next()) {
    const std::string_view name(a->Name());
    std::string value = a->Value();
    if (name == "name" || name == "link" || name == "joint" || name == "type") {
      std::replace_if(
          value.begin(), value.end(), [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
    } else {
      value = with_single_blanks(value);
    }
    element.SetAttribute(a->Name(), value.c_str());
  }
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    tidy_blanks(*child);
}

void remove_drawings(tinyxml2::XMLElement& element) {
  for (auto* child = element.FirstChildElement(); child;) {
    auto* next = child->NextSiblingElement();
    if (only_draws(*child)) element.DeleteChild(child);
    child = next;
  }
}

// Links and joints without what only draws, which this library reads by itself.
std::string for_urdfdom(const std::string& contents) {
  tinyxml2::XMLDocument document;
  if (document.Parse(contents.c_str(), contents.size()) != tinyxml2::XML_SUCCESS) return contents;
  tinyxml2::XMLElement& robot = *document.RootElement();
  remove_drawings(robot);
  for (auto* link = robot.FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
    remove_drawings(*link);
  tidy_blanks(robot);
  tinyxml2::XMLPrinter printer(nullptr, true);
  document.Print(&printer);
  return printer.CStr();
}

// The element that a message speaks of: urdfdom names links and joints but no position.
const tinyxml2::XMLElement& subject(const std::string& message, const UrdfText& text) {
  const tinyxml2::XMLElement* best = &text.robot();
  size_t longest = 0;
  for (const char* tag : {"joint", "link", "material"}) {
    for (const tinyxml2::XMLElement* element : text.children(tag)) {
      const char* name = element->Attribute("name");
      const size_t length = name ? std::string(name).size() : 0;
      if (length > longest && mentions(message, name)) longest = length, best = element;
    }
  }
  return *best;
}

std::string joined(const std::vector<Message>& messages) {
  std::string all;
  for (const Message& m : messages)
    if (m.is_error) all += (all.empty() ? "" : "; ") + m.text;
  return all;
}

}  // namespace

UrdfDom read_with_urdfdom(const std::string& contents, const UrdfText& text, const std::string& file) {
  static std::mutex mutex;
  UrdfDom dom;
  std::vector<Message> messages;
  {
    const std::lock_guard lock(mutex);
    CapturedConsole console;
    try {
      dom.model = urdf::parseURDF(for_urdfdom(contents));
    } catch (const std::exception& e) {
      console.messages.push_back({e.what(), true});
    }
    messages = std::move(console.messages);
  }
  if (const std::string errors = joined(messages); !errors.empty())
    text.fail(subject(errors, text), "urdfdom says: " + errors);
  if (!dom.model) throw FileError(file + ": urdfdom could not read the file and does not say why");
  for (const Message& m : messages)
    dom.notes.push_back(text.where(subject(m.text, text)) + "urdfdom says: " + m.text);
  return dom;
}

}  // namespace dyntape::dynamics
