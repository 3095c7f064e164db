// SPDX-License-Identifier: BSD-3-Clause
//
// Writes an expression as C, for reading or for other programs.
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
// The text is one block that reads x[] and writes y[]; LangCDefaultVariableNameGenerator("out", "in") renames them.
// After language.setGenerateFunction("name") the text is a complete function, as printed by
// codegen/print/print_embedded.h.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

template <class Base>
class LanguageC {
 public:
  explicit LanguageC(std::string type, std::size_t = 3) : type_(std::move(type)) {}
  // Blocks declare their temporaries themselves.
  std::string generateTemporaryVariableDeclaration(bool = true, bool = false, const std::vector<int>& = {},
                                                   const std::vector<int>& = {}) const {
    return "";
  }
  void setGenerateFunction(const std::string& name) { name_ = name; }
  void setParameterPrecision(std::size_t) {}
  void setMaxAssignmentsPerFunction(std::size_t, void*) {}
  void setMaxOperationsPerAssignment(std::size_t) {}
  const std::string& type() const { return type_; }
  const std::string& name() const { return name_; }

 private:
  std::string type_, name_;
};

struct PrintedNames {
  std::string dependent = "y", independent = "x";
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
                                    const std::string& /*temporary*/ = "v")
      : VariableNameGenerator<Base>({std::move(dependent), std::move(independent)}) {}
};

// In code_handler.cpp.
void print_recording(std::ostream& out, const std::vector<AD<double>>& y, const std::string& type,
                     const std::string& name, const PrintedNames& names);

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
  void generateCode(std::ostream& out, LanguageC<Base>& language, Vector& dependent,
                    VariableNameGenerator<Base>& names, const std::string& = "source") {
    print_recording(out, detail::entries_of(dependent), language.type(), language.name(), names.names());
  }

 private:
  std::uint32_t recording_ = 0;  // its serial number
};

}  // namespace CppAD::inline dyntape_names::cg
