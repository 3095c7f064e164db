// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/printed/print_controller.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/print/c_text.h>
#include <dyntape/interface/control/printed/print_loops.h>
#include <dyntape/interface/io/number.h>

#include "algorithm.inc"

namespace dyntape {

namespace {

// @NAME@ by a value.
std::string filled(std::string text, const std::vector<std::pair<std::string, std::string>>& values) {
  for (const auto& [name, value] : values) {
    const std::string mark = "@" + name + "@";
    for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += value.size())
      text.replace(at, mark.size(), value);
  }
  return text;
}

std::string upper(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return char(std::toupper(c)); });
  return name;
}

std::size_t at_least_one(std::size_t n) { return std::max<std::size_t>(n, 1); }

// A point's functions with their derivatives.
struct PrintedPoint {
  explicit PrintedPoint(const PointFunctions& f, std::size_t states)
      : next(states),
        pattern(derive(f.first, Order::kFirst).jacobian),
        dynamics(pattern, 0, states),
        rows(pattern, states, states + f.rows),
        cost{{pattern, states + f.rows, states + f.rows + f.squares},
             {pattern, first_plain(f), first_plain(f) + (f.has_plain ? 1 : 0)},
             {pattern, first_plain(f) + (f.has_plain ? 1 : 0), f.first.n_y()},
             states + f.rows} {}

  std::size_t first_plain(const PointFunctions& f) const { return next + f.rows + f.squares; }

  std::size_t next;
  Pattern pattern;
  SparseRows dynamics, rows;
  CostRows cost;
};

class ControllerPrinter {
 public:
  ControllerPrinter(const ControllerParts& parts, const ControllerOptions& options)
      : parts_(parts),
        options_(options),
        problem_(parts.problem),
        n_x_(std::size_t(problem_.n_x())),
        n_u_(std::size_t(problem_.n_u())),
        n_z_(n_x_ + n_u_),
        n_(parts.times.size() - 1),
        n_p_(parts.parameter_names.size()),
        stage_(parts.stage, n_x_),
        end_(parts.end, 0) {
    result_.name = codegen::c_identifier(options.name.empty() ? problem_.name : options.name);
    if (result_.name == "dt")
      refuse(problem_,
             "its functions in C would begin with dt_, as those inside the text do; expected another name");
    result_.single = options.single;
    result_.n_x = int(n_x_), result_.n_u = int(n_u_), result_.intervals = int(n_);
    result_.times = parts.times;
    result_.parameter_names = parts.parameter_names;
    for (const ControllerSide& side : parts.stage.sides) result_.bounds.push_back(side.name);
  }

  PrintedController run() {
    const codegen::EmbeddedSource functions = print_functions();
    codegen::Source& source = result_.source;
    source.name = result_.name;
    // No library function is left: the include of math.h is for those that the text replaces.
    source.text = "#include \"" + result_.name + ".h\"\n\n" + without_library(functions.source.text) +
                  wrappers() + sizes() + tables() + loops() + algorithm();
    source.header = header();
    count_memory(functions);
    return std::move(result_);
  }

 private:
  std::string number(double value) const {
    std::string text;
    options_.single ? codegen::append_single(text, value) : codegen::append_number(text, value);
    return text;
  }

  codegen::EmbeddedSource print_functions() {
    const std::vector<EmbeddedPart> functions = {{"dt_of_stage_value", parts_.stage.value, Order::kValue},
                                                 {"dt_of_stage_first", parts_.stage.first, Order::kFirst},
                                                 {"dt_of_end_value", parts_.end.value, Order::kValue},
                                                 {"dt_of_end_first", parts_.end.first, Order::kFirst}};
    CodegenOptions codegen;
    codegen.label = result_.name;
    codegen.functions = Functions::kSines;
    codegen::EmbeddedSource source = generate_embedded_parts(functions, codegen, options_.single);
    std::string missing;
    for (const std::string& call : source.calls) {
      if (call != "fabs" && call != "sqrt") missing += (missing.empty() ? "" : ", ") + call;
    }
    if (!missing.empty())
      refuse(problem_, "its functions or their derivatives call " + missing +
                           " of a library, which a controller in C does without; expected additions, "
                           "multiplications, divisions, square roots, sin and cos");
    return source;
  }

