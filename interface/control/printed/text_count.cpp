// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/printed/text_count.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include <dyntape/autodiff/error.h>

namespace dyntape {

TextCount operator+(const TextCount& a, const TextCount& b) {
  return {a.operations + b.operations, a.loads + b.loads, a.stores + b.stores, a.turns + b.turns};
}

TextCount operator*(double times, const TextCount& a) {
  return {times * a.operations, times * a.loads, times * a.stores, times * a.turns};
}

namespace {

struct Token {
  std::string text;
  int line;
  bool is_name() const { return std::isalpha(static_cast<unsigned char>(text[0])) != 0 || text[0] == '_'; }
  bool is_number() const { return std::isdigit(static_cast<unsigned char>(text[0])) != 0; }
};
using Tokens = std::vector<Token>;

[[noreturn]] void fail(int line, const std::string& what) {
  throw ArgumentError("count of C text, line " + std::to_string(line) + ": " + what);
}

// Without comments and lines of the preprocessor, whose numbers and names are replaced.
class Reader {
 public:
  explicit Reader(const std::string& text, const std::map<std::string, double>& constants)
      : text_(text), constants_(constants) {}

  Tokens run() {
    while (at_ < text_.size()) step();
    return std::move(tokens_);
  }

 private:
  void step() {
    const char c = text_[at_];
    if (c == '\n') ++line_;
    if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      ++at_;
    } else if (text_.compare(at_, 2, "/*") == 0) {
      const std::size_t end = text_.find("*/", at_) + 2;
      line_ += int(std::count(text_.begin() + long(at_), text_.begin() + long(end), '\n'));
      at_ = end;
    } else if (c == '#') {
      define(directive());
    } else {
      append(next(text_, at_));
    }
  }

  std::string directive() {
    std::string line;
    for (; at_ < text_.size() && (text_[at_] != '\n' || line.ends_with('\\')); ++at_) {
      if (text_[at_] == '\n') ++line_, line.back() = ' ';
      line += text_[at_];
    }
    return line;
  }

  // "#define NAME tokens"; macros with arguments are left alone.
  void define(const std::string& line) {
    constexpr std::string_view kDefine = "#define ";
    if (!line.starts_with(kDefine)) return;
    std::size_t at = kDefine.size();
    const std::string name = next(line, at);
    if (at < line.size() && line[at] == '(') return;
    Tokens body;
    while (true) {
      while (at < line.size() && line[at] == ' ') ++at;
      if (at >= line.size() || line.compare(at, 2, "/*") == 0) break;
      body.push_back({next(line, at), line_});
    }
    const auto given = constants_.find(name);
    if (given != constants_.end()) body = {{std::to_string(long(given->second)), line_}};
    macros_[name] = std::move(body);
  }

  void append(const std::string& word) {
    const auto macro = macros_.find(word);
    if (macro == macros_.end()) {
      tokens_.push_back({word, line_});
      return;
    }
    for (const Token& token : macro->second) append(token.text);
  }

  static std::string next(const std::string& text, std::size_t& at) {
    const auto is_word = [&](std::size_t i) {
      return std::isalnum(static_cast<unsigned char>(text[i])) != 0 || text[i] == '_';
    };
    const std::size_t begin = at;
    if (std::isdigit(static_cast<unsigned char>(text[at])) != 0) {
      while (at < text.size() && (is_word(at) || text[at] == '.' ||
                                  ((text[at] == '-' || text[at] == '+') && text[at - 1] == 'e')))
        ++at;
    } else if (is_word(at)) {
      while (at < text.size() && is_word(at)) ++at;
    } else if (text[at] == '"') {
      at = text.find('"', at + 1) + 1;
    } else {
      static const std::set<std::string> kTwo = {
          "->", "++", "--", "+=", "-=", "*=", "/=", "<=", ">=", "==", "!=", "&&", "||", "<<", ">>"};
      at += kTwo.count(text.substr(at, 2)) != 0 ? 2 : 1;
    }
    return text.substr(begin, at - begin);
  }

