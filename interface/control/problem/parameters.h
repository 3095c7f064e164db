// SPDX-License-Identifier: BSD-3-Clause
//
// Parameters: numbers in terms and dynamics that change without recording or compiling again, e.g. a target or a
// load.
//
//   Parameters parameters;
//   const Parameter load = parameters.add("load", 2.0);                                    // kg
//   Problem p("lift", {"z", "v"}, {"u"}, 1.0,
//             [load](const auto& s) { return vector(s.x[1], s.u[0] / load(s)[0]); });
//   p.parameters = parameters;
//   const Parameter target = p.parameters.add("target", Eigen::Vector2d(1, 0));            // "target[0]", "target[1]"
//   p.add(running_squares("gap", [target](const auto& s) { return (s.x - target(s)).eval(); }));
//
//   StagedNlp nlp = discretize(p, mesh);                                                   // records, compiles
//   Parameters now = p.parameters;
//   now.set("target", Eigen::Vector2d(2, 0));
//   nlp.set_parameters(now);                                                               // no recording
//
// A value is constant, or a function of time, which is evaluated at every point of the mesh:
//   p.parameters.add("reference", [](double t) { return Eigen::VectorXd::Constant(1, std::sin(t)); });
//
// add() returns a handle (Parameter).  Applied to a stage of any scalar, it returns the vector of that parameter's
// entries.  It is valid for its list and for copies of the list.
//
// Errors.  ArgumentError: a name that is empty, taken or unknown (with the nearest), a value of another size than
// the first one, a matrix, an empty function, a value that is not finite (with its time).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/interface/control/problem/stage.h>

namespace dyntape {

// "gap[1]" for a vector, "gap" for a scalar.
std::string entry_name(const std::string& name, Eigen::Index i, Eigen::Index size);

class Parameter {
 public:
  template <class T>
  typename Stage<T>::Vector operator()(const Stage<T>& stage) const {
    require(stage.p.size());
    return stage.p.segment(first_, size_);
  }
  Eigen::Index first() const { return first_; }  // index in Stage::p
  Eigen::Index size() const { return size_; }

 private:
  friend class Parameters;
  Parameter(Eigen::Index first, Eigen::Index size) : first_(first), size_(size) {}
  void require(Eigen::Index available) const;  // ArgumentError

  Eigen::Index first_, size_;
};

// A number, a vector, or a function of time with a vector of constant size.
struct ParameterValue {
  using OfTime = std::function<Eigen::VectorXd(double t)>;

  ParameterValue(double value)
      : constant(Eigen::VectorXd::Constant(1, value)) {}  // NOLINT: a number is a value
  template <class Derived>
  ParameterValue(const Eigen::MatrixBase<Derived>& value)  // NOLINT
      : constant(value.rows() * value.cols()) {
    require_vector(value.rows(), value.cols());
    const typename Derived::PlainObject entries = value;
    for (Eigen::Index i = 0; i < constant.size(); ++i) constant[i] = entries(i);
  }
  template <class F>
  requires(std::is_invocable_r_v<Eigen::VectorXd, F, double> && !std::is_convertible_v<F, Eigen::VectorXd>)
      ParameterValue(F value)  // NOLINT
      : of_time(std::move(value)), constant(at_zero(of_time)) {}

  OfTime of_time;  // empty: constant
  Eigen::VectorXd constant;

 private:
  static void require_vector(Eigen::Index rows, Eigen::Index cols);  // ArgumentError
  static Eigen::VectorXd at_zero(const OfTime& of_time);             // ArgumentError if empty
};

class Parameters {
 public:
  Parameter add(const std::string& name, ParameterValue value);
  void set(const std::string& name, ParameterValue value);
  Parameter find(const std::string& name) const;

  Eigen::Index size() const { return size_; }    // of all entries
  std::vector<std::string> entry_names() const;  // "load", "target[0]", "target[1]"
  Eigen::VectorXd at(double t) const;            // (size()) values at a time (s)
  std::string first_of_time() const;             // the first parameter that varies with time, or ""
  Parameters later(double by) const;             // the same with times shifted by `by` (s)

  // ArgumentError unless `other` has the same names and sizes in the same order.
  void check_same(const Parameters& other) const;

 private:
  struct Entry {
    std::string name;
    Parameter place;
    ParameterValue value;
  };
  std::vector<std::string> names() const;
  std::size_t index(const std::string& name) const;

  std::vector<Entry> entries_;
  Eigen::Index size_ = 0;
};

}  // namespace dyntape