  // The absolute value is no call, and square root and infinity are the text's own.
  std::string without_library(std::string text) const {
    if (text.find("NAN") != std::string::npos)
      refuse(problem_, "its functions have a constant that is not a number (NaN)");
    const auto erase = [&](const std::string& line) {
      const std::size_t at = text.find(line);
      if (at != std::string::npos) text.erase(at, line.size());
    };
    erase("#include <math.h>\n"), erase("#define fabs(a) fabsf(a)\n"), erase("#define sqrt(a) sqrtf(a)\n");
    const std::string type = "typedef " + std::string(options_.single ? "float" : "double") + " real;\n";
    std::string own;
    if (text.find("fabs(") != std::string::npos) own += "#define fabs(a) (((a) < 0) ? -(a) : (a))\n";
    if (text.find("HUGE_VAL") != std::string::npos)
      own += "#define HUGE_VAL ((real)1 / (real)0)\n#define HUGE_VALF HUGE_VAL\n";
    const bool has_root = text.find("sqrt(") != std::string::npos;
    if (has_root)
      own += filled(kRootText, {{"BITS", options_.single ? "uint32_t" : "uint64_t"},
                                {"MAGIC", options_.single ? "0x5f3759dfu" : "0x5fe6eb50c7b537a9u"},
                                {"SPLIT", options_.single ? "4097.0f" : "134217729.0"}});
    if (has_root && text.find("#include <stdint.h>\n") == std::string::npos)
      text = "#include <stdint.h>\n" + text;
    text.insert(text.find(type) + type.size(), own);
    return text;
  }

  // Functions of points without the parameters that they do not have.
  std::string wrappers() const {
    std::string text;
    const auto wrap = [&](const std::string& name, std::size_t z, std::size_t y, const Pattern* jacobian) {
      const bool has_jacobian = jacobian != nullptr && jacobian->nnz() > 0;
      text += "static void dt_" + name + "(const real z[" + std::to_string(z) + "], const real p[" +
              std::to_string(n_p_) + "], real y[]" + (jacobian ? ", real jacobian[]" : "") + ") {\n";
      if (y == 0) text += "  (void)y;\n";
      if (jacobian && !has_jacobian) text += "  (void)jacobian;\n";
      text +=
          "  dt_of_" + name + "(z, p" + (y ? ", y" : "") + (has_jacobian ? ", jacobian" : "") + ");\n}\n\n";
    };
    wrap("stage_value", n_z_, parts_.stage.value.n_y(), nullptr);
    wrap("stage_first", n_z_, parts_.stage.first.n_y(), &stage_.pattern);
    wrap("end_value", n_x_, parts_.end.value.n_y(), nullptr);
    wrap("end_first", n_x_, parts_.end.first.n_y(), &end_.pattern);
    return text;
  }

