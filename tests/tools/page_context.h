// SPDX-License-Identifier: BSD-3-Clause
//
// The variables that blocks of the pages use without a declaration (page_programs.py).
#pragma once

#include <numbers>
#include <vector>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/batch/ddp_batch.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/printed/controller.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/files/task/task_spec.h>
#include <dyntape/interface/motion/capsules.h>
#include <dyntape/interface/motion/centroidal_problem.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/run/solve/solve.h>

using namespace dyntape;

template <class... Values>
void use(const Values&...);
void apply(const Eigen::VectorXd& control);

extern Problem problem, p, next, stance, flight, landing;
extern MeshOptions mesh;
extern StagedNlp nlp;
extern NlpSolution solution;
extern RobotScene scene;
extern double t;
extern std::size_t k;
extern Eigen::VectorXd measured, u0, x0, planned, q0, v0, q1, v1, q, lower, upper;
extern Eigen::MatrixXd starts;
extern Eigen::Vector3d position, foot, head;
extern Eigen::Matrix3d orientation;
extern ControlUnit unit;
extern StageFunction v;
