// SPDX-License-Identifier: BSD-3-Clause
//
// What a row of the table (robot_rows.h) works with, in any scalar that robot_table.hxx is instantiated for: double and
// AD in dyntape_interface; packs, float and 113 bits in dyntape_scalars.  Internal.
//
//   RobotWorkspace<double> work(model, RobotFunction("crba"));
//   work.evaluate(state, result);            // from and to arrays of n_in(), n_out() numbers
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/algorithms/operational_space.h>
#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/algorithms/second_order.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/interface/robot/robot_function.h>

#include <memory>

namespace dyntape::detail {

// A state taken apart; empty beyond what the function takes.
template <class T>
struct RobotState {
  dynamics::VectorX<T> q, v, w, mu;  // w: a or tau
};

// Results go out in the order of robot_functions.h.
template <class T>
class RobotWriter {
 public:
  explicit RobotWriter(T* y) : y_(y) {}

  void operator()(const T& number) { *y_++ = number; }
  template <class M>
  void operator()(const Eigen::MatrixBase<M>& block) {
    for (Eigen::Index i = 0; i < block.rows(); ++i) {
      for (Eigen::Index j = 0; j < block.cols(); ++j) *y_++ = block(i, j);
    }
  }
  // Page (i, j, k) with k running first.
  void operator()(const dynamics::Tensor3<T>& tensor) {
    const int n = tensor.size();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) *y_++ = tensor(i, j, k);
      }
    }
  }
  void operator()(const dynamics::Motion<T>& m) { write_pair(m.linear, m.angular); }
  void operator()(const dynamics::Force<T>& f) { write_pair(f.linear, f.angular); }

 private:
  void write_pair(const dynamics::Vector3<T>& linear, const dynamics::Vector3<T>& angular) {
    (*this)(linear);
    (*this)(angular);
  }

  T* y_;
};

template <class T>
struct RobotRow;
template <class T>
class RobotReduction;

struct RobotSizes {
  int nq = 0, nv = 0, bodies = 0, contacts = 0;
};

// One thread at a time.  Working memory of a part of dynamics/ is there once a row has asked for it.
template <class T>
struct RobotWorkspace {
  RobotWorkspace(const dynamics::Model<T>& robot, const RobotFunction& function);
  ~RobotWorkspace();

  void read(const T* from);
  void run() { run(state); }
  void run(const RobotState<T>& at);
  void write(T* to);
  void evaluate(const T* from, T* to) {
    read(from);
    run();
    write(to);
  }
  std::size_t n_in() const;
  std::size_t n_out() const;
  // The rules that joints follow; null for most robots.
  const dynamics::MimicModel<T>* mimic() const;
  // q (+) d in the entries that a state has.
  dynamics::VectorX<T> integrate(const dynamics::VectorX<T>& q, const dynamics::VectorX<T>& d) const;

  const dynamics::Model<T>& model;  // the caller keeps it
  dynamics::Data<T> data;
  RobotState<T> state;
  const RobotRow<T>& row;
  RobotSizes sizes;  // of what goes in and out: without joints that follow others
  int frame = -1;
  dynamics::ReferenceFrame in;
  std::vector<int> contacts;

  dynamics::Centroidal<T>& centroidal() { return of(centroidal_); }
  dynamics::EnergyGradients<T>& energy() { return of(energy_); }
  dynamics::KinematicDerivatives<T>& kinematics() { return of(kinematics_); }
  dynamics::KinematicHessian<T>& kinematic_hessian() { return of(kinematic_hessian_); }
  dynamics::RegressorData<T>& regressor() { return of(regressor_); }
  dynamics::SecondOrder<T>& second_order() { return of(second_order_); }
  dynamics::ForwardSecondOrder<T>& forward_second_order() { return of(forward_second_order_); }
  dynamics::Hessian<T>& hessian() { return of(hessian_); }
  dynamics::OperationalSpace<T>& operational_space() { return of(operational_space_); }
  dynamics::ConstraintData<T>& constraints();

  const dynamics::Centroidal<T>& centroidal() const { return *centroidal_; }
  const dynamics::EnergyGradients<T>& energy() const { return *energy_; }
  const dynamics::KinematicDerivatives<T>& kinematics() const { return *kinematics_; }
  const dynamics::KinematicHessian<T>& kinematic_hessian() const { return *kinematic_hessian_; }
  const dynamics::RegressorData<T>& regressor() const { return *regressor_; }
  const dynamics::SecondOrder<T>& second_order() const { return *second_order_; }
  const dynamics::ForwardSecondOrder<T>& forward_second_order() const { return *forward_second_order_; }
  const dynamics::Hessian<T>& hessian() const { return *hessian_; }
  const dynamics::OperationalSpace<T>& operational_space() const { return *operational_space_; }
  const dynamics::ConstraintData<T>& constraints() const { return *constraints_; }

 private:
  template <class Part>
  Part& of(std::unique_ptr<Part>& part) {
    if (!part) part = std::make_unique<Part>(model);
    return *part;
  }

  std::unique_ptr<RobotReduction<T>> reduction_;  // where joints follow others
  std::unique_ptr<dynamics::Centroidal<T>> centroidal_;
  std::unique_ptr<dynamics::EnergyGradients<T>> energy_;
  std::unique_ptr<dynamics::KinematicDerivatives<T>> kinematics_;
  std::unique_ptr<dynamics::KinematicHessian<T>> kinematic_hessian_;
  std::unique_ptr<dynamics::RegressorData<T>> regressor_;
  std::unique_ptr<dynamics::SecondOrder<T>> second_order_;
  std::unique_ptr<dynamics::ForwardSecondOrder<T>> forward_second_order_;
  std::unique_ptr<dynamics::Hessian<T>> hessian_;
  std::unique_ptr<dynamics::OperationalSpace<T>> operational_space_;
  std::unique_ptr<dynamics::ConstraintData<T>> constraints_;
};

}  // namespace dyntape::detail
