// SPDX-License-Identifier: BSD-3-Clause
//
// C of an expression, for reading or for other programs.
//
//   CodeHandler<double> handler;
//   CppAD::vector<CG<double>> x(2);
//   handler.makeVariables(x);
//   CppAD::vector<CG<double>> J = f.Jacobian(x);                  // f: ADFun<CG<double>>
//   LanguageC<double> language("double");
//   LangCDefaultVariableNameGenerator<double> names;
//   handler.generateCode(std::cout, language, J, names);          // void name(const double x[2], double y[..]) { ... }
//
// The text is that of codegen/print/print_embedded.h: complete functions, whatever the generators of names say.
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
  void setGenerateFunction(const std::string& name) { name_ = name; }
  void setParameterPrecision(std::size_t) {}
  void setMaxAssignmentsPerFunction(std::size_t, void*) {}
  void setMaxOperationsPerAssignment(std::size_t) {}
  const std::string& type() const { return type_; }
  const std::string& name() const { return name_; }

 private:
  std::string type_, name_ = "generated";
};

template <class Base>
struct LangCDefaultVariableNameGenerator {
  LangCDefaultVariableNameGenerator(std::string = "y", std::string = "x", std::string = "v") {}
};

// In code_handler.cpp.
void print_recording(std::ostream& out, const std::vector<AD<double>>& y, const std::string& type,
                     const std::string& name);

template <class Base>
class CodeHandler {
 public:
  CodeHandler() = default;
  ~CodeHandler() {
    if (open_) CG<Base>::abort_recording();
  }
  CodeHandler(const CodeHandler&) = delete;
  CodeHandler& operator=(const CodeHandler&) = delete;

  template <class Vector>
  void makeVariables(Vector& x) {
    Independent(x);
    open_ = true;
  }
  template <class Vector>
  void generateCode(std::ostream& out, LanguageC<Base>& language, Vector& dependent,
                    LangCDefaultVariableNameGenerator<Base>&, const std::string& = "source") {
    open_ = false;
    print_recording(out, detail::entries_of(dependent), language.type(), language.name());
  }

 private:
  bool open_ = false;
};

}  // namespace CppAD::inline dyntape_names::cg