  const std::string& text_;
  const std::map<std::string, double>& constants_;
  std::map<std::string, Tokens> macros_;
  Tokens tokens_;
  std::size_t at_ = 0;
  int line_ = 1;
};

using Values = std::map<std::string, long>;

// An integer of numbers, variables of loops, + - * and parentheses.
class Integer {
 public:
  Integer(const Tokens& tokens, const Values& values) : tokens_(tokens), values_(values) {}
  long value() {
    const auto known = this->known();
    if (!known) fault();
    return *known;
  }
  // None if it is not of constants.
  std::optional<long> known() {
    is_known_ = true, at_ = 0;
    const long sum = this->sum();
    return is_known_ && at_ == tokens_.size() ? std::optional(sum) : std::nullopt;
  }

 private:
  [[noreturn]] void fault() const {
    std::string text;
    for (const Token& token : tokens_) text += token.text + " ";
    fail(tokens_.empty() ? 0 : tokens_[0].line, "the bound " + text + "of a loop is not constant");
  }
  bool takes(const char* word) {
    if (at_ >= tokens_.size() || tokens_[at_].text != word) return false;
    ++at_;
    return true;
  }
  long sum() {
    long result = product();
    while (true) {
      if (takes("+"))
        result += product();
      else if (takes("-"))
        result -= product();
      else
        return result;
    }
  }
  long product() {
    long result = atom();
    while (takes("*")) result *= atom();
    return result;
  }
  long atom() {
    if (takes("(")) {
      const long inside = sum();
      is_known_ = takes(")") && is_known_;
      return inside;
    }
    if (at_ >= tokens_.size()) return is_known_ = false, 0;
    const Token& token = tokens_[at_++];
    if (token.is_number() && token.text.find_first_not_of("0123456789") == std::string::npos)
      return std::stol(token.text);
    const auto found = values_.find(token.text);
    is_known_ = found != values_.end() && is_known_;
    return found != values_.end() ? found->second : 0;
  }

  const Tokens& tokens_;
  const Values& values_;
  std::size_t at_ = 0;
  bool is_known_ = true;
};

struct CodePart {
  enum class Kind { kPlain, kConstant, kLoop, kBranch, kBlock } kind = Kind::kBlock;
  TextCount own;                 // of plain statements, and of conditions
  std::vector<CodePart> inside;  // of blocks; of loops one; of branches two
  std::string variable = {};
  Tokens first = {}, last = {};  // bounds; of a constant its value
  bool includes_last = false;
};

bool mentions_any(const Tokens& tokens, const std::set<std::string>& names) {
  return std::any_of(tokens.begin(), tokens.end(), [&](const Token& t) { return names.count(t.text) != 0; });
}

// Whether a bound of a loop follows from one of the names; constants that follow are added.
bool depends_on(const CodePart& part, std::set<std::string>& names) {
  if (part.kind == CodePart::Kind::kConstant) {
    if (mentions_any(part.first, names)) names.insert(part.variable);
    return false;
  }
  if (mentions_any(part.first, names) || mentions_any(part.last, names)) return true;
  return std::any_of(part.inside.begin(), part.inside.end(),
                     [&](const CodePart& p) { return depends_on(p, names); });
}

TextCount total(const CodePart& part, Values& values) {
  if (part.kind == CodePart::Kind::kConstant) {
    if (const auto value = Integer(part.first, values).known()) values[part.variable] = *value;
    return part.own;
  }
  if (part.kind == CodePart::Kind::kBranch) {
    const TextCount a = total(part.inside[0], values), b = total(part.inside[1], values);
    return part.own + (a.sum() >= b.sum() ? a : b);
  }
  if (part.kind != CodePart::Kind::kLoop) {
    TextCount sum = part.own;
    for (const CodePart& inside : part.inside) sum = sum + total(inside, values);
    return sum;
  }
  const long first = Integer(part.first, values).value();
  const long last = Integer(part.last, values).value() + (part.includes_last ? 1 : 0);
  const double turns = double(std::max(last - first, 0L));
  TextCount sum = {.operations = 1, .turns = turns};
  std::set<std::string> names = {part.variable};
  if (!depends_on(part.inside[0], names)) {
    values[part.variable] = first;
    sum = sum + turns * total(part.inside[0], values);
  } else {
    for (long i = first; i < last; ++i) values[part.variable] = i, sum = sum + total(part.inside[0], values);
  }
  values.erase(part.variable);
  return sum;
}

class Parser {
 public:
  Parser(const Tokens& tokens, const std::map<std::string, TextCount>& functions)
      : tokens_(tokens), functions_(functions) {}