  std::string sizes() const {
    const PointFunctions &stage = parts_.stage, &end = parts_.end;
    const std::size_t products = n_ * (2 * stage.sides.size() - stage.hard) + 2 * end.sides.size();
    std::string text = "/* Sizes. */\n";
    const auto define = [&](const std::string& name, std::size_t value) {
      text += "#define DT_" + name + " " + std::to_string(value) + "\n";
    };
    const auto define_number = [&](const std::string& name, double value) {
      text += "#define DT_" + name + " " + number(value) + "\n";
    };
    define("N", n_), define("NX", n_x_), define("NU", n_u_), define("NZ", n_z_), define("NP", n_p_);
    define("ROWS", stage.rows), define("END_ROWS", end.rows);
    define("VALUES", n_z_ + at_least_one(stage.rows)), define("END_VALUES", n_x_ + at_least_one(end.rows));
    define("SIDES", stage.sides.size()), define("HARD", stage.hard), define("END_SIDES", end.sides.size());
    define("AB", stage_.dynamics.nnz), define("D", stage_.rows.nnz), define("END_D", end_.rows.nnz);
    define("STAGE_Y", at_least_one(stage.first.n_y())), define("END_Y", at_least_one(end.first.n_y()));
    define("STAGE_JACOBIAN", at_least_one(stage_.pattern.nnz()));
    define("END_JACOBIAN", at_least_one(end_.pattern.nnz()));
    define("VALUE_Y", stage.value.n_y()), define("END_VALUE_Y", end.value.n_y());
    define("MOST_ITERATIONS", std::size_t(options_.iterations));
    define("INTERIOR", std::size_t(options_.interior_steps)), define("TRIALS", std::size_t(options_.trials));
    if (parts_.n_parameters > 0) define("FIXED_P", 1);
    const bool single = options_.single;
    define_number("PRICE", options_.price);
    define_number("MU_COLD", options_.price), define_number("MU_WARM", std::min(1e-3, 1e-3 * options_.price));
    define_number("MU_END", mu_end()), define_number("PRECISION", mu_end() * double(products));
    define_number("SHORT", 0.2), define_number("GIVE", single ? 1e-6 : 1e-8);
    define_number("GAP", 0.1 * tolerance());
    define_number("LEFT", single ? 1e-3 : 1e-6);
    define_number("LEAST_PIVOT", 1e-20);
    define_number("SMALL", 1e-10), define_number("LARGEST_PRICE", 1e3 * options_.price);
    define_number("ROUNDING", single ? 1e-6 : 1e-14);
    define_number("TOLERANCE", tolerance());
    define_number("ONE_OVER_STEP", 1 / parts_.step);
    define_number("ONE_OVER_PRODUCTS", products > 0 ? 1 / double(products) : 0);
    define_number("COST_UNIT", parts_.cost_unit);
    return text + "\n";
  }

  double tolerance() const {
    return options_.tolerance > 0 ? options_.tolerance : options_.single ? 1e-3 : 1e-4;
  }

  // The last product of slack and multiplier.  If both are small, they move the plan by its root.
  double mu_end() const {
    return std::clamp(tolerance() * tolerance(), options_.single ? 1e-7 : 1e-13, 1e-4);
  }

