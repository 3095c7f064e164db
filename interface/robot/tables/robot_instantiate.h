// SPDX-License-Identifier: BSD-3-Clause
//
// Compiles the table of robot functions for one more scalar.  Use it in a .cpp file for which dynamics/ is
// instantiated too:
//
//   #include "my_scalar.h"
//   #include <dyntape/interface/robot/tables/robot_instantiate.h>
//   DYNTAPE_INSTANTIATE_ROBOT(my::Scalar)    // at global scope
#pragma once

#include <dyntape/interface/robot/tables/robot_reduction.hxx>
#include <dyntape/interface/robot/tables/robot_table.hxx>

#include <algorithm>
#include <string>
#include <utility>

namespace dyntape::detail {

template <class T>
RobotWorkspace<T>::RobotWorkspace(const dynamics::Model<T>& robot, const RobotFunction& function)
    : model(robot),
      data(robot),
      row(robot_rows<T>()[static_cast<std::size_t>(function.row())]),
      sizes(sizes_of(robot, function)),
      in(function.in) {
  if (!function.mimics.empty()) {
    reduction_ = std::make_unique<RobotReduction<T>>(robot, function.mimics, row, sizes);
    data.following = following(*mimic());
  }
  if (row.needs & (kFrame | kContacts)) {
    frame = function.frame.empty() ? static_cast<int>(model.frames.size()) - 1
                                   : model.frame_index(function.frame);
  }
  if (row.needs & kContacts) {
    for (const std::string& name : function.contacts) contacts.push_back(model.frame_index(name));
    if (contacts.empty()) contacts.push_back(frame);
  }
  const int behind = inputs_behind_q(row.inputs);
  state.q.resize(sizes.nq);
  dynamics::VectorX<T>* const rest[] = {&state.v, &state.w, &state.mu};
  for (int i = 0; i < behind; ++i) rest[i]->resize(sizes.nv);
}

template <class T>
RobotWorkspace<T>::~RobotWorkspace() = default;

// Holds the origins of the contacts.  Without stabilisation their positions in the world have no influence.
template <class T>
dynamics::ConstraintData<T>& RobotWorkspace<T>::constraints() {
  if (!constraints_) {
    std::vector<dynamics::Constraint<T>> held;
    for (int contact : contacts) {
      held.push_back(dynamics::point_constraint(model, contact, dynamics::Vector3<T>::Zero()));
      held.back().kp = held.back().kd = 0;
    }
    constraints_ = std::make_unique<dynamics::ConstraintData<T>>(model, held);
  }
  return *constraints_;
}

template <class T>
dynamics::ConstrainedHessian<T>& RobotWorkspace<T>::constrained_hessian() {
  if (!constrained_hessian_) {
    constrained_hessian_ = std::make_unique<dynamics::ConstrainedHessian<T>>(model, constraints());
  }
  return *constrained_hessian_;
}

template <class T>
void RobotWorkspace<T>::read(const T* from) {
  for (dynamics::VectorX<T>* part : {&state.q, &state.v, &state.w, &state.mu}) {
    std::copy(from, from + part->size(), part->data());
    from += part->size();
  }
}

template <class T>
void RobotWorkspace<T>::run(const RobotState<T>& at) {
  row.run(*this, reduction_ ? reduction_->expanded(at) : at);
}

template <class T>
void RobotWorkspace<T>::write(T* to) {
  RobotWriter<T> writer(reduction_ ? reduction_->full_result() : to);
  row.write(*this, writer);
  if (reduction_) reduction_->reduce(to);
}

template <class T>
void RobotWorkspace<T>::write(std::span<T> room, typename RobotWriter<T>::Take take) {
  RobotWriter<T> writer(room, std::move(take));
  row.write(*this, writer);
  writer.finish();
}

template <class T>
const dynamics::MimicModel<T>* RobotWorkspace<T>::mimic() const {
  return reduction_ ? &reduction_->mimic() : nullptr;
}

template <class T>
dynamics::VectorX<T> RobotWorkspace<T>::integrate(const dynamics::VectorX<T>& q,
                                                  const dynamics::VectorX<T>& d) const {
  return reduction_ ? dynamics::integrate<T>(*mimic(), q, d) : dynamics::integrate<T>(model, q, d);
}

template <class T>
std::size_t RobotWorkspace<T>::n_in() const {
  return static_cast<std::size_t>(sizes.nq + inputs_behind_q(row.inputs) * sizes.nv);
}

template <class T>
std::size_t RobotWorkspace<T>::n_out() const {
  int n = 0;
  for (const BlockShape& shape : row.outputs) n += size_of(shape, sizes);
  return static_cast<std::size_t>(n);
}

}  // namespace dyntape::detail

#define DYNTAPE_INSTANTIATE_ROBOT(T)                        \
  namespace dyntape::detail {                               \
  template struct RobotWorkspace<T>;                        \
  template const std::vector<RobotRow<T>>& robot_rows<T>(); \
  }
