// SPDX-License-Identifier: BSD-3-Clause
//
// Pinocchio behind the interface of pinocchio_peer.h.  tests/bench/command/peer.cpp compiles it, once a machine.
#include "pinocchio_types.h"

#include <cstring>

namespace peer {

void prepare_contacts(Peer& peer);

Peer::Peer(const pin::Model& robot) : model(robot), data(robot), frame(robot.frames.size() - 1) {
  for (auto* x : {&J, &dV_dq, &dA_dq, &dA_dv, &dA_da, &dh_dq, &dh_dot_dq, &dh_dot_dv, &dh_dot_da}) {
    *x = Matrix6::Zero(6, robot.nv);
  }
}

namespace {

void* build(const dyntape_peer_joint* joints, int count, const double* gravity) {
  pin::Model model;
  if (!build_model(joints, count, gravity, model)) return nullptr;
  model.addFrame(pin::Frame("chosen", 0, 0, pin::SE3::Identity(), pin::OP_FRAME));
  return new Peer(model);
}

void destroy(void* peer) { delete static_cast<Peer*>(peer); }

void choose(void* handle, const dyntape_peer_frame* frame, int in, const dyntape_peer_frame* contacts,
            int count) {
  Peer& peer = *static_cast<Peer*>(handle);
  pin::Frame& chosen = peer.model.frames[peer.frame];
  chosen.parentJoint = static_cast<pin::JointIndex>(frame->joint + 1);
  chosen.placement = placement_of(frame->rotation, frame->translation);
  peer.in = in == 0 ? pin::LOCAL : in == 1 ? pin::WORLD : pin::LOCAL_WORLD_ALIGNED;
  peer.contacts.clear();
  for (int i = 0; i < count; ++i) {
    peer.contacts.emplace_back(pin::CONTACT_3D, peer.model,
                               static_cast<pin::JointIndex>(contacts[i].joint + 1),
                               placement_of(contacts[i].rotation, contacts[i].translation), pin::LOCAL);
  }
  prepare_contacts(peer);
}

int load(void* handle, const double* states, int count, int width) {
  Peer& peer = *static_cast<Peer*>(handle);
  const int nq = peer.model.nq, nv = peer.model.nv;
  if (width != nq && width != nq + nv && width != nq + 2 * nv) return 1;
  peer.states.clear();
  for (int i = 0; i < count; ++i) {
    Vector x = Vector::Zero(nq + 2 * nv);
    x.head(width) = Eigen::Map<const Vector>(states + static_cast<std::ptrdiff_t>(i) * width, width);
    peer.states.push_back({x.head(nq), x.segment(nq, nv), x.tail(nv)});
  }
  return 0;
}

// --- Functions -------------------------------------------------------------------------------------------

const std::vector<Function>& functions() {
  static const std::vector<Function> all = [] {
    std::vector<Function> list = dynamics_functions();
    for (const auto& more : {body_functions(), contact_functions()}) {
      list.insert(list.end(), more.begin(), more.end());
    }
    return list;
  }();
  return all;
}

int find(void*, const char* name) {
  for (std::size_t i = 0; i < functions().size(); ++i) {
    if (std::strcmp(functions()[i].name, name) == 0) return static_cast<int>(i);
  }
  return -1;
}

void run(void* handle, int function, int first, int calls) {
  Peer& peer = *static_cast<Peer*>(handle);
  const auto call = functions()[static_cast<std::size_t>(function)].run;
  std::size_t i = static_cast<std::size_t>(first) % peer.states.size();
  for (int k = 0; k < calls; ++k) {
    call(peer, peer.states[i]);
    if (++i == peer.states.size()) i = 0;
  }
}

int result(void* handle, int function, int state, double* y, int size) {
  Peer& peer = *static_cast<Peer*>(handle);
  const Function& f = functions()[static_cast<std::size_t>(function)];
  f.run(peer, peer.states[static_cast<std::size_t>(state)]);
  Writer to{y, size};
  f.write(peer, to);
  return to.written > size ? -1 : to.written;
}

const dyntape_peer kTable = {"Pinocchio " PINOCCHIO_VERSION, build, destroy, choose, load, find, run, result};

}  // namespace
}  // namespace peer

extern "C" __attribute__((visibility("default"))) const dyntape_peer* dyntape_peer_table() {
  return &peer::kTable;
}
