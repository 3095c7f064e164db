// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/formulas.h>

#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include <dyntape/autodiff/graph/callee.h>

namespace dyntape {
namespace {

// How tightly a formula binds.  An argument that binds less than its position needs has brackets.
enum Tightness { kRelation, kSum, kProduct, kPower, kAtom };

struct Form {
  Op op;
  Tightness tightness;
  Tightness needs[3];
  const char *latex, *mathml;  // $0 $1 $2: the arguments
};

constexpr Form kForms[] = {
    {Op::Add, kSum, {kSum, kSum}, "$0 + $1", "$0<mo>+</mo>$1"},
    {Op::Sub, kSum, {kSum, kProduct}, "$0 - $1", "$0<mo>-</mo>$1"},
    {Op::Mul, kProduct, {kProduct, kProduct}, "$0 \\cdot $1", "$0<mo>&#x22C5;</mo>$1"},
    {Op::Azmul, kProduct, {kProduct, kProduct}, "$0 \\cdot $1", "$0<mo>&#x22C5;</mo>$1"},
    {Op::Div, kAtom, {}, "\\frac{$0}{$1}", "<mfrac>$0$1</mfrac>"},
    {Op::Neg, kSum, {kProduct}, "-$0", "<mo>-</mo>$0"},
    {Op::Fma, kSum, {kProduct, kProduct, kSum}, "$0 \\cdot $1 + $2", "$0<mo>&#x22C5;</mo>$1<mo>+</mo>$2"},
    {Op::Fms, kSum, {kProduct, kProduct, kProduct}, "$0 \\cdot $1 - $2", "$0<mo>&#x22C5;</mo>$1<mo>-</mo>$2"},
    {Op::Fnma, kSum, {kProduct, kProduct, kSum}, "$2 - $0 \\cdot $1", "$2<mo>-</mo>$0<mo>&#x22C5;</mo>$1"},
    {Op::Fnms,
     kSum,
     {kProduct, kProduct, kProduct},
     "-$0 \\cdot $1 - $2",
     "<mo>-</mo>$0<mo>&#x22C5;</mo>$1<mo>-</mo>$2"},
    {Op::Sqrt, kAtom, {}, "\\sqrt{$0}", "<msqrt>$0</msqrt>"},
    {Op::Cbrt, kAtom, {}, "\\sqrt[3]{$0}", "<mroot>$0<mn>3</mn></mroot>"},
    {Op::Pow, kPower, {kAtom}, "{$0}^{$1}", "<msup>$0$1</msup>"},
    {Op::Exp, kPower, {}, "e^{$0}", "<msup><mi>e</mi>$0</msup>"},
    {Op::Exp2, kPower, {}, "2^{$0}", "<msup><mn>2</mn>$0</msup>"},
    {Op::Abs, kAtom, {}, "\\left|$0\\right|", "<mo>|</mo>$0<mo>|</mo>"},
    {Op::Floor, kAtom, {}, "\\left\\lfloor $0\\right\\rfloor", "<mo>&#x230A;</mo>$0<mo>&#x230B;</mo>"},
    {Op::Ceil, kAtom, {}, "\\left\\lceil $0\\right\\rceil", "<mo>&#x2308;</mo>$0<mo>&#x2309;</mo>"},
    {Op::Lt, kRelation, {kSum, kSum}, "$0 < $1", "$0<mo>&lt;</mo>$1"},
    {Op::Le, kRelation, {kSum, kSum}, "$0 \\le $1", "$0<mo>&#x2264;</mo>$1"},
    {Op::Eq, kRelation, {kSum, kSum}, "$0 = $1", "$0<mo>=</mo>$1"},
    {Op::Ne, kRelation, {kSum, kSum}, "$0 \\ne $1", "$0<mo>&#x2260;</mo>$1"},
    {Op::Select,
     kAtom,
     {},
     "\\begin{cases} $1 & \\text{if } $0 \\\\ $2 & \\text{otherwise} \\end{cases}",
     "<mo>{</mo><mtable><mtr><mtd>$1</mtd><mtd><mtext>if&#xA0;</mtext>$0</mtd></mtr>"
     "<mtr><mtd>$2</mtd><mtd><mtext>otherwise</mtext></mtd></mtr></mtable>"},
};

// Syntax of the two languages.
struct Notation {
  bool latex;

