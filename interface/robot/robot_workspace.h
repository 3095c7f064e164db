// SPDX-License-Identifier: BSD-3-Clause
//
// The workspace of a row of the table (robot_rows.h), for any scalar that robot_table.hxx is instantiated for:
// double and AD in dyntape_interface; packs, float and 113 bits in dyntape_scalars.  Internal.
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
#include <dyntape/dynamics/contact/constrained_hessian.h>
#include <dyntape/interface/robot/robot_function.h>

#include <functional>
#include <memory>
#include <span>

namespace dyntape::detail {

// The parts of a state; parts that the function does not use are empty.
template <class T>
struct RobotState {
  dynamics::VectorX<T> q, v, w, mu;  // w: a or tau
};

// Writes results in the order of robot_functions.h, to an array or in parts to a callback.
template <class T>
class RobotWriter {
 public:
  using Take = std::function<void(const T* part, std::size_t count)>;

  explicit RobotWriter(T* y) : y_(y) {}
  // Passes on each part when it fills `room`; finish() passes on the rest.
  RobotWriter(std::span<T> room, Take take)
      : begin_(room.data()), y_(begin_), end_(begin_ + room.size()), take_(std::move(take)) {}

  void operator()(const T& number) {
    *y_++ = number;
    if (y_ == end_) finish();
  }
  template <class M>
  void operator()(const Eigen::MatrixBase<M>& block) {
    for (Eigen::Index i = 0; i < block.rows(); ++i) {
      for (Eigen::Index j = 0; j < block.cols(); ++j) (*this)(T(block(i, j)));
    }
  }
  // Page (i, j, k) with k fastest.
  void operator()(const dynamics::Tensor3<T>& tensor) {
    const int n = tensor.size();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) (*this)(tensor(i, j, k));
      }
    }
  }
  void operator()(const dynamics::Motion<T>& m) { write_pair(m.linear, m.angular); }
  void operator()(const dynamics::Force<T>& f) { write_pair(f.linear, f.angular); }

  void finish() {
    if (y_ != begin_) take_(begin_, static_cast<std::size_t>(y_ - begin_));
    y_ = begin_;
  }

 private:
  void write_pair(const dynamics::Vector3<T>& linear, const dynamics::Vector3<T>& angular) {
    (*this)(linear);
    (*this)(angular);
  }

  T *begin_ = nullptr, *y_, *end_ = nullptr;
  Take take_ = {};
};

template <class T>
struct RobotRow;
template <class T>
class RobotReduction;

struct RobotSizes {
  int nq = 0, nv = 0, bodies = 0, contacts = 0;
};

// Working memory of a part of dynamics/, made at its first use.
template <class T, class Part>
class OnDemand {
 public:
  explicit OnDemand(const dynamics::Model<T>& model) : model_(model) {}
  Part& operator()() {
    if (!part_) part_ = std::make_unique<Part>(model_);
    return *part_;
  }
  const Part& operator()() const { return *part_; }

 private:
  const dynamics::Model<T>& model_;
  std::unique_ptr<Part> part_;
};

// Not thread-safe.
template <class T>
struct RobotWorkspace {
  RobotWorkspace(const dynamics::Model<T>& robot, const RobotFunction& function);
  ~RobotWorkspace();

  void read(const T* from);
  void run() { run(state); }
  void run(const RobotState<T>& at);
  void write(T* to);
  // In parts, as RobotWriter; for robots without mimic joints.
  void write(std::span<T> room, typename RobotWriter<T>::Take take);
  void evaluate(const T* from, T* to) {
    read(from);
    run();
    write(to);
  }
  std::size_t n_in() const;
  std::size_t n_out() const;
  // The rules of mimic joints; null for most robots.
  const dynamics::MimicModel<T>* mimic() const;
  // q (+) d, for the entries of a state.
  dynamics::VectorX<T> integrate(const dynamics::VectorX<T>& q, const dynamics::VectorX<T>& d) const;

  const dynamics::Model<T>& model;  // owned by the caller
  dynamics::Data<T> data;
  RobotState<T> state;
  const RobotRow<T>& row;
  RobotSizes sizes;  // of inputs and outputs: without mimic joints
  int frame = -1;
  dynamics::ReferenceFrame in;
  std::vector<int> contacts;

  OnDemand<T, dynamics::Centroidal<T>> centroidal{model};
  OnDemand<T, dynamics::EnergyGradients<T>> energy{model};
  OnDemand<T, dynamics::KinematicDerivatives<T>> kinematics{model};
  OnDemand<T, dynamics::KinematicHessian<T>> kinematic_hessian{model};
  OnDemand<T, dynamics::RegressorData<T>> regressor{model};
  OnDemand<T, dynamics::SecondOrder<T>> second_order{model};
  OnDemand<T, dynamics::ForwardSecondOrder<T>> forward_second_order{model};
  OnDemand<T, dynamics::Hessian<T>> hessian{model};
  OnDemand<T, dynamics::OperationalSpace<T>> operational_space{model};
  dynamics::ConstraintData<T>& constraints();
  const dynamics::ConstraintData<T>& constraints() const { return *constraints_; }
  dynamics::ConstrainedHessian<T>& constrained_hessian();
  const dynamics::ConstrainedHessian<T>& constrained_hessian() const { return *constrained_hessian_; }

 private:
  std::unique_ptr<RobotReduction<T>> reduction_;  // with mimic joints
  std::unique_ptr<dynamics::ConstraintData<T>> constraints_;
  std::unique_ptr<dynamics::ConstrainedHessian<T>> constrained_hessian_;
};

}  // namespace dyntape::detail