  // The block that begins at a brace; `at` then is behind it.
  CodePart block(std::size_t& at) {
    CodePart result;
    expect(at, "{");
    while (tokens_.at(at).text != "}") result.inside.push_back(statement(at));
    ++at;
    return result;
  }

 private:
  void expect(std::size_t& at, const char* word) const {
    if (tokens_.at(at).text != word)
      fail(tokens_[at].line, std::string("expected ") + word + ", got " + tokens_[at].text);
    ++at;
  }

  CodePart statement(std::size_t& at) {
    const std::string& word = tokens_.at(at).text;
    if (word == "{") return block(at);
    if (word == "for") return loop(at);
    if (word == "if") return branch(at);
    if (word == "while" || word == "do" || word == "goto" || word == "switch")
      fail(tokens_[at].line, "\"" + word + "\" has no bound; expected a for loop");
    return plain(at);
  }

  Tokens until(std::size_t& at, const char* end) const {
    Tokens result;
    int depth = 0;
    while (depth > 0 || tokens_.at(at).text != end) {
      if (tokens_[at].text == "(" || tokens_[at].text == "{") ++depth;
      if (tokens_[at].text == ")" || tokens_[at].text == "}") --depth;
      result.push_back(tokens_[at++]);
    }
    ++at;
    return result;
  }

  CodePart loop(std::size_t& at) {
    const int line = tokens_[at].line;
    CodePart result{.kind = CodePart::Kind::kLoop, .own = {}, .inside = {}};
    expect(++at, "(");
    Tokens begin = until(at, ";");
    const Tokens condition = until(at, ";"), step = until(at, ")");
    if (!begin.empty() && begin[0].text == "int") begin.erase(begin.begin());
    const bool is_usual = begin.size() >= 3 && begin[1].text == "=" && condition.size() >= 3 &&
                          condition[0].text == begin[0].text &&
                          (condition[1].text == "<" || condition[1].text == "<=") && step.size() == 2 &&
                          step[0].text == "++" && step[1].text == begin[0].text;
    if (!is_usual) fail(line, "expected a loop for (i = FIRST; i < LAST; ++i)");
    result.variable = begin[0].text;
    result.first.assign(begin.begin() + 2, begin.end());
    result.last.assign(condition.begin() + 2, condition.end());
    result.includes_last = condition[1].text == "<=";
    result.inside.push_back(statement(at));
    return result;
  }

  CodePart branch(std::size_t& at) {
    CodePart result{.kind = CodePart::Kind::kBranch, .own = {}, .inside = {}};
    expect(++at, "(");
    result.own = expression(until(at, ")")) + TextCount{.turns = 1};
    result.inside.push_back(statement(at));
    result.inside.emplace_back();
    if (at < tokens_.size() && tokens_[at].text == "else") result.inside.back() = statement(++at);
    return result;
  }

  CodePart plain(std::size_t& at) {
    const Tokens all = until(at, ";");
    CodePart result{.kind = CodePart::Kind::kPlain, .own = {}, .inside = {}};
    if (is_constant(all)) {
      result.kind = CodePart::Kind::kConstant;
      result.variable = all[2].text;
      result.first.assign(all.begin() + 4, all.end());
      result.own = expression(result.first);
      return result;
    }
    int depth = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::string& word = all[i].text;
      if (word == "(" || word == "[") ++depth;
      if (word == ")" || word == "]") --depth;
      const bool is_compound = word.size() == 2 && word[1] == '=' && std::string("+-*/").find(word[0]) < 4;
      if (depth == 0 && (word == "=" || is_compound)) {
        result.own = assignment({all.begin(), all.begin() + long(i)}, {all.begin() + long(i) + 1, all.end()},
                                is_compound);
        return result;
      }
    }
    result.own = expression(all);
    return result;
  }

  // "const int k = ...", which bounds of loops may use.
  static bool is_constant(const Tokens& all) {
    return all.size() > 4 && all[0].text == "const" && all[1].text == "int" && all[3].text == "=";
  }

