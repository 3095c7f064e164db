/* SPDX-License-Identifier: BSD-3-Clause
 *
 * The C interface of a peer: another library that computes what dyntape computes, compiled into a library
 * of its own, so that `dyntape bench --peer` can time both in one process.
 *
 *   peer = build(joints, n, gravity);             the robot, copied
 *   choose(peer, &frame, in, contacts, n);        what functions of a frame and of contacts are about
 *   load(peer, states, count, width);             states, row by row: q, then v, then a | tau as far as given
 *   f = find(peer, "rnea");                       < 0: the peer has no such function
 *   run(peer, f, first, calls);                   evaluates states first, first + 1, ..., cyclically; no output
 *   result(peer, f, i, y, size);                  the value at state i, in the order of dyntape's own function
 *
 * No function throws; build returns null where a joint type is unknown to the peer.
 */
#ifndef DYNTAPE_PEER_H
#define DYNTAPE_PEER_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  const char* type;   /* as dyntape names it: "revolute", "free-flyer", ... */
  int parent;         /* index of the parent joint, -1: the world */
  double axis[3];     /* unit length */
  double pitch;       /* of a helical joint, m/rad */
  double rotation[9]; /* of the fixed side in the parent, row by row */
  double translation[3];
  double mass, com[3];
  double inertia[6]; /* about the centre of mass: xx, xy, yy, xz, yz, zz */
  double armature;   /* on every degree of freedom of the joint */
} dyntape_peer_joint;

typedef struct {
  int joint; /* the body it is fixed to, -1: the world */
  double rotation[9], translation[3];
} dyntape_peer_frame;

typedef struct {
  const char* name; /* "Pinocchio 4.1.0" */
  void* (*build)(const dyntape_peer_joint* joints, int count, const double* gravity);
  void (*destroy)(void* peer);
  /* in: 0 the frame itself, 1 the world, 2 the world's axes at the frame */
  void (*choose)(void* peer, const dyntape_peer_frame* frame, int in, const dyntape_peer_frame* contacts,
                 int count);
  int (*load)(void* peer, const double* states, int count, int width); /* 0: as the robot has it */
  int (*find)(void* peer, const char* function);
  void (*run)(void* peer, int function, int first, int calls);
  int (*result)(void* peer, int function, int state, double* y, int size); /* entries written, -1: too many */
} dyntape_peer;

/* The one symbol of the library. */
const dyntape_peer* dyntape_peer_table(void);

#ifdef __cplusplus
}
#endif
#endif
