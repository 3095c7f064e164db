// SPDX-License-Identifier: BSD-3-Clause
//
// Writes an expression as C, for other programs, or as a drawing or formulas, for reading.
//
//   CodeHandler<double> handler;
//   CppAD::vector<CG<double>> x(2);
//   handler.makeVariables(x);
//   CppAD::vector<CG<double>> J = f.Jacobian(x);                  // f: ADFun<CG<double>>
//   LanguageC<double> language("double");
//   LangCDefaultVariableNameGenerator<double> names;
//   handler.generateCode(std::cout, language, J, names);          // { ... y[0] = t3; ... }, the body of a function of yours
//
// generateCode() may be called several times; the recording lasts as long as the handler, or until the next
// recording of CG<double> begins.
//
// C is one block that reads x[] and writes y[]; LangCDefaultVariableNameGenerator("out", "in") renames them.
// After language.setGenerateFunction("name") the text is a complete function, as printed by
// codegen/print/print_embedded.h.  LanguageDot writes Graphviz's language, LanguageLatex one equation a line
// and LanguageMathML a page of HTML.
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

struct PrintedLanguage {
  enum Kind { kC, kDot, kLatex, kMathMl } kind = kC;
  std::string type{}, name{};                             // C: of its numbers; of its function, or empty
  std::map<std::string, std::string>* sources = nullptr;  // C: receives the function's file
  std::string open{}, close{};                            // formulas: around an equation; empty: the default
  std::string style{}, script{}, head{};                  // MathML: of the page
};

template <class Base>
class Language {
 public:
  const PrintedLanguage& printed() const { return printed_; }
  // Constants are exact, zeros are assigned, and files have the caller's name: without effect.
  void setParameterPrecision(std::size_t) {}
  void setIgnoreZeroDepAssign(bool) {}
  void setFilename(const std::string&) {}

 protected:
  explicit Language(PrintedLanguage printed) : printed_(std::move(printed)) {}
  PrintedLanguage printed_;
};

template <class Base>
class LanguageC : public Language<Base> {
 public:
  explicit LanguageC(std::string type, std::size_t = 3)
      : Language<Base>({.kind = PrintedLanguage::kC, .type = std::move(type)}) {}
  // Blocks declare their temporaries themselves.
  std::string generateTemporaryVariableDeclaration(bool = true, bool = false, const std::vector<int>& = {},
                                                   const std::vector<int>& = {}) const {
    return "";
  }
  void setGenerateFunction(const std::string& name) { this->printed_.name = name; }
  // A function is one file, which `sources` receives as well.
  void setMaxAssignmentsPerFunction(std::size_t, std::map<std::string, std::string>* sources) {
    this->printed_.sources = sources;
  }
  void setMaxOperationsPerAssignment(std::size_t) {}
};
template <class Base>
struct LanguageDot : Language<Base> {
  LanguageDot() : Language<Base>({.kind = PrintedLanguage::kDot}) {}
  void setCombineParameterNodes(bool) {}  // equal constants are one node
};
template <class Base>
struct LanguageLatex : Language<Base> {
  LanguageLatex() : Language<Base>({.kind = PrintedLanguage::kLatex}) {}
  void setEquationEnvironment(const std::string& begin, const std::string& end) {
    this->printed_.open = begin, this->printed_.close = end;
  }
};
template <class Base>
struct LanguageMathML : Language<Base> {
  LanguageMathML() : Language<Base>({.kind = PrintedLanguage::kMathMl}) {}
  void setEquationMarkup(const std::string& begin, const std::string& end) {
    this->printed_.open = begin, this->printed_.close = end;
  }
  const std::string& getStyle() const { return this->printed_.style; }
  void setStyle(const std::string& css) { this->printed_.style = css; }
  void setJavascript(const std::string& script) { this->printed_.script = script; }
  void setHeadExtraMarkup(const std::string& markup) { this->printed_.head = markup; }
  void setSaveVariableRelations(bool) {}
};

struct PrintedNames {
  std::string dependent = "y", independent = "x", temporary = "v";
};

template <class Base>
class VariableNameGenerator {
 public:
  explicit VariableNameGenerator(PrintedNames names) : names_(std::move(names)) {}
  const PrintedNames& names() const { return names_; }

 private:
  PrintedNames names_;
};
template <class Base>
struct LangCDefaultVariableNameGenerator : VariableNameGenerator<Base> {
  LangCDefaultVariableNameGenerator(std::string dependent = "y", std::string independent = "x",
                                    std::string temporary = "v")
      : VariableNameGenerator<Base>({std::move(dependent), std::move(independent), std::move(temporary)}) {}
};
template <class Base>
using LangLatexDefaultVariableNameGenerator = LangCDefaultVariableNameGenerator<Base>;
template <class Base>
using LangMathMLDefaultVariableNameGenerator = LangCDefaultVariableNameGenerator<Base>;

// In code_handler.cpp.  Returns how many values are used more than once, other than variables and results.
std::size_t print_recording(std::ostream& out, const std::vector<AD<double>>& y,
                            const PrintedLanguage& language, const PrintedNames& names);

template <class Base>
class CodeHandler {
 public:
  explicit CodeHandler(std::size_t /*expected operations*/ = 0) {}
  ~CodeHandler() {
    if (recording_ && recording_ == detail::open_recording<Base>()) CG<Base>::abort_recording();
  }
  CodeHandler(const CodeHandler&) = delete;
  CodeHandler& operator=(const CodeHandler&) = delete;

  template <class Vector>
  void makeVariables(Vector& x) {
    Independent(x);
    recording_ = detail::open_recording<Base>();
  }
  template <class Vector>
  void generateCode(std::ostream& out, Language<Base>& language, Vector& dependent,
                    VariableNameGenerator<Base>& names, const std::string& = "source") {
    temporaries_ = print_recording(out, detail::entries_of(dependent), language.printed(), names.names());
  }
  // Of the last generateCode(): values that are used more than once, other than variables and results.
  std::size_t getTemporaryVariableCount() const { return temporaries_; }
  std::size_t getTemporaryArraySize() const { return 0; }
  void setReuseVariableIDs(bool) {}

 private:
  std::uint32_t recording_ = 0;  // its serial number
  std::size_t temporaries_ = 0;
};

}  // namespace CppAD::inline dyntape_names::cg