  TextCount assignment(const Tokens& to, const Tokens& value, bool is_compound) const {
    TextCount left = expression(to), result = expression(value);
    const bool is_memory = left.loads > 0 || to[0].text == "*";
    if (left.loads > 0) left.loads -= 1;
    if (is_memory) left.stores += 1;
    if (is_memory && is_compound) left.loads += 1;
    if (is_compound) left.operations += 1;
    return result + left;
  }

  // Reads of an array or member count once, and the arithmetic of all but one index.
  TextCount expression(const Tokens& all) const {
    static const std::set<std::string> kOperators = {"+", "-", "*",  "/",  "%",  "<",  ">", "<=", ">=", "==",
                                                     "!", "?", "!=", "&&", "||", "<<", "&", "|",  "^",  ">>"};
    TextCount sum;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Token& token = all[i];
      const bool is_called = token.is_name() && i + 1 < all.size() && all[i + 1].text == "(";
      if (kOperators.count(token.text) != 0) sum.operations += 1;
      if (token.text == "[" || token.text == "->" || token.text == ".") {
        const bool is_first = i > 0 && all[i - 1].is_name() && !(i > 1 && is_access(all[i - 2]));
        (is_first ? sum.loads : sum.operations) += 1;
      }
      if (is_called && token.text != "return" && token.text != "sizeof") sum = sum + call(token);
    }
    return sum;
  }

  static bool is_access(const Token& token) { return token.text == "->" || token.text == "."; }

  TextCount call(const Token& token) const {
    static const std::set<std::string> kPlainCalls = {"dt_select", "fabs", "__attribute__"};
    if (kPlainCalls.count(token.text) != 0) return {.operations = 2};
    const auto found = functions_.find(token.text == "sqrt" ? "dt_root" : token.text);
    if (found == functions_.end())
      fail(token.line, "the function \"" + token.text + "\" is not in the text before its call");
    return found->second + TextCount{.turns = 2};
  }

  const Tokens& tokens_;
  const std::map<std::string, TextCount>& functions_;
};

// Sine and cosine of the printers (codegen/print/own_trig.h), with the reduction of large arguments: counted by hand, since
// their loops count down.
const std::map<std::string, TextCount>& sines() {
  constexpr TextCount kSine = {.operations = 260, .loads = 60, .stores = 40, .turns = 30};
  static const std::map<std::string, TextCount> all = {{"sin", kSine}, {"cos", kSine}};
  return all;
}

bool is_of_sines(const std::string& name) {
  static const std::set<std::string> kNames = {"dt_product", "dt_reduce_any", "dt_reduce_few",
                                               "dt_less",    "dt_reduce",     "dt_circular"};
  return kNames.count(name) != 0;
}

}  // namespace

CountedText::CountedText(const std::string& text, const std::map<std::string, double>& constants)
    : functions_(sines()) {
  const Tokens tokens = Reader(text, constants).run();
  int depth = 0;
  std::size_t open = 0;  // the last parenthesis at the outermost level
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const std::string& word = tokens[i].text;
    if (word == "(" && depth == 0) open = i;
    const bool is_body = word == "{" && depth == 0 && i > 0 && tokens[i - 1].text == ")" && open > 0;
    if (is_body) {
      const std::string name = tokens[open - 1].text;
      Values values;
      if (is_of_sines(name)) {
        for (int inside = 0; i < tokens.size(); ++i) {
          inside += tokens[i].text == "{" ? 1 : tokens[i].text == "}" ? -1 : 0;
          if (inside == 0) break;
        }
        continue;
      }
      const CodePart body = Parser(tokens, functions_).block(i);
      functions_[name] = total(body, values);
      --i;
      continue;
    }
    if (word == "(" || word == "{" || word == "[") ++depth;
    if (word == ")" || word == "}" || word == "]") --depth;
  }
}

TextCount CountedText::of(const std::string& function) const {
  const auto found = functions_.find(function);
  if (found == functions_.end())
    throw ArgumentError("count of C text: there is no function \"" + function + "\"");
  return found->second;
}

}  // namespace dyntape