  // "static const real name[n] = {...};"
  template <class Values, class Text>
  std::string table(const std::string& type, const std::string& name, const Values& values,
                    Text text_of) const {
    std::string text =
        "static const " + type + " " + name + "[" + std::to_string(at_least_one(values.size())) + "] = {";
    std::size_t begin = text.size() - 40;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) text += ",";
      if (text.size() - begin > 100) text += "\n ", begin = text.size();
      if (i > 0) text += " ";
      text += text_of(values[i]);
    }
    if (values.empty()) text += "0";
    return text + "};\n";
  }

  std::string table(const std::string& name, const std::vector<double>& values) const {
    return table("real", name, values, [&](double value) { return number(value); });
  }

  // Rows in braces of their own.
  std::string matrix(const std::string& name, const std::vector<double>& values, std::size_t columns) const {
    const std::size_t rows = values.size() / columns;
    std::string text =
        "static const real " + name + "[" + std::to_string(rows) + "][" + std::to_string(columns) + "] = {\n";
    for (std::size_t r = 0; r < rows; ++r) {
      text += "  {";
      for (std::size_t c = 0; c < columns; ++c) text += (c ? ", " : "") + number(values[r * columns + c]);
      text += r + 1 < rows ? "},\n" : "}};\n";
    }
    return text;
  }

  std::string side_tables(const std::string& name, const std::vector<ControllerSide>& sides) const {
    const auto index = [](const ControllerSide& s) { return std::to_string(s.entry); };
    return table("int", "dt_" + name + "_entry", sides, index) +
           table("real", "dt_" + name + "_factor", sides,
                 [&](const ControllerSide& s) { return number(s.factor); }) +
           table("real", "dt_" + name + "_bound", sides,
                 [&](const ControllerSide& s) { return number(s.bound); });
  }

  std::string tables() const {
    std::vector<double> inverse, damping, parameters;
    for (double nominal : parts_.nominal) {
      inverse.push_back(1 / nominal);
      damping.push_back((options_.single ? 1e-7 : 1e-9) / (nominal * nominal));
    }
    for (double t : parts_.times) {
      const Eigen::VectorXd p = controller_parameters(problem_, t);
      parameters.insert(parameters.end(), p.begin(), p.end());
    }
    std::string text = side_tables("side", parts_.stage.sides) + side_tables("end_side", parts_.end.sides);
    text += table("dt_gap_factor", inverse) + table("dt_damping", damping);
    if (parts_.n_parameters > 0)
      text += table("int", "dt_caller_parameter", callers(), [](std::size_t i) { return std::to_string(i); });
    return text + matrix("dt_guess", parts_.guess, n_z_) + matrix("dt_parameters", parameters, n_p_) + "\n";
  }

  // By column of p; the first is the time.
  std::vector<std::size_t> callers() const {
    std::vector<std::size_t> all = {0};
    all.insert(all.end(), parts_.caller_parameter.begin(), parts_.caller_parameter.end());
    return all;
  }

  std::string loops() const {
    return "/* Products with the non-zeros of Jacobians. */\n\n" + print_cost("dt_stage_cost", stage_.cost) +
           print_cost("dt_end_cost", end_.cost) + print_transform("dt_transform", stage_.dynamics) +
           print_transpose("dt_transpose", stage_.dynamics) + print_apply("dt_apply", stage_.dynamics) +
           print_square("dt_rows_square", stage_.rows) + print_pull("dt_rows_pull", stage_.rows) +
           print_apply("dt_rows_apply", stage_.rows) + print_square("dt_end_rows_square", end_.rows) +
           print_pull("dt_end_rows_pull", end_.rows) + print_apply("dt_end_rows_apply", end_.rows);
  }

  std::string algorithm() const {
    std::string text = "typedef " + result_.name + "_side dt_side;\n\n";
    for (const char* part : {kLimitsText, kModelText, kRiccatiText, kInteriorText, kSearchText}) text += part;
    if (parts_.n_parameters > 0) text += kParametersText;
    return filled(text + kStepText, marks());
  }

  std::vector<std::pair<std::string, std::string>> marks() const {
    return {{"NAME", result_.name},
            {"NAME_UP", upper(result_.name)},
            {"NX", std::to_string(n_x_)},
            {"NU", std::to_string(n_u_)},
            {"CALLER_P", std::to_string(std::max(parts_.n_parameters, 1))},
            {"REAL", options_.single ? "float" : "double"}};
  }

  // Members of the state, numbers first; what callers may read or write comes before the rest.
  std::string state() {
    const std::size_t sides = at_least_one(parts_.stage.sides.size()),
                      ends = at_least_one(parts_.end.sides.size());
    std::string text;
    std::size_t numbers = 0;
    const auto member = [&](const std::string& name, const std::vector<std::size_t>& sizes,
                            const std::string& about, std::size_t* place = nullptr) {
      text += "  @REAL@ " + name;
      std::size_t count = 1;
      for (std::size_t n : sizes) text += "[" + std::to_string(n) + "]", count *= n;
      text += ";" + (about.empty() ? "" : " /* " + about + " */") + "\n";
      if (place) *place = numbers;
      numbers += count;
    };
    ControllerLayout& at = result_.layout;
    member("z", {n_ + 1, n_z_}, "the plan: states, then controls, of all points", &at.z);
    member("p", {n_ + 1, n_p_},
           "parameters of all points: " + codegen::c_comment(listed(parts_.parameter_names)), &at.p);
    member("bound", {sides}, codegen::c_comment(listed(result_.bounds)), &at.bound);
    std::vector<std::string> end_names;
    for (const ControllerSide& side : parts_.end.sides) end_names.push_back(side.name);
    member("end_bound", {ends}, codegen::c_comment(listed(end_names)), &at.end_bound);
    member("gain", {n_, n_u_, n_x_}, "feedback of each interval", &at.gain);
    member("begin", {}, "time of the plan, s", &at.begin);
    member("cost", {}, "of the plan", &at.cost);
    member("violation", {}, "the largest, of soft limits and of the dynamics, in nominal values",
           &at.violation);
    text += "  /* Work. */\n";
    member("gap_price", {}, ""), member("mu", {}, "");
    member("dz", {n_ + 1, n_z_}, ""), member("znew", {n_ + 1, n_z_}, "");
    member("ab", {n_, at_least_one(stage_.dynamics.nnz)}, ""), member("c", {n_, n_x_}, "");
    member("h", {n_, n_z_ * (n_z_ + 1) / 2}, ""), member("g", {n_, n_z_}, "");
    member("d", {n_, at_least_one(stage_.rows.nnz)}, ""), member("end_d", {at_least_one(end_.rows.nnz)}, "");
    member("end_h", {n_x_ * (n_x_ + 1) / 2}, ""), member("end_g", {n_x_}, "");
    member("pc", {n_, n_x_}, ""), member("factor", {n_, n_u_, n_u_}, ""),
        member("feedforward", {n_, n_u_}, "");
    text += "  @NAME@_side side[" + std::to_string(n_) + "][" + std::to_string(sides) +
            "];\n  @NAME@_side end_side[" + std::to_string(ends) + "];\n";
    numbers += 11 * (n_ * sides + ends);
    text +=
        "  int has_plan;\n  int iterations; /* of the last step */\n  int interior_steps; /* likewise */\n";
    at.numbers = numbers;
    result_.state_bytes = numbers * bytes() + 3 * sizeof(int);
    result_.state_bytes = (result_.state_bytes + bytes() - 1) / bytes() * bytes();
    return text;
  }

  static std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  }

  std::size_t bytes() const { return options_.single ? sizeof(float) : sizeof(double); }

  std::string header() {
    const std::string text = state();
    return filled(std::string(kHeaderText), {{"STATE", text},
                                             {"N", std::to_string(n_)},
                                             {"NZ", std::to_string(n_z_)},
                                             {"STATES", codegen::c_comment(listed(problem_.states))},
                                             {"CONTROLS", codegen::c_comment(listed(problem_.controls))},
                                             {"HOLD", parts_.n_parameters > 0 ? kHoldText : ""},
                                             {"MOST", std::to_string(options_.iterations)},
                                             {"NAME", result_.name},
                                             {"NAME_UP", upper(result_.name)},
                                             {"NX", std::to_string(n_x_)},
                                             {"NU", std::to_string(n_u_)},
                                             {"CALLER_P", std::to_string(std::max(parts_.n_parameters, 1))},
                                             {"REAL", options_.single ? "float" : "double"}});
  }

  void count_memory(const codegen::EmbeddedSource& functions) {
    const std::size_t sides = parts_.stage.sides.size(), ends = parts_.end.sides.size();
    const std::size_t sines = functions.source.text.find("dt_two_over_pi") == std::string::npos ? 0
                              : options_.single                                                 ? 36
                                                                                                : 156;
    result_.constant_bytes = bytes() * ((n_ + 1) * (n_z_ + n_p_) + 2 * (sides + ends) + 2 * n_z_) +
                             sizeof(int) * (sides + ends + (parts_.n_parameters > 0 ? n_p_ : 0)) + sines;
    // The deepest chain: a step, an iteration, and either the derivatives of a stage or a step of the recursion.
    constexpr std::size_t kFrame = 256, kDepth = 5;
    const std::size_t of_functions =
        bytes() * (parts_.stage.first.n_y() + stage_.pattern.nnz()) +
        *std::max_element(functions.stack_bounds.begin(), functions.stack_bounds.end());
    const std::size_t of_recursion =
        bytes() * (n_x_ * n_x_ + n_z_ * n_z_ + n_x_ * n_z_ + 2 * (n_z_ + parts_.stage.rows));
    result_.stack_bytes = std::max(of_functions, of_recursion) + kDepth * kFrame;
  }

  const ControllerParts& parts_;
  const ControllerOptions& options_;
  const Problem& problem_;
  const std::size_t n_x_, n_u_, n_z_, n_, n_p_;
  const PrintedPoint stage_, end_;
  PrintedController result_;
};

}  // namespace

PrintedController print_controller(const ControllerParts& parts, const ControllerOptions& options) {
  return ControllerPrinter(parts, options).run();
}

}  // namespace dyntape
