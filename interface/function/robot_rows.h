// SPDX-License-Identifier: BSD-3-Clause
//
// What a row of the table of functions says (robot_table.h), and how a row is run.  Internal.
//
//   .inputs    what the state holds, in this order: q v (a | tau) mu
//   .outputs   blocks of the result: name, rows, columns, pages
//   .of, .by   for a derivative: the row of its value, which takes the same state, and the inputs it is taken by;
//              its blocks are then, for each block of the value, one for each of these inputs
//   .needs     what must be told besides
//   .run       computes; .write gives the result out
// Rows know nothing of joints that follow others: they see full vectors, and a Data that is told (following.h).
#pragma once

#include <dyntape/interface/function/robot_work.h>

#include <algorithm>
#include <string>

namespace dyntape::detail {

// kNv: torques, and derivatives by q, v and a; kNvMoved: velocities and accelerations, and derivatives by torques.
// The two part ways where joints follow others (robot_reduction.h); k3Nv, k3NvMoved: q, v and a | tau together.
enum class Extent { kOne, k3, k6, kNv, kNvMoved, k3Nv, k3NvMoved, k10Bodies, kContactRows };

struct BlockShape {
  const char* name;
  Extent rows = Extent::kOne, cols = Extent::kOne, pages = Extent::kOne;
};

enum Need : unsigned { kNothing = 0, kInertia = 1, kFrame = 2, kContacts = 4 };

template <class T>
struct RobotRow {
  const char* name;
  const char* what;
  const char* inputs;
  std::vector<BlockShape> outputs;
  const char* of = "";
  const char* by = "";
  unsigned needs = kNothing;
  void (*run)(RobotWork<T>&, const RobotState<T>&);
  void (*write)(const RobotWork<T>&, RobotWriter<T>&);
};

// The table.
template <class T>
const std::vector<RobotRow<T>>& robot_rows();

// --- Sizes -----------------------------------------------------------------------------------------------

template <class T>
RobotSizes sizes_of(const dynamics::Model<T>& model, const RobotFunction& function) {
  const int followers = static_cast<int>(function.mimics.size());
  return {model.nq - followers, model.nv - followers, model.njoints(),
          std::max(1, static_cast<int>(function.contacts.size()))};
}

inline int extent(Extent e, const RobotSizes& sizes) {
  switch (e) {
    case Extent::k3:
      return 3;
    case Extent::k6:
      return 6;
    case Extent::kNv:
    case Extent::kNvMoved:
      return sizes.nv;
    case Extent::k3Nv:
    case Extent::k3NvMoved:
      return 3 * sizes.nv;
    case Extent::k10Bodies:
      return 10 * sizes.bodies;
    case Extent::kContactRows:
      return 3 * sizes.contacts;
    case Extent::kOne:
      break;
  }
  return 1;
}

inline int size_of(const BlockShape& shape, const RobotSizes& sizes) {
  return extent(shape.rows, sizes) * extent(shape.cols, sizes) * extent(shape.pages, sizes);
}

// Number of inputs behind q: 0 to 3.
inline int inputs_behind_q(const char* inputs) {
  return static_cast<int>(std::count(inputs, inputs + std::char_traits<char>::length(inputs), ' '));
}

// Which inputs (0: q) a derivative is taken by.
std::vector<int> derived_by(const RobotFunction& derivative);

// --- Work ------------------------------------------------------------------------------------------------

template <class T>
RobotWork<T>::RobotWork(const dynamics::Model<T>& robot, const RobotFunction& function)
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

// The origins of the contacts are held where they are: without stabilisation nothing asks where that is.
template <class T>
dynamics::ConstraintData<T>& RobotWork<T>::constraints() {
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
void RobotWork<T>::read(const T* from) {
  for (dynamics::VectorX<T>* part : {&state.q, &state.v, &state.w, &state.mu}) {
    std::copy(from, from + part->size(), part->data());
    from += part->size();
  }
}

template <class T>
void RobotWork<T>::run(const RobotState<T>& at) {
  row.run(*this, reduction_ ? reduction_->expanded(at) : at);
}

template <class T>
void RobotWork<T>::write(T* to) {
  RobotWriter<T> writer(reduction_ ? reduction_->full_result() : to);
  row.write(*this, writer);
  if (reduction_) reduction_->reduce(to);
}

template <class T>
const dynamics::MimicModel<T>* RobotWork<T>::mimic() const {
  return reduction_ ? &reduction_->mimic() : nullptr;
}

template <class T>
dynamics::VectorX<T> RobotWork<T>::integrate(const dynamics::VectorX<T>& q,
                                             const dynamics::VectorX<T>& d) const {
  return reduction_ ? dynamics::integrate<T>(*mimic(), q, d) : dynamics::integrate<T>(model, q, d);
}

template <class T>
std::size_t RobotWork<T>::n_in() const {
  return static_cast<std::size_t>(sizes.nq + inputs_behind_q(row.inputs) * sizes.nv);
}

template <class T>
std::size_t RobotWork<T>::n_out() const {
  int n = 0;
  for (const BlockShape& shape : row.outputs) n += size_of(shape, sizes);
  return static_cast<std::size_t>(n);
}

}  // namespace dyntape::detail

#include <dyntape/interface/function/robot_reduction.h>
#include <dyntape/interface/function/robot_table.h>