  std::string number(double value) const {
    char text[40];
    std::string digits(text, std::to_chars(text, text + sizeof text, value).ptr);
    if (std::isinf(value)) digits = std::string(value < 0 ? "-" : "") + (latex ? "\\infty" : "&#x221E;");
    if (!latex) return "<mn>" + digits + "</mn>";
    const std::size_t e = std::isfinite(value) ? digits.find('e') : std::string::npos;
    if (e == std::string::npos) return digits;
    return digits.substr(0, e) + " \\cdot 10^{" + std::to_string(std::stoi(digits.substr(e + 1))) + "}";
  }
  std::string indexed(const std::string& text, std::size_t i) const {
    const std::string index = std::to_string(i);
    return latex ? text + "_{" + index + "}" : "<msub>" + text + "<mn>" + index + "</mn></msub>";
  }
  std::string letter(const std::string& letter, std::size_t i) const {
    return indexed(latex ? letter : "<mi>" + letter + "</mi>", i);
  }
  std::string bracketed(const std::string& text) const {
    return latex ? "\\left(" + text + "\\right)" : "<mo>(</mo>" + text + "<mo>)</mo>";
  }
  // An argument: one element.
  std::string grouped(const std::string& text) const { return latex ? text : "<mrow>" + text + "</mrow>"; }
  std::string named(const std::string& name) const {
    std::string text;
    for (char c : name) {
      if (latex && std::string_view("_%&#${}").find(c) != std::string_view::npos) text += '\\';
      text += latex || (c != '&' && c != '<') ? std::string(1, c) : c == '&' ? "&amp;" : "&lt;";
    }
    return latex ? "\\operatorname{" + text + "}" : "<mi>" + text + "</mi>";
  }
  const char* comma() const { return latex ? ", " : "<mo>,</mo>"; }
  const char* equals() const { return latex ? " = " : "<mo>=</mo>"; }
  const char* not_zero() const { return latex ? " \\ne 0" : "<mo>&#x2260;</mo><mn>0</mn>"; }
};

struct Formula {
  std::string text;
  Tightness tightness = kAtom;
};

// How often a value is used, by others and as an output.
struct Uses {
  explicit Uses(const Function& f) : by_values(f.graph.size()), is_output(f.graph.size()) {
    for (NodeId id = 0; id < f.graph.size(); ++id)
      f.graph.for_each_argument(id, [&](NodeId a) { ++by_values[a]; });
    for (NodeId id : f.outputs) is_output[id] = 1;
  }
  std::vector<std::uint32_t> by_values;
  std::vector<std::uint8_t> is_output;
};

bool is_leaf(Op op) { return op == Op::Const || op == Op::Input; }

class Printer {
 public:
  Printer(const Function& f, Notation notation, FormulaStyle style)
      : f_(f), notation_(notation), style_(std::move(style)), uses_(f), formulas_(f.graph.size()) {}

  std::string print() {
    for (NodeId id = 0; id < f_.graph.size(); ++id) {
      formulas_[id] = formula(id);
      if (!is_leaf(f_.graph[id].op) && has_equation(id)) {
        const std::string name = notation_.letter(style_.shared, n_shared_++);
        equation(name, formulas_[id]);
        formulas_[id] = {name, kAtom};
      }
    }
    for (std::size_t i = 0; i < f_.outputs.size(); ++i)
      equation(notation_.letter(style_.output, i), formulas_[f_.outputs[i]]);
    return std::move(out_);
  }

 private:
  static constexpr std::size_t kLongest = 1000;  // characters of a formula within another one

  bool has_equation(NodeId id) const {
    return uses_.by_values[id] + uses_.is_output[id] > 1 || f_.graph[id].op == Op::Call ||
           (formulas_[id].text.size() > kLongest && uses_.by_values[id]);
  }
  void equation(const std::string& name, const Formula& f) {
    out_ += style_.open + name + notation_.equals() + within(f, kSum) + style_.close + "\n";
  }
  std::string within(const Formula& f, Tightness needs) const {
    return f.tightness < needs ? notation_.bracketed(f.text) : f.text;
  }
  std::string argument(NodeId id, Tightness needs) const {
    return notation_.grouped(within(formulas_[id], needs));
  }
  Formula formula(NodeId id) const {
    const Node& node = f_.graph[id];
    if (node.op == Op::Const) {
      const double value = f_.graph.constant_value(id);
      const std::string text = notation_.number(value);
      return {text, std::signbit(value) ? kSum : text.find("cdot") != std::string::npos ? kProduct : kAtom};
    }
    if (node.op == Op::Input) {
      const auto& names = f_.input_names[node.a];
      if (node.b < names.size()) return {notation_.named(names[node.b])};
      return {notation_.letter(node.a == 0 ? style_.input : node.a == 1 ? "p" : "w", node.b)};
    }
    if (node.op == Op::Result) return {notation_.indexed(argument(node.a, kAtom), node.b)};
    for (const Form& form : kForms) {
      if (form.op == node.op) return {filled(id, form), form.tightness};
    }
    return {call(id)};
  }
  std::string filled(NodeId id, const Form& form) const {
    NodeId arguments[3] = {};
    int n = 0;
    f_.graph.for_each_argument(id, [&](NodeId a) { arguments[n++] = a; });
    if (form.op == Op::Mul && f_.graph.is_constant(arguments[1])) std::swap(arguments[0], arguments[1]);
    std::string text;
    for (const char* c = notation_.latex ? form.latex : form.mathml; *c; ++c) {
      if (*c != '$') {
        text += *c;
        continue;
      }
      const int i = *++c - '0';
      text += argument(arguments[i], form.needs[i]);
      if (form.op == Op::Select && i == 0 && formulas_[arguments[0]].tightness != kRelation)
        text += notation_.not_zero();
    }
    return text;
  }
  std::string call(NodeId id) const {
    const Node& node = f_.graph[id];
    std::string arguments;
    f_.graph.for_each_argument(id, [&](NodeId a) {
      arguments += (arguments.empty() ? "" : notation_.comma()) + argument(a, kRelation);
    });
    const std::string name =
        node.op == Op::Call ? f_.graph.callees()[node.a]->name : std::string(info(node.op).function);
    return notation_.named(name) + notation_.bracketed(arguments);
  }

  const Function& f_;
  Notation notation_;
  FormulaStyle style_;
  Uses uses_;
  std::vector<Formula> formulas_;
  std::size_t n_shared_ = 0;
  std::string out_;
};

}  // namespace

std::string to_latex(const Function& function, const FormulaStyle& style) {
  FormulaStyle own = style;
  if (own.open.empty() && own.close.empty()) own.open = "\\[ ", own.close = " \\]";
  return Printer(compact(function), {.latex = true}, own).print();
}

std::string to_mathml(const Function& function, const FormulaStyle& style) {
  FormulaStyle own = style;
  if (own.open.empty() && own.close.empty()) own.open = "<math display=\"block\">", own.close = "</math>";
  return Printer(compact(function), {.latex = false}, own).print();
}

std::size_t shared_values(const Function& function) {
  const Function f = compact(function);
  const Uses uses(f);
  std::size_t n = 0;
  for (NodeId id = 0; id < f.graph.size(); ++id)
    n += !is_leaf(f.graph[id].op) && uses.by_values[id] > 1 && !uses.is_output[id];
  return n;
}

}  // namespace dyntape
